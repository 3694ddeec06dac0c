// The plots of two runs, and their buttons.

const { cycles } = opening;
const [plots, table] = [".cycles", "table"].map((selector) => document.querySelector(selector));
if (cycles.length) {
  drawCycles(cycles, plots);
  plots.after(savers("strides", () => cycleRows(cycles), plots));
}
table.parentElement.after(savers("gait", () => tableRows(table)));
