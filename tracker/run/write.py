"""A Track written as the tables of a run's folder."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from dynamics.gaussian import Array
from tracker.run.track import Track
from tracker.tables.poses import pose_cells
from tracker.tables.table import write_table

FORMAT = "figtrack-track"
VERSION = 2
KEYPOINTS = ("frame", "keypoint", "x", "y", "visible", "time_s", "sxx", "sxy", "syy")
ROWS = ("times", "q", "cov", "s", "motions", "outcome", "moved")  # of a track, in track.npz
SAID = ("time_s", "state", "label", "outcome")  # further columns of the pose table


def write_tables(track: Track, folder: Path, frames: int, fps: float) -> None:
    """Write keypoints.csv, pose.csv and track.npz, with rows for every frame of the clip."""
    places, covs = track.joints(), track.joint_covs()
    times = whole_times(track.times, track.first, frames, fps, track.before)
    write_table(folder / "keypoints.csv", KEYPOINTS, _keypoints(track, places, covs, times))
    learned = track.figure.learned_freedoms
    columns = ("seq", "frame", *learned, *SAID, *track.figure.pose_freedoms[len(learned) :])
    write_table(folder / "pose.csv", columns, _poses(track, times))
    header = {
        "format": FORMAT,
        "version": VERSION,
        "model": track.model,
        "labels": track.labels,
        "misnamed": track.misnamed,
        "first": track.first,
        "before": track.before,
        "figure": track.figure.name,
        "freedoms": track.figure.freedoms,
        "joints": track.figure.joints,
        "lengths": [link.length for link in track.figure.links],
        "view": [*track.view.origin, track.view.unit, track.view.facing],
    }
    rows: dict[str, Any] = {name: getattr(track, name) for name in ROWS}
    about = np.array(json.dumps(header))
    np.savez_compressed(folder / "track.npz", header=about, joints=places, joint_covs=covs, **rows)


def _keypoints(track: Track, places: Array, covs: Array, times: Array) -> Iterator[tuple[object, ...]]:
    column = {name: j for j, name in enumerate(track.figure.joints)}
    names = tuple(dict.fromkeys((*track.figure.marks, *track.figure.joints)))
    for frame, seconds in enumerate(times):
        t, time = frame - track.first, f"{seconds:.6f}"
        for name in names:
            if 0 <= t < len(track) and name in column:
                (x, y), S = places[t, column[name]], covs[t, column[name]]
                spread = (f"{S[0, 0]:.4f}", f"{S[0, 1]:.4f}", f"{S[1, 1]:.4f}")
                yield frame, name, f"{x:.3f}", f"{y:.3f}", int(track.outcome[t].measured), time, *spread
            else:
                yield frame, name, "", "", "", time, "", "", ""


def _poses(track: Track, times: Array) -> Iterator[tuple[object, ...]]:
    learned, every = len(track.figure.learned_freedoms), len(track.figure.pose_freedoms)
    for frame, seconds in enumerate(times):
        t = frame - track.first
        pose, said = [""] * every, ("", "", "")
        if 0 <= t < len(track):
            pose = pose_cells(track.q[t, :every])
            said = (str(track.s[t]), track.motions[t], str(track.outcome[t]))
        yield 0, frame, *pose[:learned], f"{seconds:.6f}", *said, *pose[learned:]


def whole_times(times: Array, first: int, frames: int, fps: float, before: Sequence[float] = ()) -> Array:
    """(frames,) seconds of every frame of a clip, of which those from `first` on were followed at `times`.

    Without those `before`, and always after the followed frames, times are spaced evenly; the first is 0.
    """
    early = before if len(before) == first else np.linspace(0.0, times[0], first, endpoint=False)
    late = times[-1] + np.arange(1, frames - first - len(times) + 1) / fps
    return np.concatenate([early, times, late])
