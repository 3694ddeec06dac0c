"""The picture of a classification: a row for each sequence, with its motions as bars."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO, Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from dynamics.gaussian import Array
from dynamics.motion.tasks import Labelling
from tracker.tables.poses import PoseSequence, stretches

Place = Path | IO[bytes]  # destination of a picture
DPI = 110
MOST_ROWS = 40  # largest number of sequences in one picture
matplotlib.rcParams["text.parse_math"] = False  # names may have a $ in them
# Green, purple, yellow, sky blue, red, black; orange and blue are for the legs.
MOTIONS = ("#009e73", "#9b5fb5", "#e6c700", "#56b4e9", "#c1272d", "#404040")


def draw_labels(
    sequences: Sequence[PoseSequence],
    labellings: Sequence[Labelling],
    path: Place,
    title: str,
    *,
    shares: bool,
) -> None:
    """Draw a row for each sequence: the table's labels, below them the motions, then the `shares`."""
    rows = list(zip(sequences, labellings, strict=True))[:MOST_ROWS]
    known = dict.fromkeys(label for _, found in rows for label in found.labels)
    known |= dict.fromkeys(label for sequence, _ in rows for label in sequence.labels if label)
    colour = {label: MOTIONS[i % len(MOTIONS)] for i, label in enumerate(known)}
    told = any(any(sequence.labels) for sequence, _ in rows)
    figure = Figure(figsize=(11.0, 1.4 + 0.42 * len(rows)), dpi=DPI, layout="constrained")
    axes = figure.subplots()
    for i, (sequence, found) in enumerate(rows):
        frames = frame_edges(sequence.first, len(sequence))
        if told:
            bar(axes, frames, sequence.labels, colour, i - 0.42, 0.2)
        bar(axes, frames, found.label, colour, i - 0.18, 0.34)
        if shares:
            _probabilities(axes, frames, found, colour, i + 0.2, 0.22)
    axes.set_yticks(range(len(rows)), [sequence.name for sequence, _ in rows])
    axes.set(ylim=(len(rows) - 0.4, -0.6), xlabel="frame", ylabel="sequence")
    axes.margins(x=0.01)
    axes.spines[["top", "right", "left"]].set_visible(False)
    axes.tick_params(axis="y", length=0)
    parts = [*(["above: the table's labels"] if told else []), "bar: found"]
    parts += ["below: probability"] if shares else []
    left_out = f"; first {MOST_ROWS} of {len(sequences)} sequences" if len(sequences) > MOST_ROWS else ""
    axes.set_title(f"{title}\n({', '.join(parts)}{left_out})", loc="left", fontsize=11)
    figure.legend(handles=patches(colour), loc="outside upper right", ncols=len(colour), frameon=False)
    figure.savefig(path)


def bar(
    axes: Any, edges: Array, names: Sequence[str], colour: Mapping[str, str], top: float, height: float
) -> None:
    """Draw a strip of T pieces between T + 1 edges, each in its name's colour; "" is left empty."""
    spans: dict[str, list[tuple[float, float]]] = {}
    for start, stop in stretches(names):
        if names[start]:
            spans.setdefault(names[start], []).append((edges[start], edges[stop] - edges[start]))
    for name, those in spans.items():  # one call for each name, since a call takes milliseconds
        axes.broken_barh(those, (top, height), color=colour[name], linewidth=0)


def frame_edges(first: int, frames: int) -> Array:
    """(frames + 1,) the edges of the frames on an axis."""
    return np.asarray(first + np.arange(frames + 1) - 0.5, dtype=float)


def patches(colour: Mapping[str, str]) -> list[Rectangle]:
    """The legend's entries, a coloured patch for each label."""
    return [Rectangle((0, 0), 1, 1, color=shade, label=name) for name, shade in colour.items()]


def _probabilities(
    axes: Any, frames: Array, found: Labelling, colour: Mapping[str, str], top: float, height: float
) -> None:
    heap = np.hstack([np.zeros((len(found.prob), 1)), found.prob.cumsum(1)])
    heap = top + height * np.vstack([heap, heap[-1:]])
    for i, label in enumerate(found.labels):
        axes.fill_between(frames, heap[:, i], heap[:, i + 1], step="post", color=colour[label], alpha=0.55,
                          linewidth=0)  # fmt: skip
