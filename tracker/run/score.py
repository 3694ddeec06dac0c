"""Tracks against marked poses: errors in leg lengths, and the loss of a track.

Errors are over the scored joints of a figure (for the walking one head top, neck, hip, knees and ankles), in
leg lengths (thigh + shank, the mean of the legs in the first marked frame), each at most 1. A
track is lost at the first of two marked frames in a row with a mean error over 0.25, not recovered in the
third where there is one.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from kinematics.figure import Figure
from kinematics.figure_file import WALKER
from kinematics.recover import positions, span
from tracker.run.track import Track
from tracker.tables.keypoints import Mark, Marks, points

LOST_ERROR = 0.25  # mean error of a frame above which a track is lost, leg lengths
SWAP_GAIN = 0.1  # decrease of the error that shows exchanged legs, leg lengths

Places = Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class Score:
    """The scores of one track; the fields of compare.json.

    frame_errors : mean error of each marked frame after the start, in their order, leg lengths
    mark_errors  : error of every mark in these frames, leg lengths
    link_errors  : error of every visible leg link's direction in these frames, degrees
    """

    first_failure_frame: int | None
    frames_followed: int
    truth_frames: int
    mean_error_leg: float
    median_error_leg: float
    pck_02_leg: float
    swaps: int
    angle_median_deg: float | None
    frame_errors: dict[int, float]
    mark_errors: tuple[float, ...]
    link_errors: tuple[float, ...]

    def summary(self) -> dict[str, float | int | None]:
        return {
            "first_failure_frame": self.first_failure_frame,
            "frames_followed": self.frames_followed,
            "truth_frames": self.truth_frames,
            "mean_error_leg": round(self.mean_error_leg, 4),
            "median_error_leg": round(self.median_error_leg, 4),
            "pck_02_leg": round(self.pck_02_leg, 4),
            "swaps": self.swaps,
            "angle_median_deg": None if self.angle_median_deg is None else round(self.angle_median_deg, 2),
        }


def places(track: Track) -> dict[int, dict[str, tuple[float, float]]]:
    """Pixel positions of the tracked joints, by frame and name."""
    names, rows = track.figure.joints, track.joints().tolist()
    return {
        frame: {name: (x, y) for name, (x, y) in zip(names, row, strict=True)}
        for frame, row in enumerate(rows, track.first)
    }


def score(truth: Marks, found: Mapping[int, Places], start: int, figure: Figure = WALKER) -> Score:
    """Errors of a track in every marked frame after the start frame. ValueError: no such frame has a scored
    joint, or no leg is wholly marked."""
    frames = [frame for frame in sorted(truth) if frame >= start]
    later = [frame for frame in frames if frame > start]
    if not later:
        raise ValueError(f"the truth marks no frame after frame {start}; mark some or give another --truth")
    leg = leg_length(truth, frames, figure)
    errors = {frame: _errors(truth[frame], found.get(frame, {}), leg, figure.scored) for frame in later}
    means = {frame: float(np.mean(list(error.values()))) for frame, error in errors.items() if error}
    if not means:
        scored = ", ".join(figure.scored)
        raise ValueError(f"the truth marks none of {scored} after frame {start}; mark some")
    everything = np.concatenate([list(error.values()) for error in errors.values()])
    failure = _first_failure(means)
    every = {figure.links[i].joint: figure.links[twin].joint for i, twin in figure.twins.items()}
    twins = {name: every[name] for name in figure.scored if name in every}
    angles = [angle for frame in later for angle in _angles(figure, truth[frame], found.get(frame, {}))]
    return Score(
        first_failure_frame=failure,
        frames_followed=sum(1 for frame in means if failure is None or frame < failure),
        truth_frames=len(means),
        mean_error_leg=float(np.mean(list(means.values()))),
        median_error_leg=float(np.median(everything)),
        pck_02_leg=float(np.mean(everything < 0.2)),
        swaps=sum(_swapped(truth[frame], found.get(frame, {}), leg, twins) for frame in later),
        angle_median_deg=float(np.median(angles)) if angles else None,
        frame_errors=means,
        mark_errors=tuple(everything.tolist()),
        link_errors=tuple(angles),
    )


def leg_length(truth: Marks, frames: list[int], figure: Figure = WALKER) -> float:
    """Leg length in pixels, the mean of the wholly marked legs in the first marked frame that has any."""
    for frame in frames:
        places = positions(points(truth[frame]))
        legs = [[span(figure, i, places) for i in leg] for leg in figure.legs]
        lengths = [sum(np.nan if link is None else np.hypot(*link) for link in leg) for leg in legs]
        if whole := [length for length in lengths if np.isfinite(length)]:
            return float(np.mean(whole))
    wanted = ", ".join(_joints(figure)) or "none is listed"
    raise ValueError(f"the truth marks no whole leg ({wanted}) in any frame; mark one")


def _joints(figure: Figure) -> list[str]:
    """The joints of a leg, from its parent's."""
    leg = figure.legs[0] if figure.legs else ()
    return [figure.joints[i + 1] for i in (*(figure.parents[i] for i in leg[:1]), *leg)]


def _errors(marks: Mapping[str, Mark], found: Places, leg: float, scored: Sequence[str]) -> dict[str, float]:
    return {
        name: min(_apart(marks[name], Mark(*found[name])) / leg, 1.0) if name in found else 1.0
        for name in scored
        if name in marks
    }


def _first_failure(means: Mapping[int, float]) -> int | None:
    frames = list(means)
    bad = [means[frame] > LOST_ERROR for frame in frames]
    return next((frame for i, frame in enumerate(frames[:-1]) if all(bad[i : i + 3])), None)


def _swapped(marks: Mapping[str, Mark], found: Places, leg: float, twins: Mapping[str, str]) -> bool:
    if not twins or not all(name in marks and name in found for name in twins):
        return False
    as_named = np.mean([_apart(marks[name], Mark(*found[name])) for name in twins])
    exchanged = np.mean([_apart(marks[name], Mark(*found[other])) for name, other in twins.items()])
    return bool((as_named - exchanged) / leg > SWAP_GAIN)


def _angles(figure: Figure, marks: Mapping[str, Mark], found: Places) -> list[float]:
    out = []
    places, tracked = positions(points(marks)), positions(found)
    for n, i in ((n, i) for leg in figure.legs for n, i in enumerate(leg)):
        wanted, got = span(figure, i, places), span(figure, i, tracked)
        if wanted is None or got is None or not marks[figure.links[i].joint].visible:
            continue
        # Marks of a leg's start are uncertain in every frame.
        before = marks.get(figure.links[figure.parents[i]].joint)
        if n == 0 or (before is not None and before.visible):
            apart = np.arctan2(*wanted) - np.arctan2(*got)
            out.append(float(abs(np.degrees((apart + np.pi) % (2.0 * np.pi) - np.pi))))
    return out


def _apart(a: Mark, b: Mark) -> float:
    return float(np.hypot(a.x - b.x, a.y - b.y))
