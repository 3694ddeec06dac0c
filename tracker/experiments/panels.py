"""Pictures for a page that is light or dark: SVG text whose ink is the page's own."""

import io
from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib
import numpy as np

from dynamics.gaussian import Array
from kinematics.mocap import POSE_COLUMNS
from tracker.motion.sticks import layers, sticks
from tracker.tables.poses import stretches
from videos.overlay import FAR, NEAR

matplotlib.use("Agg")
from matplotlib import pyplot

INK = "#010203"  # stands for the page's ink, which SVG calls currentColor
GREY = "#8a8a8a"
# Orange and blue are the legs'; these stand apart from them for every kind of colour vision.
STATES = ("#009e73", "#cc79a7", "#e6c700", "#7a5195", "#56b4e9", "#c1272d")
MOTIONS = {"walk": "#009e73", "run": "#9b5fb5"}
WIDTH = 9.0  # inches
SPACING = 1.1  # leg lengths between stick figures
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


def _hex(color: tuple[int, int, int]) -> str:
    return "#" + "".join(f"{part:02x}" for part in color)


LEGS = {"near": _hex(NEAR), "far": _hex(FAR)}


def grid(heights: Sequence[float], columns: int = 1, *, share_x: bool = True) -> tuple[Any, Any]:
    """A figure and its axes (rows, columns); heights in inches."""
    with matplotlib.rc_context(STYLE):
        return pyplot.subplots(
            len(heights),
            columns,
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


def bar(
    axes: Any, values: Sequence[object], row: float, height: float, colours: Mapping[Any, str], first: int = 0
) -> None:
    """One value a frame as stretches of colour; `row` is the upper edge."""
    for start, stop in stretches(values):
        span = [(first + start - 0.5, stop - start)]
        axes.broken_barh(span, (row, height), color=colours[values[start]], linewidth=0)


def legs(axes: Any, y: Array, joint: str, first: int = 0) -> None:
    """One joint's angle of both legs, degrees."""
    frames = first + np.arange(len(y))
    for side, colour in LEGS.items():
        angle = np.degrees(y[:, POSE_COLUMNS.index(f"{joint}_{side}")])
        axes.plot(frames, angle, color=colour, linewidth=1.6, label=f"{side} leg")
    axes.set_ylabel(f"{'thigh' if joint == 'hip' else joint},\ndegrees")


def figures(axes: Any, y: Array, every: int, fps: float, first: int = 0) -> None:
    """A row of stick figures, evenly spaced; far limbs blue, near ones orange, the trunk in ink."""
    colour, still = {0: LEGS["far"], 1: INK, 2: LEGS["near"]}, y.copy()
    still[:, 0] = 0.0
    ends = sticks(still, fps)
    for n, t in enumerate(range(0, len(y), every)):
        for layer, ((x0, y0), (x1, y1)) in zip(layers(), ends[t], strict=True):
            place = n * SPACING
            axes.plot([x0 + place, x1 + place], [y0, y1], color=colour[layer], linewidth=1.8, zorder=layer,
                      solid_capstyle="round")  # fmt: skip
        axes.text(n * SPACING, -0.12, f"{first + t}", ha="center", va="top", fontsize=8)
    axes.set_aspect("equal")
    axes.axis("off")
