/* The figure of a frame: as it is marked there, or what its marking begins with. */
const followed = new Map(); // the tracked joints of frames that were marked since

/** What a frame that is not marked begins with: the figure as followed, or as marked in the nearest frame. */
function begun() {
  if (opening.run) return exchangedBefore(shown.index) ? twins(shown.figure) : shown.figure;
  return marks.of(nearestMarked()[0]);
}

function begins() {
  return !isMarked() && Object.keys(begun()).length > 0;
}

function isMarked() {
  return Object.keys(marks.of(shown.index)).length > 0;
}

function here() {
  return isMarked() ? marks.of(shown.index) : begun();
}

/** Mark the frame that is shown. */
function put(figure, burst = null) {
  if (opening.run && !followed.has(shown.index)) followed.set(shown.index, shown.figure);
  marks.replace(shown.index, figure, burst);
}

/** The marked frames, the nearest to the one that is shown first. */
function nearestMarked() {
  const away = (frame) => Math.abs(frame - shown.index);
  return marks.marked().sort((a, b) => away(a) - away(b));
}

/** Whether the legs were exchanged in the marked frame that the figure comes from in this one. */
function exchangedBefore(frame) {
  const all = marks.marked();
  const last = all.filter((one) => one <= frame).pop() ?? all[0];
  return last !== undefined && isExchanged(last);
}

function isExchanged(frame) {
  const [now, before] = [marks.of(frame), followed.get(frame) ?? opening.run?.figures[frame] ?? {}];
  const legs = names.filter((name) => twin(name) !== name && now[name] && before[name] && before[twin(name)]);
  const away = (name, other) => Math.hypot(now[name].x - before[other].x, now[name].y - before[other].y);
  const sum = (as) => legs.reduce((total, name) => total + away(name, as(name)), 0);
  return sum(twin) < sum((name) => name);
}

/** The joint of the other side, or the joint itself where it is of none. */
function twin(name) {
  return joints.find((joint) => joint.name === name)?.twin ?? name;
}

function twins(figure) {
  return Object.fromEntries(Object.entries(figure).map(([name, mark]) => [twin(name), mark]));
}

/** The stretch of frames around this one in which the figure was lost or outside, so that what is shown is a forecast. */
function lostHere() {
  return (opening.run?.lost ?? []).find(([first, end]) => first <= shown.index && shown.index < end);
}

/** Whether a joint takes the figure along: the base does so in one of another frame, or in a forecast. */
function carries(joint) {
  return begins() && joint === base && (!opening.run || Boolean(lostHere()));
}

/** The figure with one joint moved, or with it the whole figure. */
function moved(joint, at, whole = carries(joint)) {
  const from = here()[joint];
  if (!begins() && !whole) return { ...here(), [joint]: { ...from, ...at } };
  const figure = begins() ? each(here(), (mark) => ({ ...mark, visible: mark.visible || Boolean(lostHere()) })) : here();
  if (!whole) return { ...figure, [joint]: { ...from, ...at, visible: true } };
  const [dx, dy] = [at.x - from.x, at.y - from.y];
  return each(figure, (mark) => ({ ...mark, ...rounded({ x: mark.x + dx, y: mark.y + dy }) }));
}

function each(figure, change) {
  return Object.fromEntries(Object.entries(figure).map(([name, mark]) => [name, change(mark)]));
}

function rounded({ x, y }) {
  return { x: Math.round(100 * x) / 100, y: Math.round(100 * y) / 100 };
}
