/* What goes to the server and comes back: judgements, frames, the table. */
const GONE = `figtrack ${opening.command} does not answer any more: what is not saved yet is on this page only. Start it again and mark it there.`;
const PAUSE = 120; // ms without a change before marks are judged
const LOOK = 300; // ms between requests for the progress of following

async function judge() {
  const mine = ++asked;
  if (begins() || playing) return;
  try {
    const reply = await ask("check", { frames: { [shown.index]: here() }, frame: shown.index, facing });
    if (over || mine !== asked) return;
    advice = reply;
    showAdvice();
    showFacing();
  } catch (error) {
    if (!over) say(error.message, "wrong");
  }
}

/** How many frames, or the facing, are not saved yet. */
function unsaved() {
  return Object.keys(marks.changed()).length + Number(facing !== savedFacing);
}

/** One after another, as each needs the revision that the one before came to. */
function send(what, more) {
  const sent = sending.then(() => sendChanges(what, more));
  sending = sent.catch(() => {});
  return sent;
}

/** Send what changed, and let the page know what is saved. */
async function sendChanges(what, more) {
  const frames = marks.changed();
  clearTimeout(timer); // the server may have ended by then
  say("Saving …");
  const sent = facing; // facing may change before the answer
  const reply = await ask(what, { frames, facing: sent, frame: shown.index, revision, ...more });
  revision = reply.revision;
  pending ||= Object.keys(frames).length > 0;
  marks.keep(frames);
  if (!opening.run) savedFacing = sent; // a run's facing changes only when it is followed again
  return reply;
}

async function save(close, anyway = false) {
  const turned = opening.run && facing !== savedFacing && !anyway ? ["Faces is kept only where the figure is followed on"] : [];
  try {
    const reply = await send("save", { close: close && !turned.length, anyway });
    if (reply.closed) {
      finish(reply);
      return;
    }
    changed();
    if (close) doubt([...reply.wrong, ...turned], () => save(true, true));
    else say(`Saved: ${reply.frames === 1 ? "1 frame" : `${reply.frames} frames`} in ${reply.saved}`);
  } catch (error) {
    say(error.message, "wrong");
  }
}

async function follow(anyway = false) {
  pause();
  try {
    const reply = await send("follow", { anyway });
    if (reply.follows) await watch();
    else doubt(reply.wrong, () => follow(true));
  } catch (error) {
    say(error.message, "wrong");
  }
}

/** Until the figure was followed again; the page then opens anew, with the new run. */
async function watch() {
  $("following").showModal();
  try {
    for (let now = await ask("following"); !now.ended; now = await ask("following")) {
      showProgress(now);
      await new Promise((done) => { setTimeout(done, LOOK); });
    }
    over = true;
    location.reload();
  } catch (error) {
    $("following").close();
    say(error.message, "wrong");
  }
}

function doubt(wrong, goOn) {
  say("Saved.");
  $("doubts").replaceChildren(...wrong.map((line) => element("li", {}, label(line))));
  $("leave").onclick = () => { $("doubt").close(); goOn(); };
  $("doubt").showModal();
}

function finish(reply) {
  over = true;
  const next = reply.next ? [told(`Next, ${opening.where}:`), element("code", {}, reply.next)] : [];
  const title = element("h2", {}, `Saved, and figtrack ${opening.command} has ended`);
  const panel = [title, told(reply.saved), ...next, told("This page can be closed.")];
  document.body.replaceChildren(element("div", { class: "over", role: "main" }, ...panel));
  scrollTo(0, 0);
}
