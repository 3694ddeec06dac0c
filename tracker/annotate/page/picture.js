/* The picture under the marks: zoomed, moved, drawn on, clicked. Coordinates are pixels of the frame, the
   centre of its top-left one being 0, 0. */
const CLOSEST = 40;
const REACH = { mouse: 9, pen: 12, touch: 22 };
const DEPTH = { far: 0, trunk: 1, near: 2 }; // nearer limbs are drawn over farther ones
const STILL = { mouse: 3, pen: 5, touch: 8 };

class Picture {
  /**
   * @param svg the element.
   * @param heard what happens on it: tap(place, joint or null), drag(joint, place, done),
   *   grabbed() of a joint, moved() of the view.
   */
  constructor(svg, heard) {
    this.svg = svg;
    this.heard = heard;
    this.size = { width: 1, height: 1 };
    this.view = { x: 0, y: 0, scale: 1 };
    this.fitted = true;
    this.fingers = new Map();
    this.gesture = null;
    this.points = {};
    this.pointer = null;
    svg.addEventListener("pointerdown", (event) => this.press(event));
    svg.addEventListener("pointermove", (event) => this.move(event));
    svg.addEventListener("pointerup", (event) => this.release(event, true));
    svg.addEventListener("pointercancel", (event) => this.release(event, false));
    svg.addEventListener("pointerleave", () => { this.pointer = null; });
    svg.addEventListener("contextmenu", (event) => event.preventDefault());
    svg.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    new ResizeObserver(() => this.resized()).observe(svg);
  }

  show({ image, width, height }) {
    const picture = this.svg.querySelector("image");
    picture.setAttribute("href", image);
    picture.setAttribute("width", width);
    picture.setAttribute("height", height);
    const same = width === this.size.width && height === this.size.height;
    this.size = { width, height };
    if (same) return;
    this.svg.parentElement.style.setProperty("--ratio", height / width);
    this.fit();
  }

  get box() {
    return this.svg.getBoundingClientRect();
  }

  fit() {
    const { width, height } = this.box;
    if (!width || !height) return;
    const scale = Math.min(width / this.size.width, height / this.size.height);
    this.fitted = true;
    const [beside, above] = [this.size.width - width / scale, this.size.height - height / scale];
    this.look(beside / 2 - 0.5, above / 2 - 0.5, scale);
  }

  look(x, y, scale) {
    this.view = { x, y, scale };
    const { width, height } = this.box;
    this.svg.setAttribute("viewBox", `${x} ${y} ${width / scale} ${height / scale}`);
    this.svg.classList.toggle("near", scale >= 2);
    this.heard.moved();
  }

  resized() {
    if (this.fitted) this.fit();
    else this.look(this.view.x, this.view.y, this.view.scale);
  }

  /** The place in the frame under a place in the window. */
  under(event) {
    const { x, y } = new DOMPoint(event.clientX, event.clientY).matrixTransform(this.svg.getScreenCTM().inverse());
    return { x, y };
  }

  /** Zoom by a factor; what is under the pointer, or else in the middle, stays there. */
  zoom(factor, event = null) {
    const { width, height } = this.box;
    const least = 0.5 * Math.min(width / this.size.width, height / this.size.height);
    const scale = Math.min(Math.max(this.view.scale * factor, least), CLOSEST);
    const at = event ?? this.pointer;
    const { x, y } = at ? this.under(at) : this.middle;
    const closer = this.view.scale / scale;
    this.fitted = false;
    this.look(x + closer * (this.view.x - x), y + closer * (this.view.y - y), scale);
  }

  wheel(event) {
    event.preventDefault();
    const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 30 : 1;
    this.zoom(Math.exp(-0.0015 * Math.max(-400, Math.min(400, lines * event.deltaY))), event);
  }

  pan(dx, dy) {
    this.fitted = false;
    this.look(this.view.x - dx / this.view.scale, this.view.y - dy / this.view.scale, this.view.scale);
  }

  /** Move the view until a place is in it, off its rim. */
  reveal({ x, y }) {
    const { width, height } = this.box;
    const rim = Math.min(40, width / 4, height / 4);
    const [px, py] = [(x - this.view.x) * this.view.scale, (y - this.view.y) * this.view.scale];
    const dx = Math.max(rim - px, 0) + Math.min(width - rim - px, 0);
    const dy = Math.max(rim - py, 0) + Math.min(height - rim - py, 0);
    if (dx || dy) this.pan(dx, dy);
  }

  get middle() {
    const { width, height } = this.box;
    return { x: this.view.x + width / 2 / this.view.scale, y: this.view.y + height / 2 / this.view.scale };
  }

  press(event) {
    this.svg.setPointerCapture(event.pointerId);
    this.fingers.set(event.pointerId, event);
    if (this.fingers.size > 1) {
      this.giveUp();
      return;
    }
    const joint = event.button === 0 ? this.nearest(event) : null;
    const [at, hand] = [this.points[joint], this.under(event)];
    if (joint) this.heard.grabbed();
    const offset = joint && { x: at.x - hand.x, y: at.y - hand.y };
    this.gesture = { joint, offset, from: event, taps: event.button === 0, moved: false };
  }

  move(event) {
    const before = this.fingers.get(event.pointerId);
    if (event.pointerType === "mouse") this.pointer = event;
    if (!before) return;
    if (this.fingers.size === 2) this.pinch(before, event);
    this.fingers.set(event.pointerId, event);
    const gesture = this.gesture;
    if (!gesture) return;
    const [dx, dy] = [event.clientX - gesture.from.clientX, event.clientY - gesture.from.clientY];
    gesture.moved ||= Math.hypot(dx, dy) > (STILL[event.pointerType] ?? 3);
    if (!gesture.moved) return;
    if (gesture.joint) this.heard.drag(gesture.joint, this.dragged(event, gesture), false);
    else {
      this.pan(dx, dy);
      gesture.from = event;
    }
  }

  release(event, done) {
    this.fingers.delete(event.pointerId);
    if (!done) this.giveUp();
    const gesture = this.gesture;
    if (!gesture) return;
    this.gesture = null;
    if (gesture.moved && gesture.joint) this.heard.drag(gesture.joint, this.dragged(event, gesture), true);
    else if (!gesture.moved && gesture.taps) this.heard.tap(this.under(event), gesture.joint);
  }

  /** A second finger or a cancelled touch: what was begun is not done. */
  giveUp() {
    const gesture = this.gesture;
    this.gesture = null;
    if (gesture?.moved && gesture.joint) this.heard.drag(gesture.joint, null, true);
  }

  /** Another frame comes: a joint that is held stays where it was. */
  letGo() {
    if (this.gesture?.joint) this.giveUp();
  }

  /** Where a joint goes that was not grabbed at its very centre. */
  dragged(event, gesture) {
    const place = this.under(event);
    return { x: place.x + gesture.offset.x, y: place.y + gesture.offset.y };
  }

  pinch(before, after) {
    const other = [...this.fingers.values()].find((finger) => finger !== before);
    const apart = (finger) => Math.hypot(finger.clientX - other.clientX, finger.clientY - other.clientY);
    this.pan((after.clientX - before.clientX) / 2, (after.clientY - before.clientY) / 2);
    const between = (side) => (after[side] + other[side]) / 2;
    const middle = { clientX: between("clientX"), clientY: between("clientY") };
    this.zoom(apart(after) / Math.max(apart(before), 1), middle);
  }

  /** The joint within reach of a pointer, or null. */
  nearest(event) {
    const place = this.under(event);
    const reach = (REACH[event.pointerType] ?? 9) / this.view.scale;
    const away = (name) => Math.hypot(this.points[name].x - place.x, this.points[name].y - place.y);
    const [first] = Object.keys(this.points).sort((one, other) => away(one) - away(other));
    return first && away(first) <= reach ? first : null;
  }

  /** Draw the figure: its joints' marks, the chosen one, and the keyboard's aim where there is one. */
  draw(joints, marks, chosen, aim) {
    this.points = marks;
    const px = 1 / this.view.scale;
    const seen = joints.filter((joint) => marks[joint.name]);
    const limbs = seen.filter((joint) => marks[joint.before]).sort((a, b) => DEPTH[a.side] - DEPTH[b.side]);
    const lines = limbs.flatMap((joint) => ["halo", "bone"].map((kind) => this.line(joint, marks, kind)));
    const circles = seen.map((joint) => this.circle(joint, marks[joint.name], 5 * px));
    const cross = aim && `M${aim.x - 14 * px} ${aim.y}h${28 * px}M${aim.x} ${aim.y - 14 * px}v${28 * px}`;
    this.svg.querySelector("#limbs").replaceChildren(...lines);
    this.svg.querySelector("#points").replaceChildren(...circles);
    this.svg.querySelector("#aim").setAttribute("d", cross ?? "");
    const ring = marks[chosen] ? this.ring(chosen, marks[chosen], px) : [];
    this.svg.querySelector("#chosen").replaceChildren(...ring);
  }

  line(joint, marks, kind) {
    const [from, to] = [marks[joint.before], marks[joint.name]];
    const unseen = kind === "bone" && !to.visible ? "unseen" : "";
    const ends = { x1: from.x, y1: from.y, x2: to.x, y2: to.y };
    return shape("line", { ...ends, class: `${joint.side}-side ${kind} ${unseen}` });
  }

  circle(joint, mark, r) {
    const kind = `${joint.side}-side ${mark.visible ? "" : "unseen"}`;
    const about = { cx: mark.x, cy: mark.y, r, class: kind, "data-joint": joint.name };
    return shape("circle", about, shape("title", {}, label(joint.name)));
  }

  /** What sets the chosen joint off: a ring and its name. */
  ring(name, { x, y }, px) {
    const words = shape("text", { x: x + 13 * px, y: y - 9 * px, "font-size": 14 * px }, label(name));
    return [shape("circle", { cx: x, cy: y, r: 9 * px }), words];
  }
}

function label(name) {
  return name.replaceAll("_", " ");
}
