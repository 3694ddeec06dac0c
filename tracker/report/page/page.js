// Slider, keys, plots and clips, all showing the same frame.

const find = (selector) => document.querySelector(selector);
const all = (selector) => [...document.querySelectorAll(selector)];
const [slider, play, where] = [find("#frame"), find("#play"), find("#where")];
const { first, start, times } = opening.chapters[0];
const axis = new Axis(times);

const within = (i, selector) => find(`article[data-chapter="${i}"] ${selector}`);
const tellers = opening.chapters.map((chapter, i) => drawChapter(axis, chapter, within(i, ".plots")));
if (opening.errors) {
  find("#errors").hidden = false;
  drawErrors(axis, opening.errors, find("#errors .plots"));
}
let span = 0;

const drawings = opening.chapters.map((chapter, i) =>
  new Drawing(find(`figure[data-chapter="${i}"]`), chapter, opening.film.size, opening.chapters.length > 1 ? chapter.name : ""));
const source = filmSource(opening.film.link);
for (const { video } of drawings) video.src = source;

const seen = (i, frame) => drawings[i].draw(frame);
const player = new Player(drawings.map(({ video }) => video), times, opening.film.start, { told, seen });

function told(frame) {
  slider.value = frame;
  slider.setAttribute("aria-valuetext", `frame ${first + frame}, ${times[frame].toFixed(2)} seconds`);
  where.replaceChildren(
    `frame ${first + frame}`, element("span", { class: "total" }, ` of ${first + times.length - 1}`), ` \u00b7 ${times[frame].toFixed(2)} s`);
  // The next part is shown when the cursor leaves the present one: redrawing for every frame would stutter.
  if (span && (times[frame] < axis.shown[0] || times[frame] > axis.shown[1])) axis.span(span, frame);
  axis.point(frame);
  for (const tell of tellers) tell(frame);
  play.setAttribute("aria-label", player.playing ? "Pause" : "Play");
}

function go(frame) {
  player.pause();
  player.show(frame);
}

const step = (by) => go(player.frame + by);

function toggle() {
  if (player.playing) player.pause();
  else player.play();
}

function choose(chapter) {
  for (const one of all("[data-tab]")) one.setAttribute("aria-pressed", String(one.dataset.tab === chapter));
  for (const one of all("article")) one.hidden = one.dataset.chapter !== chapter;
  for (const one of all(".clips figure")) one.classList.toggle("chosen", one.dataset.chapter === chapter);
  axis.span(span, player.frame);
}

slider.max = times.length - 1;
slider.addEventListener("input", () => go(Number(slider.value)));
play.addEventListener("click", toggle);
find("#back").addEventListener("click", () => step(-1));
find("#ahead").addEventListener("click", () => step(1));
find("#full").hidden = !document.fullscreenEnabled;
find("#full").addEventListener("click", () => {
  if (document.fullscreenElement) document.exitFullscreen();
  else find(".player").requestFullscreen();
});
find("#pace").addEventListener("change", (event) => player.pace(Number(event.target.value)));
for (const button of all("[data-layer]")) {
  button.addEventListener("click", () => {
    const on = button.getAttribute("aria-pressed") === "false";
    button.setAttribute("aria-pressed", String(on));
    if (button.dataset.layer === "zoom") drawings.forEach((drawing) => drawing.zoom(on));
    else find(".player").classList.toggle(`no-${button.dataset.layer}`, !on);
  });
}
for (const tab of all("[data-tab]")) tab.addEventListener("click", () => choose(tab.dataset.tab));

const KEYS = { ArrowLeft: -1, ArrowRight: 1, Home: -Infinity, End: Infinity };
document.addEventListener("keydown", (event) => {
  const { key, target } = event;
  if (event.ctrlKey || event.altKey || event.metaKey || target.matches("select")) return;
  if (key in KEYS) {
    event.preventDefault();
    step(KEYS[key] * (event.shiftKey ? 10 : 1));
  } else if (key === " " && !target.matches("button")) {
    event.preventDefault();
    toggle();
  }
});

// A clicked button would receive the space bar.
document.addEventListener("click", (event) => {
  if (event.detail) event.target.closest("button")?.blur();
});

for (const chart of all(".plots .chart")) {
  const follow = (event) => {
    const box = chart.getBoundingClientRect();
    go(axis.frameAt((event.clientX - box.left) / box.width));
  };
  chart.addEventListener("pointerdown", follow);
  chart.addEventListener("pointermove", (event) => {
    if (event.buttons === 1) follow(event);
  });
}

// Long clips are shown a few seconds at a time.
const [LONG, LONGER] = [12, 40];
const seconds = axis.whole[1] - axis.whole[0];
if (seconds > LONG) {
  span = seconds > LONGER ? 10 : 0;
  for (const root of all("article .plots")) {
    const spans = [[0, "the whole clip"], [10, "10 s"], [3, "3 s"]];
    const options = spans.map(([value, text]) => element("option", { value }, text));
    const choice = element("select", { "aria-label": "Seconds shown" }, ...options);
    choice.addEventListener("change", () => {
      span = Number(choice.value);
      for (const other of all(".spans select")) other.value = choice.value;
      axis.span(span, player.frame);
    });
    choice.value = span;
    root.prepend(element("div", { class: "spans" }, "Show", choice));
  }
}

opening.chapters.forEach((chapter, i) => {
  const [plots, cycles, table] = [".plots", ".cycles", ".gait table"].map((selector) => within(i, selector));
  plots.after(savers(`angles-${chapter.name}`, () => angleRows(chapter), plots));
  drawCycles(chapter.cycles, cycles, `strides-${chapter.name}`);
  if (table) table.parentElement.after(savers(`gait-${chapter.name}`, () => tableRows(table)));
});

const [width, height] = opening.film.size;
find(".clips").style.cssText = `--clips: ${opening.chapters.length}; --aspect: ${width / height}`;
new ResizeObserver(() => axis.rulers.forEach((ruler) => axis.rule(ruler))).observe(document.body);
choose("0");
player.show(start);
