"""A pose from joint positions: clicked in a start frame, or projected from motion capture.

The start pose also sets what the figure's TOML leaves open: how long this person's links are, how many
pixels a leg is, and which way the figure faces.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinematics.figure import Array, Figure, Link
from kinematics.spm import View

Marks = Mapping[str, tuple[float, float]]


class PoseError(ValueError):
    """The marked joints do not make a pose."""


@dataclass(frozen=True)
class Start:
    """What a marked frame tells of the figure.

    figure : with this person's rest lengths
    view   : where and how large it stands in the picture
    q      : (D,) the marked pose; scale and stretches zero
    known  : (D,) whether each freedom was marked; the others were assumed
    """

    figure: Figure
    view: View
    q: Array
    known: NDArray[np.bool_]


def start_pose(figure: Figure, marks: Marks, facing: int) -> Start:
    """Figure, view and pose from the joints of one frame.

    Left and right twins (names that differ in near/far only) get the mean of the lengths seen; a link whose tip
    is not marked takes its twin's length, and where neither is marked the rest proportions.

    Args:
        marks: pixel of each marked joint; tips of the outermost links may be missing.
        facing: +1 right, -1 left.

    Raises:
        PoseError: a joint that other joints hang on is missing, or two joints fall together.
    """
    _check_complete(figure, marks)
    pixels = {name: np.asarray(point, dtype=float) for name, point in marks.items()}
    lengths = _link_lengths(figure, pixels)
    leg = _leg_length(figure, lengths)
    view = View(origin=(float(pixels[figure.base][0]), float(pixels[figure.base][1])), unit=leg, facing=facing)
    fitted = figure.with_lengths([length / leg for length in lengths])
    q, known = recover(fitted, {name: view.to_body(point) for name, point in pixels.items()})
    return Start(fitted, view, q, known)


def recover(figure: Figure, points: Mapping[str, Array]) -> tuple[Array, NDArray[np.bool_]]:
    """The pose whose links point the way the joints lie.

    Args:
        points: (2,) body coordinates of each known joint; a link without its tip rests at its parent's angle.

    Returns:
        q (D,) with scale and stretches zero, and (D,) whether each freedom was seen (else assumed).
    """
    q, known = np.zeros(len(figure.freedoms)), np.ones(len(figure.freedoms), dtype=bool)
    q[:2] = points[figure.base]
    angle = np.zeros(len(figure.links))
    for i, (link, parent) in enumerate(zip(figure.links, figure.parents, strict=True)):
        before = angle[parent] if parent >= 0 else 0.0
        angle[i] = before + link.rest
        if link.freedom is None:
            continue
        column = figure.index(link.freedom)
        if link.joint in points:
            along = points[link.joint] - _start_point(figure, i, points)
            turn = np.arctan2(along[1], along[0]) - before - link.rest
            turn = (turn + np.pi) % (2.0 * np.pi) - np.pi
        else:
            turn, known[column] = 0.0, False
        q[column] = link.sense * turn
        angle[i] += turn
    return q, known


def facing_of(marks: Marks, later: Marks | None = None) -> int:
    """Which way the figure faces: +1 right, -1 left.

    From the feet where toes are marked, else from knees that bend forwards, else from the way the hip goes.
    """
    votes = 0.0
    for side in ("near", "far"):
        if f"{side}_toe" in marks and f"{side}_ankle" in marks:
            votes += np.sign(marks[f"{side}_toe"][0] - marks[f"{side}_ankle"][0])
    if votes == 0.0:
        for side in ("near", "far"):
            if f"{side}_ankle" in marks and f"{side}_knee" in marks:
                hip, knee, ankle = (np.asarray(marks[k]) for k in ("hip", f"{side}_knee", f"{side}_ankle"))
                share = np.clip((knee - hip)[1] / max((ankle - hip)[1], 1e-9), 0.0, 1.0)
                votes += (knee - hip)[0] - share * (ankle - hip)[0]
    if votes == 0.0 and later is not None and "hip" in later:
        votes = later["hip"][0] - marks["hip"][0]
    return -1 if votes < 0 else 1


def _check_complete(figure: Figure, marks: Marks) -> None:
    parents = {link.parent for link in figure.links}
    needed = [figure.base] + [k.joint for k in figure.links if k.name in parents or not figure.is_leg(k)]
    for name in needed:
        if name not in marks:
            raise PoseError(f"the start pose lacks {name}; mark {', '.join(needed)} at least")
        if not np.isfinite(marks[name]).all():
            raise PoseError(f"the start pose has no position for {name}; mark it again")


def _start_point(figure: Figure, i: int, points: Mapping[str, Array]) -> Array:
    parent = figure.parents[i]
    if parent < 0:
        return points[figure.base]
    tip, at = points[figure.links[parent].joint], figure.links[i].at
    return tip if at == 1.0 else at * tip + (1.0 - at) * _start_point(figure, parent, points)


def _link_lengths(figure: Figure, pixels: Mapping[str, Array]) -> list[float]:
    """(L,) pixels: the mean over twins of what was seen, else the rest length at the scale of what was seen."""
    seen: dict[str, list[float]] = {}
    for i, link in enumerate(figure.links):
        if link.joint in pixels:
            length = float(np.linalg.norm(pixels[link.joint] - _start_point(figure, i, pixels)))
            if length < 1.0:
                raise PoseError(f"{link.joint} lies on the joint before it; mark the two apart")
            seen.setdefault(_twin_name(link), []).append(length)
    means = {name: float(np.mean(lengths)) for name, lengths in seen.items()}
    rest = {_twin_name(link): link.length for link in figure.links}
    scale = sum(means.values()) / sum(rest[name] for name in means)
    return [means.get(_twin_name(link), scale * link.length) for link in figure.links]


def _leg_length(figure: Figure, lengths: list[float]) -> float:
    legs = {_twin_name(k): length for k, length in zip(figure.links, lengths, strict=True) if figure.is_leg(k)}
    return sum(legs.values())


def _twin_name(link: Link) -> str:
    return link.name.removesuffix("_near").removesuffix("_far")
