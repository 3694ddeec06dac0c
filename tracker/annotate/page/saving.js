/* What goes to the server and comes back: judgements, frames, the table. */
const GONE = "figtrack annotate does not answer any more: what is not saved yet is on this page only. " +
  "Start it again and mark it there.";
const PAUSE = 120; // ms without a change before marks are judged

async function ask(what, body) {
  const headers = { "Content-Type": "application/json" };
  let answer;
  try {
    answer = await fetch(what, body && { method: "POST", headers, body: JSON.stringify(body) });
  } catch {
    throw new Error(GONE);
  }
  const reply = await answer.json();
  if (!answer.ok) throw new Error(reply.error);
  return reply;
}

async function judge() {
  const mine = ++asked;
  try {
    const reply = await ask("check", { frame: shown.index, marks: here() });
    if (over || mine !== asked) return;
    advice = reply;
    showAdvice();
  } catch (error) {
    if (!over) say(error.message, "wrong");
  }
}

async function go(index) {
  const wanted = Math.max(0, Math.trunc(index));
  if (!Number.isFinite(wanted) || wanted === heading) return;
  heading = wanted;
  say(`Reading frame ${wanted} …`);
  try {
    const frame = await ask(`frame/${wanted}`);
    if (heading !== wanted) return; // meanwhile another was asked for
    say("");
    turnTo(frame);
  } catch (error) {
    if (heading !== wanted) return;
    heading = $("frame").value = shown.index;
    say(error.message, "wrong");
  }
}

function turnTo(frame) {
  shown = frame;
  picture.show(frame);
  $("frame").value = frame.index;
  $("picture").setAttribute("aria-label", `Frame ${frame.index} of ${opening.video}`);
  $("count").textContent = frame.count ? `/ ${frame.count - 1}` : "";
  $("back1").disabled = $("back10").disabled = frame.index === 0;
  chosen = following(null);
  aim = null;
  advice = { missing: [], faults: [], notes: [] };
  showAdvice();
  changed();
}

async function save(close, anyway = false) {
  const frames = marks.changed();
  clearTimeout(timer); // the server may be gone before it is asked
  say("Saving …");
  try {
    const reply = await ask("save", { frames, close, anyway });
    marks.keep(frames);
    if (reply.closed) {
      finish(reply);
      return;
    }
    changed();
    if (close) doubt(reply.wrong);
    else say(`Saved: ${reply.frames === 1 ? "1 frame" : `${reply.frames} frames`} in ${reply.saved}`);
  } catch (error) {
    say(error.message, "wrong");
  }
}

function doubt(wrong) {
  say("Saved.");
  $("doubts").replaceChildren(...wrong.map((line) => text("li", label(line))));
  $("doubt").showModal();
}

function finish(reply) {
  over = true;
  const panel = document.createElement("div");
  panel.className = "over";
  panel.setAttribute("role", "main");
  panel.append(text("h2", "Saved, and figtrack annotate has ended"), text("p", reply.saved));
  panel.append(text("p", "Next, in the terminal:"), text("code", reply.next));
  panel.append(text("p", "This page can be closed."));
  document.body.replaceChildren(panel);
  scrollTo(0, 0);
}
