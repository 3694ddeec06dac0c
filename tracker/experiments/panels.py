"""Pictures for a page that is light or dark: SVG text whose ink is the page's own."""

import io
from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib
import numpy as np

from dynamics.gaussian import Array
from kinematics.mocap import POSE_COLUMNS
from tracker.motion.label_plot import bar, frame_edges
from tracker.motion.sticks import SIDES

matplotlib.use("Agg")
from matplotlib import pyplot

INK = "#010203"  # stands for the page's ink, which SVG calls currentColor
GREY = "#8a8a8a"
# Orange and blue are the legs'; these stand apart from them for every kind of colour vision.
STATES = ("#009e73", "#cc79a7", "#e6c700", "#7a5195", "#56b4e9", "#c1272d")
SHADES = {"walk": "#009e73", "run": "#9b5fb5"}
WIDTH = 9.0  # inches
STYLE: Any = {
    "svg.fonttype": "none",
    "svg.hashsalt": "figtrack",
    "font.family": "sans-serif",
    "font.size": 10.0,
    "text.color": INK,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
}


def grid(heights: Sequence[float], *, share_x: bool = True) -> tuple[Any, Any]:
    """A figure and its axes (rows, 1); heights in inches."""
    with matplotlib.rc_context(STYLE):
        return pyplot.subplots(
            len(heights),
            figsize=(WIDTH, sum(heights)),
            height_ratios=list(heights),
            sharex=share_x,
            squeeze=False,
            layout="constrained",
        )


def to_svg(figure: Any) -> str:
    """The figure as an SVG element, closed afterwards."""
    out = io.StringIO()
    with matplotlib.rc_context(STYLE):
        figure.savefig(out, format="svg", transparent=True, metadata={"Date": None})
    pyplot.close(figure)
    text = out.getvalue()
    return text[text.index("<svg") :].replace(INK, "currentColor")


def legend_below(figure: Any, axes: Any, columns: int) -> None:
    """What one panel shows, told below them all."""
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=columns, frameon=False)


def bars(axes: Any, rows: Mapping[str, Sequence[str]], colours: Mapping[str, str]) -> None:
    """One value a frame as stretches of colour, a row a name from the top down."""
    for row, values in enumerate(rows.values()):
        bar(axes, frame_edges(0, len(values)), values, colours, row - 0.36, 0.72)
    axes.set_yticks(range(len(rows)), list(rows))
    axes.tick_params(axis="y", length=0)
    frames = max(map(len, rows.values()))
    axes.set(ylim=(len(rows) - 0.5, -0.5), xlim=(-0.5, frames - 0.5), xlabel="frame")


def legs(axes: Any, y: Array, joint: str) -> None:
    """One joint's angle of both legs, degrees."""
    for side, colour in SIDES.items():
        angle = np.degrees(y[:, POSE_COLUMNS.index(f"{joint}_{side}")])
        axes.plot(angle, color=colour, linewidth=1.6, label=f"{side} leg")
    axes.set_ylabel(f"{'thigh' if joint == 'hip' else joint},\ndegrees")
