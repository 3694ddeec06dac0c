"""The points of the file of `--measure`: those that count, and how they compare with the track."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from dynamics.gaussian import Array
from kinematics.recover import Start
from kinematics.sides import on_side, other_side
from kinematics.spm import joints
from tracker.foreign.formats import read_points
from tracker.foreign.text_files import ForeignError
from tracker.loop.detections import Detections, Detector
from tracker.often import crowded
from tracker.run.track import Track
from tracker.settings import Settings

FAR = 1.0  # median distance from the start pose, leg lengths, above which the file is of another clip
FEWEST = 3  # points needed for this judgement
SIGMA = 1.4826  # standard deviations in the median of a Gaussian's absolute values


@dataclass(frozen=True)
class Judged:
    """The points compared with a finished track, as stored in run.json.

    file      : of the points
    joints    : of the figure, those that have points
    frames    : number of the track's frames with points
    spread    : standard deviation of a point that was used, leg lengths
    exchanged : frames in which near and far leg are judged to be exchanged
    """

    file: str
    joints: list[str]
    frames: int
    spread: float
    exchanged: list[int]

    def __str__(self) -> str:
        wrong = f"legs named the wrong way round in {len(self.exchanged)} of {self.frames} frames"
        return f"{self.file} has points of {', '.join(self.joints)}; {wrong}"


@dataclass(frozen=True)
class Measured:
    """A file of points.

    frames : the points that count, by frame
    jitter : standard deviation of a point about a smooth path, leg lengths; 0 if there are too few points
    """

    path: Path
    frames: dict[int, Detections]
    jitter: float

    def judged(self, track: Track, settings: Settings) -> Judged:
        """The points compared with the poses of a track; `settings` are those of its run."""
        rows = {frame: frame - track.first for frame in self.frames}
        rows = {frame: t for frame, t in rows.items() if 0 <= t < len(track)}
        exchanged = [
            frame
            for frame, t in rows.items()
            if Detector(track.figure, track.view_at(t), settings).misnamed(self.frames[frame], track.q[t])
        ]
        told = {int(joint) for found in self.frames.values() for joint in found.joint}
        names = [track.figure.joints[joint] for joint in sorted(told)]
        return Judged(str(self.path), names, len(rows), round(settings.point, 4), exchanged)


def read_measured(path: Path, start: Start, frame: int, fps: float, settings: Settings) -> Measured:
    """The points of a file that the figure has and that are likely enough, by frame.

    Args:
        start: the pose marked in `frame`; it says which leg is near.

    Raises:
        ForeignError: a file that cannot be read, no point that counts, or points of somebody else.
    """
    points = read_points(path, start.view.facing, start.figure)
    likely = (points.likelihood >= settings.point_likelihood)[..., None]
    places = np.where(likely, points.known, np.nan)
    frames = {t: Detections.of(start.figure, points.names, row) for t, row in enumerate(places)}
    # Errors of successive frames are correlated, so a frame counts less where there are more of them.
    frames = {t: replace(found, doubt=crowded(fps)) for t, found in frames.items() if len(found.joint)}
    if not frames:
        raise ForeignError(
            f"no point of {path} has a likelihood of {settings.point_likelihood:g}; lower point_likelihood "
            "in a --settings file"
        )
    _check_whose(path, frames.get(frame), start, frame)
    return Measured(path, frames, jitter(points.names, places) / start.view.unit)


def jitter(names: tuple[str, ...], places: Array) -> float:
    """Standard deviation of a coordinate about smooth paths (T, J, 2); 0 if there are too few frames.

    It is measured by third differences, which almost remove motion and multiply the variance of white noise
    by twenty. Points of the two legs are summed, as an exchange does not change the sum; the median ignores
    outliers.
    """
    paths = dict(zip(names, np.moveaxis(places, 1, 0), strict=True))
    for near in [name for name in names if on_side(name, "near")]:
        far = other_side(near)
        if far in paths:
            paths[near] = (paths[near] + paths.pop(far)) / np.sqrt(2.0)
    away = np.abs(np.diff(np.stack(list(paths.values())), 3, axis=1))
    known = away[np.isfinite(away)]
    return SIGMA * float(np.median(known)) / np.sqrt(20.0) if known.size else 0.0


def _check_whose(path: Path, found: Detections | None, start: Start, frame: int) -> None:
    if found is None or len(found.joint) < FEWEST:
        return
    marked = start.view.to_pixels(joints(start.figure, start.q))
    away = min(
        float(np.median(np.hypot(*(found.pixels - marked[joint]).T)))
        for joint in (found.joint, start.figure.joint_twins[found.joint])
    )
    if away > FAR * start.view.unit:
        raise ForeignError(
            f"the points of {path} in frame {frame} are {away:.0f} px from the start pose; "
            "give the file of this very clip, in its pixels"
        )
