/* The side of the page: what is asked for, the joints, the marked frames and what is said of them. */
const NEAREST = 12; // marked frames that have a button

function draw() {
  $("picture").classList.toggle("begun", begins());
  picture.draw(joints, here(), chosen, aim);
}

function changed() {
  refresh();
  clearTimeout(timer);
  timer = setTimeout(judge, PAUSE);
}

function refresh() {
  draw();
  const joint = joints.find(({ name }) => name === chosen);
  $("guide").replaceChildren(...guidance(joint));
  document.querySelectorAll("#joints button").forEach(showRow);
  $("undo").disabled = !marks.next(shown.index, "undo");
  $("redo").disabled = !marks.next(shown.index, "redo");
  $("hidden").disabled = $("skip").disabled = !chosen;
  $("delete").disabled = !here()[chosen];
  $("legs").disabled = !hasLegs();
  $("follow").disabled = !canFollow();
  $("clear").disabled = !isMarked() || shown.index === opening.run?.start;
  $("hidden").setAttribute("aria-pressed", String(here()[chosen] ? !here()[chosen].visible : hides));
  showMarkedFrames();
  showStrip();
  showFacing();
  const open = Object.keys(marks.changed()).length;
  document.title = `${unsaved() ? "* " : ""}${opening.video}, figtrack ${opening.command}`;
  if (open) say(`${open === 1 ? "One frame is" : `${open} frames are`} not saved yet.`, "open");
  else if ($("saved").className === "open") say("");
}

function guidance(joint) {
  if (!joint && begins()) return beginning();
  if (!joint && opening.run) {
    const start = shown.index === opening.run.start;
    const what = start ? "The run starts from this frame." : "This frame is corrected.";
    const next = start || !canFollow() ? " Play, or slide to where the figure goes wrong." : " When others are right too, choose Follow on.";
    return [strong(what), next];
  }
  if (!joint) {
    const open = joints.filter(({ name }) => !here()[name]).map(({ name }) => label(name));
    const rest = open.length ? ` Left out: ${open.join(", ")}.` : "";
    return [strong("All done in this frame."), `${rest} Drag points that are not right, then save.`];
  }
  const what = `${joint.hint ? ": " + joint.hint : ""}.`;
  const name = strong(label(joint.name));
  if (here()[joint.name]) return [name, `${what} Drag it, or move it with the arrow keys.`];
  const may = joint.needed ? "" : " It may be left out (Skip).";
  return ["Click the ", name, `${what}${may} If it cannot be seen, press Hidden and guess.`];
}

const canFollow = () => pending || unsaved() > 0;
const strong = (words) => element("strong", {}, words);

/** Of a frame that is not marked and need not be marked from nothing. */
function beginning() {
  if (lostHere()) {
    const what = ` What is shown is a forecast. Drag the ${label(base)}, and the whole figure goes along; then every joint to its place.`;
    return [strong(lostHere()[2] === "lost" ? "The figure was lost here." : "The figure is out of the picture here."), what];
  }
  if (opening.run) {
    const what = " Drag a joint that is wrong, or exchange the legs. Where all is right, Enter keeps it so.";
    return [strong("This frame is as it was followed."), what];
  }
  const from = ` The figure is that of frame ${nearestMarked()[0]}. `;
  const what = `Drag its ${label(base)}, and the whole of it goes along; then drag every joint to its place.`;
  return [strong("This frame is not marked yet."), from, what];
}

/** Which way the figure faces: as it was said, or else as the marks look. */
function showFacing() {
  for (const way of ["left", "right"]) $(way).ariaPressed = String((facing ?? advice.faces) === way);
}

function showProgress({ task, done, total }) {
  if (!task) return;
  $("task").textContent = total ? `${task}: ${done} of ${total}` : task;
  if (total) [$("steps").max, $("steps").value] = [total, done];
}

function row(joint) {
  const [dot, state, place] = ["dot", "state", "place"].map((name) => element("span", { class: name }));
  const about = { "data-joint": joint.name, class: `${joint.side}-side` };
  const name = element("span", {}, label(joint.name));
  return element("li", {}, button(() => choose(joint.name), about, dot, name, " ", state, " ", place));
}

/** Rows are kept, not made anew: the keyboard's focus may be on one. */
function showRow(button) {
  const name = button.dataset.joint;
  const mark = here()[name];
  button.setAttribute("aria-current", String(name === chosen));
  button.classList.toggle("placed", Boolean(mark));
  const state = mark ? (mark.visible ? "" : "hidden") : left().has(name) ? "left out" : "";
  button.querySelector(".state").textContent = state;
  button.querySelector(".place").textContent = mark ? Object.values(rounded(mark)).join(", ") : "";
}

/** Buttons of the marked frames that are nearest. */
function showMarkedFrames() {
  const nearest = nearestMarked().slice(0, NEAREST).sort((a, b) => a - b);
  const focused = document.activeElement.closest("#marked") && document.activeElement.textContent;
  const about = (frame) => ({ "aria-label": `Marked frame ${frame}`, "aria-current": frame === shown.index });
  const buttons = nearest.map((frame) => button(() => go(frame), about(frame), frame));
  $("marked").replaceChildren(...(buttons.length ? ["Marked frames", ...buttons] : []));
  buttons.find((one) => one.textContent === focused)?.focus();
}

function showAdvice() {
  const done = isMarked() && chosen === null;
  const lacks = done && advice.missing.length
    ? [`Tracking cannot start from this frame without ${advice.missing.map(label).join(", ")}.`] : [];
  const wrong = [...lacks, ...advice.faults].map((line) => told(label(line), "wrong"));
  const seems = `The figure seems to face ${advice.faces}; if it does not, choose so above the picture.`;
  const notes = advice.faces && !facing ? [told(seems, "note")] : [];
  $("advice").replaceChildren(...wrong, ...notes);
}

/** One line beside the buttons; its kind is "wrong", "open" (something is not saved) or none. */
function say(line, kind = "") {
  $("saved").textContent = line;
  $("saved").className = kind;
}

function told(words, kind = "") {
  return element("p", { class: kind }, words);
}
