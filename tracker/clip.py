"""One clip followed from the video file to a run's folder."""

import json
import time
from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from dynamics.rate import backwards
from dynamics.slds import SLDS
from kinematics.figure import Figure, load_figure
from kinematics.recover import Start, facing_of, start_pose
from tracker import __version__
from tracker.drawing import enlargement, paint
from tracker.keypoints import Mark, Marks, points
from tracker.models import CONSTANT_VELOCITY, find_model
from tracker.progress import Advance, Progress
from tracker.settings import Settings
from tracker.store import Track, write_tables
from tracker.track import Estimate, make_tracker, run
from videos.frames import Frame, Video
from videos.writer import Writer

Image = NDArray[np.uint8]
T = TypeVar("T")


class StartError(ValueError):
    """A start pose that this clip cannot be followed from."""


@dataclass(frozen=True)
class Job:
    """What to follow, and how.

    marks  : marked joints by frame
    start  : the marked frame to start from, None for the first there is
    stop   : the last frame to follow, None for the clip's end
    facing : +1 right, -1 left, None to see it from the start pose
    rate   : playback speed: 1 as filmed, 0.5 half speed
    """

    video: Path
    marks: Marks
    model: str
    settings: Settings = field(default_factory=Settings)
    start: int | None = None
    stop: int | None = None
    facing: int | None = None
    rate: float = 1.0


@dataclass(frozen=True)
class Run:
    """A finished run: the track and what is to be said of it.

    frames  : how many frames were read
    seconds : spent a frame, by stage
    """

    job: Job
    track: Track
    fps: float
    frames: int
    seconds: dict[str, float]
    warnings: list[str]


def follow(job: Job, progress: Progress) -> Run:
    """Track the clip.

    Raises:
        VideoError, StartError, KeypointsError, PoseError, ModelError: whatever cannot be used, in one line.
    """
    frame = start_frame(job)
    video = Video(job.video)
    start = _start(job, frame, (video.width, video.height))
    slds = find_model(job.model, video.fps / job.rate, job.settings)
    clock = _Clock()
    with progress.task(f"{job.video.name} with {job.model}", _total(video, job)) as advance:
        before, ahead = [], clock.timed("read", iter(video))
        times: list[float] = []
        for shown in ahead:
            times.append(shown.time)
            if shown.index == frame:
                break
            before.append(shown.image)
        else:
            raise StartError(
                f"frame {frame} is not in {job.video.name}, which has {len(before)}; mark another frame"
            )
        first_image = shown.image
        rest = _images(ahead, times, job.stop)
        forward = _estimates(start, slds, job, _chain(first_image, rest), advance, clock)
        reverse: list[Estimate] = []
        if before:
            mirrored = slds if job.model == CONSTANT_VELOCITY else backwards(slds)
            back = _chain(first_image, iter(before[::-1]))
            reverse = _estimates(start, mirrored, job, back, advance, clock)[1:]
    track = _track(job, start, slds, times, reverse[::-1] + forward)
    warnings = [video.cut_short] if video.cut_short else []
    lost = [i for i, outcome in enumerate(track.outcome) if outcome == "lost"]
    if lost:
        warnings.append(f"nothing matched in {len(lost)} of {len(track)} frames, first in frame {lost[0]}")
    return Run(job, track, video.fps, len(times), clock.per_frame(len(times)), warnings)


def write_run(finished: Run, folder: Path, progress: Progress) -> None:
    """keypoints.csv, pose.csv, track.npz, overlay.mp4 and, last, run.json."""
    began = time.perf_counter()
    write_tables(finished.track, folder, finished.frames, finished.fps)
    write_overlay(finished, folder / "overlay.mp4", progress)
    write = (time.perf_counter() - began) / finished.frames
    job = finished.job
    news = {
        "figtrack": __version__,
        "video": str(job.video),
        "model": job.model,
        "settings": job.settings.model_dump(mode="json"),
        "fps": finished.fps,
        "frames": finished.frames,
        "start": start_frame(job),
        "rate": job.rate,
        "facing": "right" if finished.track.view.facing > 0 else "left",
        "seconds_per_frame": finished.seconds | {"write": round(write, 5)},
        "warnings": finished.warnings,
    }
    (folder / "run.json").write_text(json.dumps(news, indent=2) + "\n", encoding="utf-8")


def write_overlay(finished: Run, path: Path, progress: Progress) -> None:
    """The clip with the figure drawn on every frame."""
    video = Video(finished.job.video)
    scale = enlargement(video.height)
    size = (video.width * scale, video.height * scale)
    drawing = progress.task(f"{finished.job.video.name} overlay", finished.frames)
    with drawing as advance, Writer(path, finished.fps, size) as writer:
        for frame in video:
            if frame.index >= finished.frames:
                break
            writer.write(
                paint(frame.image, finished.track, frame.index, f"{finished.job.model}  "), frame.time
            )
            advance()


def start_frame(job: Job) -> int:
    """The marked frame to start from; StartError if `start` is not marked."""
    if job.start is None:
        return min(job.marks)
    if job.start not in job.marks:
        marked = ", ".join(str(frame) for frame in sorted(job.marks)[:8])
        raise StartError(f"frame {job.start} is not marked in the keypoints table; marked are {marked}")
    return job.start


def _start(job: Job, frame: int, size: tuple[int, int]) -> Start:
    figure = load_figure()
    marks = job.marks[frame]
    _check_in_frame(figure, marks, frame, size)
    later = next((job.marks[f] for f in sorted(job.marks) if f > frame), None)
    facing = job.facing or facing_of(points(marks), None if later is None else points(later))
    return start_pose(figure, points(marks), facing)


def _check_in_frame(figure: Figure, marks: dict[str, Mark], frame: int, size: tuple[int, int]) -> None:
    width, height = size
    outside = [
        name
        for name, mark in marks.items()
        if not (-0.5 <= mark.x <= width - 0.5 and -0.5 <= mark.y <= height - 0.5)
    ]
    if figure.base in outside or 2 * len(outside) > len(marks):
        raise StartError(
            f"the start pose of frame {frame} lies outside the picture of {width} x {height} px "
            f"({', '.join(outside)}); mark it on the very video that is tracked"
        )


def _estimates(
    start: Start, slds: SLDS, job: Job, images: Iterator[Image], advance: Advance, clock: "_Clock"
) -> list[Estimate]:
    tracker = make_tracker(start, slds, job.settings)
    found = []
    for estimate in clock.timed("track", run(tracker, start, images)):
        found.append(estimate)
        advance()
    return found


def _images(frames: Iterator[Frame], times: list[float], stop: int | None) -> Iterator[Image]:
    if stop is not None and len(times) > stop:
        return
    for frame in frames:
        times.append(frame.time)
        yield frame.image
        if frame.index == stop:
            return


def _chain(first: Image, rest: Iterable[Image]) -> Iterator[Image]:
    yield first
    yield from rest


def _track(job: Job, start: Start, slds: SLDS, times: list[float], estimates: list[Estimate]) -> Track:
    return Track(
        figure=start.figure,
        view=start.view,
        model=job.model,
        labels=slds.labels,
        first=0,
        times=np.array(times) - times[0],
        q=np.stack([estimate.pose.mean for estimate in estimates]),
        cov=np.stack([estimate.pose.cov for estimate in estimates]),
        s=np.array([estimate.s for estimate in estimates]),
        outcome=tuple(estimate.outcome for estimate in estimates),
    )


def _total(video: Video, job: Job) -> int | None:
    if video.count_hint is None:
        return None
    return video.count_hint if job.stop is None else min(video.count_hint, job.stop + 1)


class _Clock:
    """Seconds spent in iterators, nested ones taken off the outer."""

    def __init__(self) -> None:
        self.spent: dict[str, float] = defaultdict(float)

    def timed(self, stage: str, items: Iterator[T]) -> Iterator[T]:
        while True:
            began, inner = time.perf_counter(), sum(self.spent.values())
            try:
                item = next(items)
            except StopIteration:
                return
            finally:
                self.spent[stage] += time.perf_counter() - began - (sum(self.spent.values()) - inner)
            yield item

    def per_frame(self, frames: int) -> dict[str, float]:
        return {stage: round(seconds / max(frames, 1), 5) for stage, seconds in self.spent.items()}
