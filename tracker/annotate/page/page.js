/* The page: what is being marked, and what clicks, keys and buttons do to it. */
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

const $ = (id) => document.getElementById(id);
const opening = JSON.parse($("opening").textContent);
const joints = opening.joints;
const names = joints.map((joint) => joint.name);
const marks = new Marks(opening.marks);
const skipped = new Map();

let shown = opening.frame;
let heading = shown.index; // the frame that was asked for last
let chosen = null;
let aim = null;
let hides = false;
let advice = { missing: [], faults: [], notes: [] };
let asked = 0;
let timer = null;
let over = false;

const picture = new Picture($("picture"), { tap, drag, moved: () => draw() });

/* Choosing and placing. */

function here() {
  return marks.of(shown.index);
}

function left() {
  return skipped.get(shown.index) ?? new Set();
}

/** The next joint to ask for: after this one, else from the start; null when all are placed or skipped. */
function following(name) {
  const at = names.indexOf(name) + 1;
  const open = (other) => !here()[other] && !left().has(other);
  return [...names.slice(at), ...names.slice(0, at)].find(open) ?? null;
}

function choose(name) {
  chosen = name;
  hides = false;
  const mark = here()[name];
  if (mark) picture.reveal(mark);
  refresh();
}

function place(at) {
  const visible = here()[chosen]?.visible ?? !hides;
  const anew = !here()[chosen];
  marks.place(shown.index, chosen, { ...rounded(at), visible });
  left().delete(chosen);
  if (anew) chosen = following(chosen);
  hides = false;
  changed();
}

function tap(at, joint) {
  aim = null;
  if (chosen && !here()[chosen]) place(at);
  else if (joint) choose(joint);
  else if (chosen) place(at);
}

/** A joint on its way: only where it is let go does it become a step that can be undone. */
function drag(joint, at, done) {
  const mark = here()[joint];
  if (at && done) {
    marks.place(shown.index, joint, { ...mark, ...rounded(at) });
    chosen = joint;
    changed();
  } else if (at) {
    chosen = joint;
    picture.draw(joints, { ...here(), [joint]: { ...mark, ...at } }, chosen, null);
  } else draw();
}

function nudge([dx, dy], step) {
  const mark = here()[chosen];
  if (mark) {
    const at = rounded({ x: mark.x + step * dx, y: mark.y + step * dy });
    marks.place(shown.index, chosen, { ...mark, ...at }, `nudge ${chosen}`);
    picture.reveal(at);
    changed();
  } else {
    const from = aim ?? picture.middle;
    aim = { x: Math.round(4 * (from.x + step * dx)) / 4, y: Math.round(4 * (from.y + step * dy)) / 4 };
    picture.reveal(aim);
    draw();
  }
}

function enter() {
  if (chosen && !here()[chosen]) place(aim ?? picture.middle);
  else choose(following(chosen));
}

function toggleHidden() {
  const mark = here()[chosen];
  if (mark) {
    marks.place(shown.index, chosen, { ...mark, visible: !mark.visible });
    changed();
  } else if (chosen) {
    hides = !hides;
    refresh();
  }
}

function remove() {
  if (!here()[chosen]) return;
  marks.remove(shown.index, chosen);
  changed();
}

function skip() {
  if (!chosen) return;
  skipped.set(shown.index, left().add(chosen));
  if (here()[chosen]) marks.remove(shown.index, chosen);
  chosen = following(chosen);
  changed();
}

/** The joint of the other leg, or the joint itself where it is of none. */
function twin(name) {
  return name.startsWith("near_") ? name.replace("near_", "far_") : name.replace("far_", "near_");
}

function exchangeLegs() {
  if (!hasLegs()) return;
  const exchanged = Object.entries(here()).map(([name, mark]) => [twin(name), mark]);
  marks.replace(shown.index, Object.fromEntries(exchanged));
  skipped.set(shown.index, new Set([...left()].map(twin)));
  changed();
}

function hasLegs() {
  return Object.keys(here()).some((name) => twin(name) !== name);
}

function undo(way) {
  const name = way === "redo" ? marks.redo(shown.index) : marks.undo(shown.index);
  if (!name) return;
  left().delete(name);
  chosen = here()[name] && way === "redo" ? following(name) : name;
  changed();
}

function rounded({ x, y }) {
  return { x: Math.round(100 * x) / 100, y: Math.round(100 * y) / 100 };
}

/* Buttons and keys. */

const KEYS = {
  Enter: enter,
  " ": enter,
  Delete: remove,
  Backspace: remove,
  h: toggleHidden,
  s: skip,
  x: exchangeLegs,
  n: () => choose(names[(names.indexOf(chosen) + 1) % names.length]),
  b: () => choose(names[(names.indexOf(chosen) + names.length - 1 + (chosen ? 0 : 1)) % names.length]),
  "+": () => picture.zoom(1.25),
  "=": () => picture.zoom(1.25),
  "-": () => picture.zoom(0.8),
  0: () => picture.fit(),
  ",": () => go(heading - 1),
  ".": () => go(heading + 1),
  "<": () => go(heading - 10),
  ">": () => go(heading + 10),
  ";": () => go(heading - 10),
  ":": () => go(heading + 10),
};
const WITH_CTRL = {
  z: (event) => undo(event.shiftKey ? "redo" : "undo"),
  y: () => undo("redo"),
  s: () => save(false),
};

function keyed(event) {
  if (over || event.altKey || $("doubt").open) return;
  const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  const held = event.ctrlKey || event.metaKey;
  const typing = event.target.matches("input");
  const pressing = event.target.matches("button, summary") && (key === "Enter" || key === " ");
  const arrow = ARROWS[key];
  let does = null;
  if (held && WITH_CTRL[key]) does = () => WITH_CTRL[key](event);
  else if (typing || pressing) return;
  else if (arrow) does = () => nudge(arrow, event.shiftKey ? 0.25 : held ? 10 : 1);
  else if (held) return;
  else if (/^[1-9]$/.test(key) && names[Number(key) - 1]) does = () => choose(names[Number(key) - 1]);
  else if (Object.hasOwn(KEYS, key)) does = KEYS[key];
  if (!does) return;
  event.preventDefault();
  does();
}

const BUTTONS = {
  undo: () => undo("undo"),
  redo: () => undo("redo"),
  hidden: toggleHidden,
  delete: remove,
  skip,
  legs: exchangeLegs,
  closer: () => picture.zoom(1.5),
  farther: () => picture.zoom(1 / 1.5),
  fit: () => picture.fit(),
  back10: () => go(heading - 10),
  back1: () => go(heading - 1),
  ahead1: () => go(heading + 1),
  ahead10: () => go(heading + 10),
  save: () => save(false),
  close: () => save(true),
  stay: () => $("doubt").close(),
  leave: () => { $("doubt").close(); save(true, true); },
};

for (const [id, does] of Object.entries(BUTTONS)) $(id).addEventListener("click", does);
$("frame").addEventListener("change", () => go($("frame").valueAsNumber));
document.addEventListener("keydown", keyed);
addEventListener("beforeunload", (event) => {
  if (!over && Object.keys(marks.changed()).length) event.preventDefault();
});

$("video").textContent = opening.video;
$("joints").append(...joints.map(row));
if (opening.taken) marks.replace(opening.taken.frame, opening.taken.marks);
turnTo(shown);
if (opening.taken) say(opening.taken.told);
