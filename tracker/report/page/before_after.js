// The plots of two runs, and their buttons.

const { cycles } = opening;
const [plots, table] = [".cycles", "table"].map((selector) => document.querySelector(selector));
drawCycles(cycles, plots, "strides");
table.parentElement.after(savers("gait", () => tableRows(table)));
