"""A Track written as the tables of a run's folder."""

import csv
import json
from pathlib import Path

import numpy as np

from kinematics.figure import ROOT
from tracker.run.track import Track

FORMAT = "figtrack-track"
VERSION = 1


def write_tables(track: Track, folder: Path, frames: int, fps: float) -> None:
    """keypoints.csv, pose.csv and track.npz; every frame of the clip has its rows."""
    _write_keypoints(track, folder / "keypoints.csv", frames, fps)
    _write_poses(track, folder / "pose.csv", frames, fps)
    header = {
        "format": FORMAT,
        "version": VERSION,
        "model": track.model,
        "labels": track.labels,
        "gait": track.gait,
        "first": track.first,
        "figure": track.figure.name,
        "freedoms": track.figure.freedoms,
        "joints": track.figure.joints,
        "lengths": [link.length for link in track.figure.links],
        "view": [*track.view.origin, track.view.unit, track.view.facing],
    }
    np.savez_compressed(
        folder / "track.npz",
        header=np.array(json.dumps(header)),
        times=track.times,
        q=track.q,
        cov=track.cov,
        s=track.s,
        outcome=np.array(track.outcome),
        shift=track.shift,
        joints=track.joints(),
        joint_covs=track.joint_covs(),
    )


def _write_keypoints(track: Track, path: Path, frames: int, fps: float) -> None:
    places, covs = track.joints(), track.joint_covs()
    column = {name: j for j, name in enumerate(track.figure.joints)}
    names = tuple(dict.fromkeys((*track.figure.marks, *track.figure.joints)))
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(("frame", "keypoint", "x", "y", "visible", "time_s", "sxx", "sxy", "syy"))
        for frame in range(frames):
            t = frame - track.first
            time = _time(track, t, fps)
            for name in names:
                if 0 <= t < len(track) and name in column:
                    (x, y), S = places[t, column[name]], covs[t, column[name]]
                    spread = (f"{S[0, 0]:.4f}", f"{S[0, 1]:.4f}", f"{S[1, 1]:.4f}")
                    seen = int(track.outcome[t].measured)
                    writer.writerow((frame, name, f"{x:.3f}", f"{y:.3f}", seen, time, *spread))
                else:
                    writer.writerow((frame, name, "", "", "", time, "", "", ""))


def _write_poses(track: Track, path: Path, frames: int, fps: float) -> None:
    columns = track.figure.learned_freedoms
    further = track.figure.pose_freedoms[len(columns) :]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(("seq", "frame", *columns, "time_s", "state", "label", "outcome", *further))
        for frame in range(frames):
            t = frame - track.first
            if not 0 <= t < len(track):
                nothing = [""] * (3 + len(further))
                writer.writerow((0, frame, *[""] * len(columns), _time(track, t, fps), *nothing))
                continue
            q, s = track.q[t], track.s[t]
            place = [f"{v:.5f}" for v in q[: len(ROOT)]]
            turns = [f"{v:.4f}" for v in np.degrees(q[len(ROOT) : len(columns) + len(further)])]
            of_model, rest = turns[: len(columns) - len(ROOT)], turns[len(columns) - len(ROOT) :]
            said = (s, track.motion(t), track.outcome[t])
            writer.writerow((0, frame, *place, *of_model, _time(track, t, fps), *said, *rest))


def _time(track: Track, t: int, fps: float) -> str:
    if 0 <= t < len(track):
        return f"{track.times[t]:.6f}"
    edge = 0 if t < 0 else len(track) - 1
    return f"{track.times[edge] + (t - edge) / fps:.6f}"
