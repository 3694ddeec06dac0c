// Curves, bands and strips over a common axis of seconds, and angles over the stride. An SVG is stretched over its
// chart, so its x is seconds, or per cent of a stride.

const TONES = { near: "--near", far: "--far", torso: "--torso", neck: "--neck", before: "--pink", after: "--accent" };
const MOTIONS = { walk: "--green", run: "--pink", free: "--grey", cv: "--grey" };
const OUTCOMES = { ok: "--quiet", hidden: "--gold", lost: "--wrong", found: "--accent", outside: "--grey" };
const MODELS = ["--ink", "--pink", "--gold", "--green", "--grey"];
const SPARE = ["--green", "--pink", "--gold", "--accent", "--grey"];
const UNSURE = ["lost", "outside"];

const toned = (tone) => `--tone: var(${tone})`;

// Round steps, about `count` of them, that cover low to high.
function steps(low, high, count, sizes) {
  const size = sizes.find((one) => (high - low) / one <= count) ?? sizes.at(-1);
  const first = Math.ceil(low / size - 1e-9);
  const last = Math.floor(high / size + 1e-9);
  return Array.from({ length: Math.max(last - first + 1, 0) }, (_, i) => (first + i) * size);
}

const ANGLES = [5, 10, 20, 30, 45, 60, 90, 180, 360];
const ERRORS = [0.05, 0.1, 0.2, 0.25, 0.5];
const SHARES = Array.from({ length: 101 }, (_, share) => share); // of a stride, per cent
const SECONDS = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1800, 3600];

// The range of seconds that all charts of a page show, and the cursor's place in it.
class Axis {
  constructor(times) {
    Object.assign(this, { times, charts: [], rulers: [], roots: [] });
    const step = times.length > 1 ? times.at(-1) - times.at(-2) : 1;
    this.whole = [times[0], times.at(-1) + (times.length > 1 ? 0 : step)];
    this.edges = [...times, times.at(-1) + step];
    this.shown = this.whole;
  }

  // Seconds at which a frame begins; frames may have fractions.
  at(frame) {
    const below = Math.min(Math.max(Math.floor(frame), 0), this.edges.length - 2);
    return this.edges[below] + (frame - below) * (this.edges[below + 1] - this.edges[below]);
  }

  // The frame nearest to a share of the shown range.
  frameAt(share) {
    const seconds = this.shown[0] + share * (this.shown[1] - this.shown[0]);
    return this.times.reduce(
      (best, time, t) => (Math.abs(time - seconds) < Math.abs(this.times[best] - seconds) ? t : best), 0);
  }

  // Show this many seconds around a frame, or all of them.
  span(seconds, frame) {
    const [first, last] = this.whole;
    const length = Math.min(seconds || Infinity, last - first);
    const start = Math.min(Math.max(this.times[frame] - length / 2, first), last - length);
    this.shown = [start, start + length];
    for (const chart of this.charts) chart.fit(this.shown);
    for (const ruler of this.rulers) this.rule(ruler);
    this.point(frame);
  }

  rule(ruler) {
    const [first, last] = this.shown;
    const marks = steps(first, last, Math.max(ruler.clientWidth / 75, 2), SECONDS);
    const share = (time) => `left: ${(100 * (time - first)) / (last - first)}%`;
    const text = (time) => `${Number(time.toFixed(1))} s`;
    ruler.replaceChildren(...marks.map((time) => element("span", { style: share(time) }, text(time))));
  }

  point(frame) {
    const time = this.times[frame];
    const [first, last] = this.shown;
    for (const root of this.roots) root.style.setProperty("--at", (time - first) / (last - first));
  }
}

// One stretched SVG from `low` (below) to `high` on an axis.
class Chart {
  constructor(axis, low, high) {
    Object.assign(this, { axis, low, high });
    this.svg = shape("svg", { preserveAspectRatio: "none", "aria-hidden": "true" });
    this.box = element("div", { class: "chart" }, this.svg, element("div", { class: "cursor" }));
    axis.charts.push(this);
    this.fit(axis.shown);
  }

  fit([first, last]) {
    this.svg.setAttribute("viewBox", `${first} ${-this.high} ${last - first} ${this.high - this.low}`);
  }

  add(name, attributes) {
    this.svg.append(shape(name, attributes));
  }

  line(value, kind) {
    const [x1, x2] = this.axis.whole;
    this.add("line", { class: kind, x1, x2, y1: -value, y2: -value });
  }

  // A value at each of the axis' times.
  curve(values, attributes) {
    this.add("path", { ...attributes, d: path(this.points(values)) });
  }

  // Two standard deviations to either side of a curve.
  band({ mean, sigma }, attributes) {
    const edge = (by) => this.points(mean.map((value, t) => value + by * sigma[t]));
    this.add("path", { ...attributes, d: `${path([...edge(2), ...edge(-2).reverse()])}Z` });
  }

  points(values) {
    return values.map((value, t) => [this.axis.times[t], value]);
  }

  // From the beginning of one frame to that of another.
  stretch(start, end, attributes) {
    const [from, to] = [this.axis.at(start), this.axis.at(end)];
    this.add("rect", { x: from, width: to - from, y: -this.high, height: this.high - this.low, ...attributes });
  }

  ticks(sizes) {
    for (const value of steps(this.low, this.high, 4, sizes)) {
      this.line(value, value ? "grid" : "grid zero");
      const top = (100 * (this.high - value)) / (this.high - this.low);
      const text = Number(value.toFixed(2)).toString().replace("-", "\u2212");
      this.box.append(element("span", { class: "side tick", style: `top: ${top}%` }, text));
    }
  }
}

const path = (points) => `M${points.map(([x, y]) => `${x.toFixed(4)},${(-y).toFixed(4)}`).join("L")}`;

// The range of reliable values with their bands, and a margin.
function reach(curves, sure) {
  let [low, high] = [0, 0];
  for (const { mean, sigma } of curves) {
    mean.forEach((value, t) => {
      if (!sure[t]) return;
      const room = Math.min(2 * sigma[t], 20);
      low = Math.min(low, value - room);
      high = Math.max(high, value + room);
    });
  }
  const room = 0.06 * Math.max(high - low, 10);
  return [low - room, high + room];
}

function anglePanel(axis, panel, chapter, sure) {
  const chart = new Chart(axis, ...reach(panel.curves, sure));
  chart.ticks(ANGLES);
  for (const [start, end, name] of chapter.outcomes) {
    if (UNSURE.includes(name)) chart.stretch(start, end, { class: "unsure" });
  }
  const values = panel.curves.map((curve, at) => {
    const style = toned(TONES[curve.name] ?? SPARE[at % SPARE.length]);
    chart.band(curve, { class: "band", style });
    chart.curve(curve.mean, { class: "curve", style });
    return element("span", { class: "value", style }, `${curve.name} `, element("span", { class: "now" }));
  });
  const head = element(
    "div", { class: "head" },
    element("b", {}, panel.title), element("span", { class: "reading" }, [panel.reading, "degrees"].filter(Boolean).join(", ")), ...values,
  );
  const tell = (frame) => {
    panel.curves.forEach(({ mean, sigma }, i) => {
      const degrees = mean[frame].toFixed(1).replace("-", "\u2212");
      values[i].lastChild.textContent = sure[frame] ? `${degrees}\u00b0 \u00b1 ${(2 * sigma[frame]).toFixed(1)}` : "not seen";
    });
  };
  return { box: element("div", { class: "panel" }, head, chart.box), tell };
}

const withCount = (name, count) => `${name}, ${count} ${count > 1 ? "strides" : "stride"}`;

// A joint's angle over the strides of both legs, or of one leg before and after, and if `counted` their numbers.
function cyclePanel({ title, legs, norm }, counted) {
  const axis = new Axis(SHARES);
  const curves = Object.entries(legs);
  const none = SHARES.map(() => 0);
  const every = curves.flatMap(([, { strides, mean, sigma }]) =>
    [...strides.map((curve) => ({ mean: curve, sigma: none })), { mean, sigma: sigma ?? none }]);
  const chart = new Chart(axis, ...reach(norm ? [norm, ...every] : every, SHARES.map(() => true)));
  chart.ticks(ANGLES);
  if (norm) chart.band(norm, { class: "norm" });
  for (const [side, leg] of curves) if (leg.sigma) chart.band(leg, { class: "band", style: toned(TONES[side]) });
  for (const [side, { strides, mean, off }] of curves) {
    const style = toned(TONES[side]);
    for (const stride of strides) chart.curve(stride, { class: "thin", style });
    if (off !== null) chart.add("line", { class: "off", style, x1: off, x2: off, y1: -chart.low, y2: -chart.high });
    chart.curve(mean, { class: "curve", style });
  }
  const counts = !counted ? [] : curves.map(([side, leg]) =>
    element("span", { class: "value", style: toned(TONES[side]) }, withCount(side, leg.strides.length)));
  const ruler = [0, 50, 100].map((share) => element("span", { style: `left: ${share}%` }, `${share} %`));
  return element(
    "div", { class: "panel" },
    element("div", { class: "head" }, element("b", {}, title), element("span", { class: "reading" }, "degrees"), ...counts), chart.box, element("div", { class: "axis" }, ...ruler),
  );
}

// Intervals, each in the tone of its name.
function strip(axis, name, stretches, tone) {
  const chart = new Chart(axis, 0, 1);
  for (const [start, end, called] of stretches) chart.stretch(start, end, { style: toned(tone(called)) });
  return element("div", { class: "strip" }, element("span", { class: "side" }, name), chart.box);
}

function legend(entries) {
  const spans = entries.map(([text, tone]) => element("span", { style: toned(tone) }, text));
  return element("div", { class: "legend" }, ...spans);
}

function motionStrip(axis, chapter) {
  const labels = [...new Set(chapter.motions.map(([, , label]) => label))];
  const tone = (label) => MOTIONS[label] ?? SPARE[labels.indexOf(label) % SPARE.length];
  return [strip(axis, "motion", chapter.motions, tone), legend(labels.map((label) => [label, tone(label)]))];
}

function outcomeStrip(axis, chapter) {
  const tone = (name) => OUTCOMES[name];
  const met = Object.keys(chapter.words).filter((name) => chapter.outcomes.some((row) => row[2] === name));
  return [strip(axis, "seen", chapter.outcomes, tone), legend(met.map((name) => [chapter.words[name], tone(name)]))];
}

function floorStrips(axis, chapter) {
  return ["near", "far"]
    .filter((side) => chapter.floor[side].length)
    .map((side) => strip(axis, side, chapter.floor[side], () => TONES[side]));
}

// All plots of a chapter; returns a function that shows the numbers of a frame.
function drawChapter(axis, chapter, root) {
  const sure = chapter.times.map(() => true);
  for (const [start, end, name] of chapter.outcomes) if (UNSURE.includes(name)) sure.fill(false, start, end);
  const panels = chapter.panels.map((panel) => anglePanel(axis, panel, chapter, sure));
  const floor = floorStrips(axis, chapter);
  const ruler = element("div", { class: "axis" });
  if (floor.length) floor.unshift(element("div", { class: "legend soft" }, "Foot on the floor, in whole strides"));
  const spacer = () => element("div", { style: "height: 0.6rem" });
  root.append(
    ...panels.map((panel) => panel.box), ruler,
    ...motionStrip(axis, chapter), spacer(), ...outcomeStrip(axis, chapter), spacer(), ...floor,
  );
  axis.rulers.push(ruler);
  axis.roots.push(root);
  return (frame) => {
    for (const panel of panels) panel.tell(frame);
  };
}

// Angles over the stride, and buttons that save them.
function drawCycles(cycles, root, file) {
  if (!cycles.length) return;
  const names = [...new Set(cycles.flatMap(({ legs }) => Object.keys(legs)))];
  const counts = (name) => [...new Set(cycles.map(({ legs }) => legs[name]?.strides.length ?? 0))];
  const differ = names.some((name) => counts(name).length > 1); // then each panel tells its own
  const named = names.map((name) => [differ ? name : withCount(name, counts(name)[0]), TONES[name]]);
  const { norm } = cycles[0];
  if (norm) named.push([`${norm.people} people, from motion capture`, "--quiet"]);
  root.append(...cycles.map((cycle) => cyclePanel(cycle, differ)), legend(named));
  root.after(savers(file, () => cycleRows(cycles), root));
}

// Errors of every model against the marked frames.
function drawErrors(axis, errors, root) {
  const highest = Math.max(...errors.models.flatMap((model) => model.points.map((point) => point[1])), errors.lost);
  const chart = new Chart(axis, 0, 1.08 * highest);
  chart.ticks(ERRORS);
  chart.line(errors.lost, "limit");
  const tone = (i) => MODELS[i % MODELS.length];
  errors.models.forEach((model, i) => {
    const points = model.points.map(([frame, error]) => [axis.at(frame), error]);
    chart.add("path", { class: "curve", style: toned(tone(i)), d: path(points) });
    if (points.length <= 60) {
      chart.add("path", { class: "dots", style: toned(tone(i)), d: points.map((point) => `${path([point])}h0`).join("") });
    }
  });
  const ruler = element("div", { class: "axis" });
  const entries = errors.models.map(({ name, lost }, i) => [lost === null ? name : `${name}, lost at frame ${lost}`, tone(i)]);
  root.append(element("div", { class: "panel" }, chart.box), ruler, legend(entries));
  axis.rulers.push(ruler);
  axis.roots.push(root);
}
