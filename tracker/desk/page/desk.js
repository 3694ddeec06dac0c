// A card for each film of the folder, updated from the server about once a second.

const GONE = "figtrack app has ended; start it again in the terminal";
const EVERY = 700; // milliseconds between requests for the state
const PAGES = ["annotate", "correct"]; // commands that open a page of their own
const OF_A_PAGE = /http:\/\/|^this ends with/; // lines for a terminal, wrong once the page is closed
const NONE = element("p", { class: "note" }, "There are no films in this folder. Put one there; it appears here.");
const cards = new Map();
const $ = (selector, root = document) => root.querySelector(selector);

// Leave an unchanged list as it is: a choice in it stays, unless a new entry comes first.
function choices(select, options) {
  const key = JSON.stringify(options);
  if (select.dataset.options === key) return;
  const [chosen, first] = [select.value, select.options[0]?.value];
  select.dataset.options = key;
  select.replaceChildren(...options.map(([value, text]) => element("option", { value }, text)));
  if (options[0][0] === first && options.some(([value]) => value === chosen)) select.value = chosen;
}

// Replace the content of an element only where it differs: a selection stays, and nothing is read out again.
function renew(box, lines, shown = (line) => line) {
  const key = JSON.stringify(lines);
  if (box.dataset.lines === key) return;
  box.dataset.lines = key;
  box.replaceChildren(...lines.map(shown));
}

const whom = (one) => `${one.person}: ${one.motion}, faces ${one.facing}, frames ${one.first} to ${one.last}`;

function starts(film) {
  const people = (film.people ?? []).map((one) => [one.person, whom(one)]);
  const found = film.people?.length === 0 ? "nobody was found" : "whoever walks";
  return [...(film.marked ? [["marks", "as marked"]] : []), ["", found], ...people];
}

function request(card, name, command) {
  const start = $(".person", card).value;
  const height = $(".height", card).valueAsNumber;
  return {
    film: name,
    command,
    marked: start === "marks",
    person: start === "marks" || !start ? null : Number(start),
    near: $(".near", card).value || null,
    facing: $(".facing", card).value || null,
    height: Number.isFinite(height) ? height : null,
    to: $(".to", card).value || null,
  };
}

// The present activity of a command, in words.
function doing({ command, task, said }) {
  const address = PAGES.includes(command) && said.join(" ").match(/http:\/\/\S+/)?.[0];
  if (address) return ["Its page is open: ", element("a", { href: address, target: "_blank", rel: "noopener" }, "show it")];
  if (!task) return [PAGES.includes(command) ? "Opening a page" : "Starting"];
  const left = task.seconds_left > 1 ? `, ${Math.round(task.seconds_left)} s left` : "";
  return [`${task.task}${left}`];
}

function showWork(card, work) {
  const box = $(".work", card);
  box.hidden = !work;
  if (!work) return;
  const running = work.status === null;
  $(".row", box).hidden = !running;
  const words = doing(work);
  const key = words.map((word) => word.textContent ?? word).join("");
  if ($(".task", box).textContent !== key) $(".task", box).replaceChildren(...words);
  const bar = $("progress", box);
  if (work.task?.total) [bar.max, bar.value] = [work.task.total, work.task.done];
  else bar.removeAttribute("value");
  const told = work.said.filter((line) => (running ? line.startsWith("warning") : !OF_A_PAGE.test(line)));
  const kind = (line) => (/^(error|warning)/.test(line) ? { class: "fault" } : {});
  renew($(".said", box), told, (line) => element("p", kind(line), line));
}

// Fill the fields with what the run was followed with, once for every run.
function fill(card, { facing, height }) {
  const key = JSON.stringify([facing, height]);
  if (card.dataset.filled === key) return;
  card.dataset.filled = key;
  [$(".facing", card).value, $(".height", card).value] = [facing, height ?? ""];
}

function show(card, film) {
  const busy = film.work !== null && film.work.status === null;
  renew($(".headline", card), film.run ? [film.run.headline || "Followed; too short for gait figures."] : []);
  renew($(".warnings", card), film.run?.warnings ?? [], (text) => element("li", {}, text));
  choices($(".person", card), starts(film));
  $(".near", card).disabled = $(".person", card).value === "marks";
  for (const button of card.querySelectorAll("[data-command]")) {
    const needs = ["correct", "export"].includes(button.dataset.command);
    button.disabled = busy || (needs && !film.run);
  }
  card.dataset.corrected = film.run?.corrected ?? 0;
  if (film.run) fill(card, film.run);
  $("[data-command=track]", card).textContent = film.run ? "Follow again" : "Follow";
  $(".report", card).hidden = !film.run?.report;
  const found = $(".found", card);
  const people = JSON.stringify(film.people);
  if (found.dataset.people !== people) {
    found.dataset.people = people;
    found.hidden = !film.people?.length;
    if (!found.hidden) found.src = `people/${encodeURIComponent(film.name)}?${Date.now()}`;
  }
  showWork(card, film.work);
}

function begun(film, formats) {
  const card = $("#film").content.cloneNode(true).firstElementChild;
  const address = encodeURIComponent(film.name);
  $("h2", card).textContent = film.name;
  $(".face", card).src = `picture/${address}`;
  $(".face", card).alt = `A frame of ${film.name}`;
  $(".found", card).alt = `Who was found in ${film.name}`;
  $(".report", card).href = `../${opening.shown}/run/${address}/report.html`;
  choices($(".to", card), formats.map((name) => [name, name]));
  for (const button of card.querySelectorAll("[data-command]")) {
    button.addEventListener("click", () => start(card, film.name, button.dataset.command));
  }
  $(".person", card).addEventListener("change", () => { $(".facing", card).value = ""; }); // another may face otherwise
  $(".stop", card).addEventListener("click", () => act(card, "stop", { film: film.name }));
  return card;
}

const keeps = (frames) =>
  `This run was corrected by hand in ${frames} ${frames === "1" ? "frame" : "frames"}. Follow again without the corrections?`;

function start(card, name, command) {
  const { corrected } = card.dataset;
  const { badInput, rangeOverflow, rangeUnderflow } = $(".height", card).validity;
  if (badInput || rangeOverflow || rangeUnderflow) complain(card, "The height is no number of metres from 0.3 to 3; write it as 1.75.");
  else if (command !== "track" || corrected === "0" || confirm(keeps(corrected))) act(card, "start", request(card, name, command));
}

function complain(card, line) {
  $(".asks", card).textContent = line;
  $(".asks", card).hidden = false;
}

async function act(card, what, body) {
  $(".asks", card).hidden = true;
  try {
    draw(await ask(what, body));
  } catch (error) {
    complain(card, error.message);
  }
}

function draw({ folder, films, formats }) {
  renew($("#folder"), [`Films of ${folder}`]);
  for (const film of films) {
    if (!cards.has(film.name)) cards.set(film.name, begun(film, formats));
    show(cards.get(film.name), film);
  }
  const there = films.length ? films.map((film) => cards.get(film.name)) : [NONE];
  const main = $("#films");
  if (there.length !== main.childElementCount || there.some((card, i) => main.children[i] !== card)) main.replaceChildren(...there);
}

async function look() {
  try {
    draw(await ask("state"));
    $("#wrong").hidden = true;
  } catch (error) {
    renew($("#wrong"), [error.message]);
    $("#wrong").hidden = false;
  }
  setTimeout(look, EVERY);
}

draw(opening);
setTimeout(look, EVERY);
