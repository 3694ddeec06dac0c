/* The page: what is being marked, and what clicks, keys and buttons do to it. */
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

const $ = (id) => document.getElementById(id);
const joints = opening.joints;
const base = opening.base; // the joint that moves the whole figure
const names = joints.map((joint) => joint.name);
const marks = new Marks(opening.marks);
const skipped = new Map();

let shown = opening.frame;
let chosen = null;
let aim = null;
let hides = false;
let facing = opening.facing;
let revision = opening.revision; // of the marks that this page knows
let sending = Promise.resolve(); // the last save
let savedFacing = opening.run ? opening.run.facing : facing;
let pending = Boolean(opening.run?.pending); // whether corrections are saved that are not followed yet
let advice = { missing: [], faults: [], faces: null };
let asked = 0;
let timer = null;
let over = false;
let whole = false; // whether the arrow keys move the whole figure

const picture = new Picture($("picture"), { tap, drag, grabbed: hold, moved: () => draw() });

/* Choosing and placing. */

function left() {
  return skipped.get(shown.index) ?? new Set();
}

/** The next joint to ask for: after this one, else from the start; null when all are placed or skipped. */
function following(name) {
  const at = names.indexOf(name) + 1;
  const open = (other) => !here()[other] && !left().has(other);
  return [...names.slice(at), ...names.slice(0, at)].find(open) ?? null;
}

/** Another frame is shown. */
function arrived() {
  chosen = begins() || opening.run ? null : following(null); // a run was followed without the joints left out
  hides = false;
  aim = null;
  advice = { missing: [], faults: [], faces: null };
  showAdvice();
  changed();
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
  put({ ...here(), [chosen]: { ...rounded(at), visible } });
  left().delete(chosen);
  if (anew) chosen = following(chosen);
  hides = false;
  changed();
}

function tap(at, joint) {
  hold();
  aim = null;
  if (chosen && !here()[chosen]) place(at);
  else if (joint) choose(joint);
  else if (chosen) place(at);
}

/** A joint on its way: only where it is let go does it become a step that can be undone. */
function drag(joint, at, done) {
  hold();
  if (at && done) {
    put(moved(joint, rounded(at)));
    chosen = joint;
    changed();
  } else if (at) {
    chosen = joint;
    picture.draw(joints, moved(joint, at), chosen, null);
  } else draw();
}

function nudge([dx, dy], step) {
  hold();
  const mark = here()[chosen];
  if (mark) {
    const at = rounded({ x: mark.x + step * dx, y: mark.y + step * dy });
    const burst = `nudge ${chosen}`;
    if (!marks.goesOn(shown.index, burst)) whole = carries(chosen);
    put(moved(chosen, at, whole), burst);
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
  hold();
  if (chosen && !here()[chosen]) place(aim ?? picture.middle);
  else if (begins()) {
    put(here());
    changed();
  } else choose(following(chosen));
}

function toggleHidden() {
  hold();
  const mark = here()[chosen];
  if (mark) {
    put({ ...here(), [chosen]: { ...mark, visible: !mark.visible } });
    changed();
  } else if (chosen) {
    hides = !hides;
    refresh();
  }
}

function remove() {
  hold();
  const { [chosen]: gone, ...rest } = here();
  if (!gone) return;
  put(rest);
  changed();
}

function skip() {
  hold();
  if (!chosen) return;
  skipped.set(shown.index, left().add(chosen));
  const { [chosen]: gone, ...rest } = here();
  if (gone) put(rest);
  chosen = following(chosen);
  hides = false;
  changed();
}

function exchangeLegs() {
  hold();
  if (!hasLegs()) return;
  put(twins(here()));
  skipped.set(shown.index, new Set([...left()].map(twin)));
  changed();
}

/** In the frames that the track passes through, and so in all. */
function exchangeEverywhere() {
  hold();
  marks.replaceAll(twins);
  changed();
}

function hasLegs() {
  return Object.keys(here()).some((name) => twin(name) !== name);
}

function unmark() {
  hold();
  put({});
  arrived();
}

function face(way) {
  facing = way;
  changed();
}

function undo(way) {
  hold();
  const [first] = marks.before(shown.index, way);
  if (first !== undefined) return say(`Frame ${first} was changed after the legs of all frames; ${way} that first.`, "wrong");
  const name = marks.go(shown.index, way);
  if (!name) return;
  left().delete(name);
  if (begins()) chosen = null;
  else chosen = here()[name] && way === "redo" ? following(name) : name;
  changed();
}

/* Buttons and keys. */

const KEYS = {
  Enter: enter,
  Delete: remove,
  Backspace: remove,
  h: toggleHidden,
  s: skip,
  x: exchangeLegs,
  p: play,
  " ": play,
  n: () => choose(names[(names.indexOf(chosen) + 1) % names.length]),
  b: () => choose(names.at(Math.max(names.indexOf(chosen), 0) - 1)),
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
  if (over || event.altKey || document.querySelector("dialog[open]")) return;
  const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  const held = event.ctrlKey || event.metaKey;
  const sliding = event.target.matches("[type=range]");
  const typing = event.target.matches("input") && !sliding;
  const pressing = event.target.matches("button, summary") && (key === "Enter" || key === " ");
  const arrow = ARROWS[key];
  let does = null;
  if (held && WITH_CTRL[key]) does = () => WITH_CTRL[key](event);
  else if (typing || pressing || (sliding && arrow)) return;
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
  all: exchangeEverywhere,
  clear: unmark,
  left: () => face("left"),
  right: () => face("right"),
  play,
  slow,
  closer: () => picture.zoom(1.5),
  farther: () => picture.zoom(1 / 1.5),
  fit: () => picture.fit(),
  back10: () => go(heading - 10),
  back1: () => go(heading - 1),
  ahead1: () => go(heading + 1),
  ahead10: () => go(heading + 10),
  save: () => save(false),
  close: () => save(true),
  follow: () => follow(),
  stay: () => $("doubt").close(),
};

for (const [id, does] of Object.entries(BUTTONS)) $(id).addEventListener("click", does);
$("frame").addEventListener("change", () => go($("frame").valueAsNumber));
$("slider").addEventListener("input", () => { pause(); go($("slider").valueAsNumber, true); });
$("slider").addEventListener("change", () => go($("slider").valueAsNumber));
$("following").addEventListener("cancel", (event) => event.preventDefault());
document.addEventListener("keydown", keyed);
addEventListener("beforeunload", (event) => {
  if (!over && unsaved()) event.preventDefault();
});

$("video").textContent = opening.video;
$("joints").append(...joints.map(row));
$("which").open = innerWidth > 760;
$("which").hidden = $("legs").hidden = names.every((name) => twin(name) === name);
$("follow").hidden = $("all").hidden = !opening.run;
$("unsure").hidden = !opening.run?.unsure;
if (opening.run) {
  $("legs").textContent = "Exchange the legs from here on";
  $("close").classList.remove("main");
}
if (opening.taken) marks.replace(opening.taken.frame, opening.taken.marks);
heading = shown.index;
turnTo(shown);
arrived();
if (opening.taken) say(opening.taken.told);
if (opening.run?.told) say(opening.run.told);
if (opening.run?.follows) watch();
