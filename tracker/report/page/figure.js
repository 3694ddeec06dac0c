// The film with the figure on it: vectors in the film's own pixels, drawn for the current frame.

const UNSEEN = ["hidden", "lost", "outside"]; // outcomes in which limbs are predicted
const THIN = 1.5; // least width of a limb, pixels
const NEARER = 1.2; // size of the enlarged view relative to the figure's reach

/** Where a video finds the film: beside the page, or within it. */
function filmSource(link) {
  if (link) return link;
  const holder = document.querySelector("#film");
  const [text, block, parts] = [holder.textContent, 2 ** 22, []];
  for (let at = 0; at < text.length; at += block) {
    const bytes = atob(text.slice(at, at + block));
    const part = new Uint8Array(bytes.length);
    for (let i = 0; i < bytes.length; i++) part[i] = bytes.charCodeAt(i);
    parts.push(part);
  }
  holder.remove();
  return URL.createObjectURL(new Blob(parts, { type: "video/mp4" }));
}

// The value of each frame, from intervals of frames.
const everyFrame = (stretches) => stretches.flatMap(([start, end, value]) => Array(end - start).fill(value));

const pixels = (tenths) => tenths.map((number) => number / 10);

class Drawing {
  constructor(root, chapter, size, title) {
    [this.video, this.caption, this.screen] = ["video", "figcaption", ".screen"].map((name) => root.querySelector(name));
    Object.assign(this, { size, title, frame: -1, near: false, numbers: chapter.figure, words: chapter.words });
    this.outcomes = everyFrame(chapter.outcomes);
    this.motions = new Set(chapter.motions.map(([, , label]) => label)).size > 1 ? everyFrame(chapter.motions) : [];
    this.svg = shape("svg", { "aria-hidden": "true", preserveAspectRatio: "none" });
    this.limbs = this.layer("limbs", (links, at) => links.map(([start, link]) => `M${at.point(start)}L${at.point(1 + link)}`));
    this.ellipses = this.layer("ellipses", (links, at) => links.map(([, link]) => at.ellipse(link)));
    this.screen.append(this.svg);
    new ResizeObserver(() => this.look()).observe(this.screen);
  }

  // A dark and a coloured path for each limb; returns a function that draws a frame's places.
  layer(name, outline) {
    const group = shape("g", { class: name });
    const tells = this.numbers.limbs.map(({ color, links }) => {
      const paths = [shape("path", { class: "rim", stroke: this.numbers.ink }), shape("path", { stroke: color })];
      group.append(...paths);
      return (at) => {
        const d = outline(links, at).join("");
        for (const path of paths) path.setAttribute("d", d);
      };
    });
    this.svg.append(group);
    return (at) => tells.forEach((tell) => tell(at));
  }

  // The figure of a frame; none if the film shows a frame that was not followed.
  draw(frame) {
    if (frame === this.frame) return;
    this.frame = frame;
    const outcome = this.outcomes[frame];
    this.svg.dataset.frame = frame;
    this.svg.classList.toggle("unseen", UNSEEN.includes(outcome));
    this.svg.classList.toggle("lost", outcome === "lost");
    const said = [this.title, this.motions[frame], outcome === "ok" ? "" : this.words[outcome]];
    this.caption.textContent = said.filter(Boolean).join(" \u00b7 ");
    this.svg.style.visibility = outcome ? "visible" : "hidden";
    if (!outcome) return;
    const [points, ellipses] = [this.numbers.points, this.numbers.ellipses].map((rows) => pixels(rows[frame]));
    const at = {
      point: (k) => `${points[2 * k]} ${points[2 * k + 1]}`,
      ellipse: (link) => {
        const [x, y] = [points[2 + 2 * link], points[3 + 2 * link]];
        const [long, short, degrees] = ellipses.slice(3 * link, 3 * link + 3);
        const [dx, dy] = [Math.cos, Math.sin].map((turn) => long * turn((degrees * Math.PI) / 180));
        const half = (sign) => `A${long} ${short} ${degrees} 1 1 ${x + sign * dx} ${y + sign * dy}`;
        return `M${x - dx} ${y - dy}${half(1)}${half(-1)}Z`;
      },
    };
    this.limbs(at);
    this.ellipses(at);
    this.look();
  }

  zoom(near) {
    this.near = near;
    this.look();
  }

  // Move and enlarge film and figure together. The film's (0, 0) is the middle of its first pixel.
  look() {
    const [W, H] = this.size;
    const [across, up] = this.numbers.reach;
    const times = this.near ? Math.max(1, Math.min(W / across, H / up) / (2 * NEARER)) : 1;
    const { centre } = this.numbers;
    const [x, y] = this.near ? pixels(centre[Math.max(this.frame, 0)] ?? centre.at(-1)) : [(W - 1) / 2, (H - 1) / 2];
    const [w, h] = [W / times, H / times];
    this.svg.setAttribute("viewBox", `${x - w / 2} ${y - h / 2} ${w} ${h}`);
    const move = [(w / 2 - x - 0.5) / W, (h / 2 - y - 0.5) / H].map((share) => `${100 * share}%`);
    this.video.style.transform = this.near ? `scale(${times}) translate(${move})` : "";
    const limb = (this.numbers.width * this.screen.clientWidth) / w;
    this.svg.style.setProperty("--limb", `${Math.max(limb, THIN)}px`);
  }
}
