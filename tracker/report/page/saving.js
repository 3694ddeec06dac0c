// Saving plots and tables as files: pictures as on the page, but for a frame's own numbers, and the numbers behind them.

const STYLED = ["fill", "stroke", "stroke-width", "stroke-dasharray", "stroke-linecap", "stroke-linejoin", "opacity", "vector-effect"];
const SCALE = 2; // pixels of a PNG to one of the page
const TITLE = 60; // characters of the page's title in a file's name, which may have 255 bytes
const EDGE = 16; // margin on the right for the last number of an axis, pixels

function download(name, content, kind) {
  const address = URL.createObjectURL(content instanceof Blob ? content : new Blob([content], { type: kind }));
  const link = element("a", { href: address, download: `${document.title.slice(0, TITLE)} ${name}` });
  link.click();
  setTimeout(() => URL.revokeObjectURL(address), 1000);
}

// A chart with its computed styles, for a picture without a style sheet.
function styledCopy(chart, box) {
  const copy = chart.cloneNode(true);
  const { left, top, width, height } = chart.getBoundingClientRect();
  for (const [key, value] of Object.entries({ x: left - box.left, y: top - box.top, width, height })) copy.setAttribute(key, value);
  const originals = chart.querySelectorAll("*");
  copy.querySelectorAll("*").forEach((one, i) => {
    const style = getComputedStyle(originals[i]);
    one.removeAttribute("style");
    for (const name of STYLED) one.setAttribute(name, style.getPropertyValue(name));
  });
  return copy;
}

function writtenText(node, box) {
  const range = document.createRange();
  range.selectNodeContents(node);
  const { left, top, height } = range.getBoundingClientRect();
  const { color, fontSize, fontWeight } = getComputedStyle(node.parentElement);
  const at = { x: left - box.left, y: top - box.top + 0.78 * height };
  return shape("text", { ...at, fill: color, "font-size": fontSize, "font-weight": fontWeight }, node.textContent);
}

// The colour before an entry of a legend.
function patch(entry, box) {
  const { left, top, height } = entry.getBoundingClientRect();
  const side = 0.55 * height;
  const fill = getComputedStyle(entry, "::before").backgroundColor;
  return shape("rect", { x: left - box.left, y: top - box.top + 0.2 * height, width: side, height: side, fill });
}

// Charts, words and legends below an element, as one SVG.
function standing(root) {
  const box = root.getBoundingClientRect();
  const size = { width: box.width + EDGE, height: box.height };
  const svg = shape("svg", { xmlns: SVG, ...size, viewBox: `0 0 ${size.width} ${size.height}`, "font-family": "system-ui, sans-serif" });
  svg.append(shape("rect", { ...size, fill: getComputedStyle(root.closest(".card")).backgroundColor }));
  for (const chart of root.querySelectorAll(".chart svg")) svg.append(styledCopy(chart, box));
  for (const entry of root.querySelectorAll(".legend > span")) svg.append(patch(entry, box));
  const words = document.createTreeWalker(root, NodeFilter.SHOW_TEXT);
  while (words.nextNode()) {
    const node = words.currentNode;
    if (node.textContent.trim() && !node.parentElement.closest("select, .spans, .now")) svg.append(writtenText(node, box));
  }
  return svg;
}

async function savePicture(svg, name) {
  const [width, height] = ["width", "height"].map((side) => Math.ceil(SCALE * svg.getAttribute(side)));
  const image = new Image(width, height);
  image.src = "data:image/svg+xml;charset=utf-8," + encodeURIComponent(text(svg));
  await image.decode();
  const canvas = element("canvas", { width, height });
  canvas.getContext("2d").drawImage(image, 0, 0, width, height);
  canvas.toBlob((blob) => download(`${name}.png`, blob));
}

const text = (svg) => new XMLSerializer().serializeToString(svg);
const quoted = (cell) => (/[",\n]/.test(cell) ? `"${String(cell).replaceAll('"', '""')}"` : cell);
const saveRows = (rows, name) => download(`${name}.csv`, rows.map((row) => `${row.map(quoted).join(",")}\n`).join(""), "text/csv");

// The angles of a run, a row a frame.
function angleRows({ first, began, times, panels }) {
  const curves = panels.flatMap(({ title, curves }) =>
    curves.map(({ name, mean, sigma }) => [title === "Trunk" ? name : `${title.toLowerCase()}_${name}`, mean, sigma]));
  const head = ["frame", "time_s", ...curves.flatMap(([name]) => [`${name}_deg`, `${name}_sigma_deg`])];
  return [head, ...times.map((time, t) => [first + t, Number((began + time).toFixed(4)), ...curves.flatMap(([, mean, sigma]) => [mean[t], sigma[t]])])];
}

// The angles over the stride: mean and deviation of each curve, and every stride.
function cycleRows(cycles) {
  const columns = cycles.flatMap(({ title, legs, norm }) => {
    const name = title.toLowerCase().replaceAll(/\W+/g, "_");
    const of = Object.entries(legs).flatMap(([leg, { strides, mean, sigma }]) => [
      [`${name}_${leg}_mean`, mean], ...(sigma ? [[`${name}_${leg}_sigma`, sigma]] : []),
      ...strides.map((stride, i) => [`${name}_${leg}_${i + 1}`, stride])]);
    return [...of, ...(norm ? [[`${name}_people_mean`, norm.mean], [`${name}_people_sigma`, norm.sigma]] : [])];
  });
  return [["percent", ...columns.map(([name]) => name)], ...SHARES.map((share) => [share, ...columns.map(([, values]) => values[share])])];
}

// A table's rows: the measure and its unit, then each number and, in a separate column, its error.
function tableRows(table) {
  const [head, ...body] = [...table.rows].map((row) => [...row.cells].map((cell) => cell.textContent.trim()));
  const number = (words) => words.replace("\u2212", "-").replace("\u2013", "");
  const rows = [...table.tBodies[0].rows].map((row, i) => {
    const unit = row.cells[0].querySelector("small")?.textContent ?? "";
    const name = body[i][0].slice(0, body[i][0].length - unit.length).trim();
    return [name, unit.replace("\u00b0", "deg"), ...body[i].slice(1).flatMap((cell) => [...cell.split("\u00b1").map((words) => number(words.trim())), ""].slice(0, 2))];
  });
  return [["figure", "unit", ...head.slice(1).flatMap((name) => [name, `${name} plus-minus`])], ...rows];
}

// Buttons that save the plots in `root`, if there are any, and `rows`, a function called on demand.
function savers(name, rows, root) {
  const saver = (kind, save) => button(save, { title: `Save as ${kind}` }, kind);
  const pictures = root
    ? [saver("PNG", () => savePicture(standing(root), name)), saver("SVG", () => download(`${name}.svg`, text(standing(root)), "image/svg+xml"))]
    : [];
  return element("div", { class: "save", role: "group", "aria-label": `Save ${name}` }, "Save", ...pictures, saver("CSV", () => saveRows(rows(), name)));
}
