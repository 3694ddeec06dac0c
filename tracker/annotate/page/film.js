/* The film: the frame that is shown, the slider, play. Frames in passing come small; where it stops, whole. */
const SLOW = 0.25; // of the film's speed

let heading = 0; // the last requested frame
let passing = false; // whether it is only shown in passing
let reading = false;
let stale = false; // whether the frame being read is no longer wanted
let playing = null;

/** Show a frame; of those that are asked for while one is read, only the last comes. */
async function go(index, inPassing = false) {
  const wanted = Math.max(0, Math.trunc(index));
  if (!Number.isFinite(wanted)) return;
  if (!inPassing) pause();
  [heading, passing] = [wanted, inPassing];
  if (reading) return;
  reading = true;
  while (heading !== shown.index || (shown.small && !passing)) await read(heading, passing);
  reading = false;
}

async function read(index, small) {
  if (!small) say(`Reading frame ${index} …`);
  try {
    const frame = await ask(`${small ? "quick" : "frame"}/${index}`);
    if (!small) say("");
    if (!stale) turnTo({ ...frame, small });
  } catch (error) {
    pause();
    if (heading === index) heading = $("frame").value = $("slider").value = shown.index;
    shown.small = false; // a frame that cannot be read is not requested again
    say(error.message, "wrong");
  } finally {
    stale = false;
  }
}

function turnTo(frame) {
  const same = frame.index === shown.index;
  if (!same) picture.letGo();
  shown = frame;
  picture.show(frame);
  $("slider").disabled = !frame.count;
  $("slider").max = (frame.count ?? 1) - 1;
  $("frame").value = frame.index;
  $("slider").value = heading; // the user may have dragged it farther than the frame just read
  $("picture").setAttribute("aria-label", `Frame ${frame.index} of ${opening.video}`);
  $("count").textContent = frame.count ? `/ ${frame.count - 1}` : "";
  $("back1").disabled = $("back10").disabled = frame.index === 0;
  if (!same) arrived();
  else if (!frame.small) judge(); // not done in passing
}

function play() {
  if (playing) {
    go(heading);
    return;
  }
  const from = shown.count && shown.index >= shown.count - 1 ? 0 : shown.index;
  playing = { from, began: performance.now() };
  $("play").textContent = "Stop";
  tick();
}

function pause() {
  playing = null;
  $("play").textContent = "Play";
}

/** Stay at the frame that is shown: somebody works on it. */
function hold() {
  if (!playing) return;
  stale = reading;
  go(shown.index);
}

function tick() {
  if (!playing) return;
  const speed = opening.fps * ($("slow").ariaPressed === "true" ? SLOW : 1);
  const at = playing.from + Math.floor((speed * (performance.now() - playing.began)) / 1000);
  if (shown.count && at >= shown.count - 1) {
    go(shown.count - 1);
    return;
  }
  go(at, true);
  requestAnimationFrame(tick);
}

function slow() {
  $("slow").ariaPressed = String($("slow").ariaPressed !== "true");
  if (playing) playing = { from: heading, began: performance.now() };
}

/** On the slider's way: where frames are marked, and where the figure was lost or outside. */
function showStrip() {
  const share = (frame) => `${(100 * frame) / Math.max((shown.count ?? 1) - 1, 1)}%`;
  const lost = (opening.run?.lost ?? []).map(([from, to, how]) => {
    const stretch = element("span", { class: how });
    [stretch.style.left, stretch.style.right] = [share(from), `calc(100% - ${share(to)})`];
    return stretch;
  });
  const ticks = marks.marked().map((frame) => {
    const tick = element("span", { class: "tick" });
    tick.style.left = share(frame);
    return tick;
  });
  $("strip").replaceChildren(...lost, ...ticks);
}
