"""Pictures of forecasts, filled gaps and synthesis: angles with bands at two sigma, rows of stick figures."""

from collections.abc import Sequence
from typing import Any

import matplotlib
import numpy as np
from matplotlib import patheffects
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from dynamics.gaussian import Array, Flags, Ints
from kinematics.mocap import POSE_COLUMNS
from tracker.motion.label_plot import DPI, Place, bar, frame_edges, patches
from tracker.motion.sticks import LAYERS, SHADES, SIDES, sticks
from tracker.tables.poses import ROOT_COLUMNS, PoseSequence, stretches
from videos.overlay import INK, as_hex

MOST_FRAMES = 300  # largest number of frames in one picture
FIGURES = 14  # figures in a row
SPACING = 1.15  # distance between them, leg lengths
TALL = 2.15  # height of the picture above the ground, leg lengths; more if the walker exceeds it
# Colours of switching states: bright ones first; orange and blue, those of the legs, last.
STATES = [*range(4, 20, 2), *range(5, 20, 2), *range(4)]
CURVES = (*POSE_COLUMNS[ROOT_COLUMNS:], *POSE_COLUMNS[:ROOT_COLUMNS])  # the root, if shown, is last
NEUTRAL = "#555555"
GAP = "#dddddd"


def draw_forecast(
    sequence: PoseSequence, mean: Array, sd: Array, path: Place, title: str, found: str = "forecast"
) -> None:
    """Draw the poses `found`, (T + H, 8) in body units, NaN for none, beside the measured ones."""
    shown = slice(max(0, len(mean) - MOST_FRAMES), len(mean))
    rows = 3 + _rooted(sequence)
    figure = Figure(figsize=(13.0, 2.3 * rows + 0.7), dpi=DPI, layout="constrained")
    grid = figure.subplots(rows, 2, sharex=True)
    past = np.full((len(mean) - len(sequence), len(POSE_COLUMNS)), np.nan)
    _curves(grid, sequence.first, np.vstack([sequence.y, past]), mean, sd, shown)
    dotted: Any = {"color": NEUTRAL, "linewidth": 1, "linestyle": ":"}
    for axes in grid.ravel() if len(past) else ():
        axes.axvline(sequence.first + len(sequence) - 0.5, **dotted)
    end = [(Line2D([], [], **dotted), "end of the table")] if len(past) else []
    _finish(figure, grid, title, f"{found}, two sigma", end)
    figure.savefig(path)


def draw_filled(sequence: PoseSequence, y: Array, sd: Array, fps: float, path: Place, title: str) -> None:
    """Draw measured and filled angles, as in `fill.Filled`, and the figure across the longest gap, if any."""
    start, stop = longest_gap(sequence)
    shown = _window(len(sequence), (start + stop) // 2)
    if start == stop:
        start, stop = shown.start, shown.stop
    rows = 3 + _rooted(sequence)
    figure: Any = Figure(figsize=(13.0, 2.3 * rows + 3.0), dpi=DPI, layout="constrained")
    top, below = figure.subfigures(2, 1, height_ratios=[2.6, 2.3 * rows])
    around = max(6, (stop - start) // 3)
    frames = _spread(max(0, start - around), min(len(sequence), stop + around))
    missing = _incomplete(sequence)
    stick_row(top.subplots(), y, fps, frames, sequence.first, missing)
    grid = below.subplots(rows, 2, sharex=True)
    _curves(grid, sequence.first, sequence.y, *_within_gaps(sequence, y, sd), shown)
    for axes, name in zip(grid.ravel(), CURVES, strict=False):
        _shade(axes, ~sequence.seen[:, POSE_COLUMNS.index(name)], sequence.first, shown)
    gap = Rectangle((0, 0), 1, 1, color=GAP)
    _finish(below, grid, "", "filled, two sigma", [(gap, "not measured")])
    top.suptitle(title, x=0.01, ha="left", fontsize=12)
    figure.savefig(path)


def draw_synthesis(
    states: Ints, labels: Sequence[str], y: Array, fps: float, path: Place, title: str
) -> None:
    """Draw the figure at the start, in the middle and at the end, the legs' angles, and the switching states.

    Given are states (T,) and poses (T, 8) in body units for the frames, and labels (K,) of the states.
    """
    T, step = len(y), max(1, round(fps / 10.0))
    span = min(T, FIGURES * step)
    begins = sorted({0, (T - span) // 2, T - span})
    figure: Any = Figure(figsize=(13.0, 2.0 * len(begins) + 5.4), dpi=DPI, layout="constrained")
    top, below = figure.subfigures(2, 1, height_ratios=[2.0 * len(begins), 5.0])
    for axes, begin in zip(top.subplots(len(begins), 1, squeeze=False).ravel(), begins, strict=True):
        stick_row(axes, y, fps, np.arange(begin, begin + span, step), 0, np.zeros(T, dtype=bool))
    hips, knees, strip = below.subplots(3, 1, sharex=True, height_ratios=[4.0, 4.0, 1.0])
    for axes, part in ((hips, "hip"), (knees, "knee")):
        for side, shade in SIDES.items():
            values = np.degrees(y[:, POSE_COLUMNS.index(f"{part}_{side}")])
            axes.plot(np.arange(T), values, color=shade, linewidth=1.5, label=f"{side} {part}")
        axes.set_ylabel(f"{part}, degrees")
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=2, fontsize=8, frameon=False)
        axes.spines[["top", "right"]].set_visible(False)
    names = [f"{label} {k}" if len(labels) > 1 else label for k, label in enumerate(labels)]
    shades = matplotlib.colormaps["tab20"]
    colour = {names[s]: matplotlib.colors.to_hex(shades(STATES[s % 20])) for s in np.unique(states)}
    bar(strip, frame_edges(0, T), [names[s] for s in states], colour, 0.0, 1.0)
    strip.set(yticks=[], ylabel="state", xlabel="frame", xlim=(-0.5, T - 0.5), ylim=(0, 1))
    below.legend(handles=patches(colour), loc="outside lower center", ncols=8, frameon=False)
    top.suptitle(title, x=0.01, ha="left", fontsize=12)
    figure.savefig(path)


def longest_gap(sequence: PoseSequence) -> tuple[int, int]:
    """Rows (start, stop) of the longest interval with a missing angle; (0, 0) if there is none."""
    return max(_stretches(_incomplete(sequence)), key=lambda run: run[1] - run[0], default=(0, 0))


def _curves(grid: Any, first: int, measured: Array, mean: Array, sd: Array, shown: slice) -> None:
    frames = np.arange(first + shown.start, first + shown.stop)
    for axes, name in zip(grid.ravel(), CURVES, strict=False):
        column = POSE_COLUMNS.index(name)
        rooted = column < ROOT_COLUMNS
        seen, found, spread = (
            values[shown, column] if rooted else np.degrees(values[shown, column])
            for values in (measured, mean, sd)
        )
        shade = SIDES.get(name.partition("_")[2], NEUTRAL)
        axes.fill_between(
            frames, found - 2 * spread, found + 2 * spread, color=shade, alpha=0.25, linewidth=0
        )
        axes.plot(frames, seen, ".-", color="#111111", markersize=3, linewidth=0.4)
        axes.plot(frames, found, color=shade, linewidth=1.6)
        axes.set_ylabel(f"{name}, {'leg lengths' if rooted else 'degrees'}")
        axes.set_xlim(frames[0] - 0.5, frames[-1] + 0.5)
        axes.spines[["top", "right"]].set_visible(False)
    for axes in grid[-1]:
        axes.set_xlabel("frame")


def _within_gaps(sequence: PoseSequence, y: Array, sd: Array) -> tuple[Array, Array]:
    """Filled values joined to the measured frames beside them, and their deviations, which are 0 there."""
    tied = ~sequence.seen
    tied[1:] |= ~sequence.seen[:-1]
    tied[:-1] |= ~sequence.seen[1:]
    return np.where(tied, y, np.nan), np.where(tied, np.nan_to_num(sd), np.nan)


def _finish(figure: Any, grid: Any, title: str, found: str, last: list[tuple[Any, str]]) -> None:
    named: list[tuple[Any, str]] = [(Line2D([], [], marker=".", lw=0.4, color="#111111"), "measured")]
    for side, shade in {**SIDES, "trunk and root": NEUTRAL}.items():
        band = Rectangle((0, 0), 1, 1, color=shade, alpha=0.25, linewidth=0)
        named.append(((band, Line2D([], [], color=shade, linewidth=1.6)), f"{found}: {side}"))
    named += last
    handles, texts = zip(*named, strict=True)
    figure.legend(handles, texts, loc="outside lower center", ncols=len(named), frameon=False)
    figure.align_ylabels(grid)
    if title:
        figure.suptitle(title, x=0.01, ha="left", fontsize=12)


def stick_row(axes: Any, y: Array, fps: float, frames: Ints, first: int, missing: Flags) -> None:
    """Draw figures side by side, each with its frame number, on grey if not all angles were measured."""
    ends = sticks(y, fps)
    highest = max(TALL, float(ends[frames, ..., 1].max()) + 0.1)
    rim = [patheffects.Stroke(linewidth=5.5, foreground=as_hex(INK)), patheffects.Normal()]
    for place, t in enumerate(frames):
        links = ends[t].copy()
        links[..., 0] += SPACING * place - links[0, 0, 0]
        if missing[t]:
            left = SPACING * (place - 0.5)
            axes.add_patch(
                Rectangle((left, -0.05), SPACING, highest + 0.05, color=GAP, linewidth=0, zorder=0)
            )
        for layer, colour in SHADES.items():
            shade = as_hex(colour)
            chain = [i for i, own in enumerate(LAYERS) if own == layer]
            leg = np.concatenate([links[chain[0]], links[chain[1:], 1]])
            for line in links[chain] if layer == 1 else [leg]:
                axes.plot(*line.T, color=shade, linewidth=3.5, path_effects=rim,
                          solid_capstyle="round", zorder=2 + layer)  # fmt: skip
        axes.text(SPACING * place, -0.12, str(first + t), ha="center", va="top", fontsize=8)
    axes.axhline(0.0, color=NEUTRAL, linewidth=1, zorder=1)
    axes.set(xlim=(-0.7 * SPACING, SPACING * (len(frames) - 0.3)), ylim=(-0.35, highest), aspect="equal")
    axes.axis("off")


def _incomplete(sequence: PoseSequence) -> Flags:
    """(T,) whether an angle is missing."""
    return np.asarray(~sequence.seen[:, ROOT_COLUMNS:].all(1), dtype=bool)


def _spread(start: int, stop: int) -> Ints:
    """Up to FIGURES rows, evenly spaced from start to stop - 1."""
    count = max(1, min(FIGURES, stop - start))
    return np.unique(np.linspace(start, stop - 1, count).round().astype(int))


def _window(T: int, centre: int) -> slice:
    start = int(np.clip(centre - MOST_FRAMES // 2, 0, max(0, T - MOST_FRAMES)))
    return slice(start, min(T, start + MOST_FRAMES))


def _rooted(sequence: PoseSequence) -> bool:
    return bool(sequence.seen[:, :ROOT_COLUMNS].any())


def _stretches(flags: Flags) -> list[tuple[int, int]]:
    """First frame and last + 1 of every run of set flags."""
    return [(start, stop) for start, stop in stretches(flags.tolist()) if flags[start]]


def _shade(axes: Any, missing: Flags, first: int, shown: slice) -> None:
    for start, stop in _stretches(missing[shown]):
        at = first + shown.start
        axes.axvspan(at + start - 0.5, at + stop - 0.5, color=GAP, linewidth=0, zorder=0)
