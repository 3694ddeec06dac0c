"""One clip followed from the video file to a run's folder."""

import json
import time
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import chain, islice
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from dynamics.rate import backwards
from dynamics.slds import SLDS
from kinematics.figure import load_figure
from kinematics.recover import Start, facing_of, marked_part, start_pose
from tracker import __version__
from tracker.drawing import enlargement, paint
from tracker.keypoints import Mark, Marks, points
from tracker.models import CONSTANT_VELOCITY, find_model, state_rates
from tracker.progress import Progress
from tracker.settings import Settings
from tracker.smoothing import smoothed
from tracker.store import Track, write_tables
from tracker.track import LOST, Estimate, Tracker, make_tracker, run
from videos.frames import Video
from videos.writer import Writer

Image = NDArray[np.uint8]
T = TypeVar("T")


class StartError(ValueError):
    """A start pose that this clip cannot be followed from."""


@dataclass(frozen=True)
class Job:
    """What to follow, and how.

    video  : a file, or a folder of numbered images
    marks  : marked joints by frame
    model  : "cv", a shipped model's name or a model file
    start  : the marked frame to start from, None for the first there is
    stop   : the last frame to follow, None for the clip's end
    facing : +1 right, -1 left, None to see it from the start pose
    rate   : playback speed: 1 as filmed, 0.5 half speed; None to find it among `settings.rates`
    called : what the results call the video, None for its path
    smooth : write each pose given the whole clip; False for what was known at its frame
    """

    video: Path
    marks: Marks
    model: str
    settings: Settings = field(default_factory=Settings)
    start: int | None = None
    stop: int | None = None
    facing: int | None = None
    rate: float | None = None
    called: str | None = None
    smooth: bool = True


@dataclass(frozen=True)
class Plan:
    """A job that can be done: all that it names was read and fits together."""

    job: Job
    video: Video
    start: Start
    slds: SLDS
    tracker: Tracker


@dataclass(frozen=True)
class Run:
    """A finished run: the track and what is to be said of it.

    frames  : how many frames were read
    rate    : playback speed, as given or as the median frame's switching state has it
    seconds : spent a frame, by stage
    """

    job: Job
    track: Track
    fps: float
    frames: int
    rate: float
    seconds: dict[str, float]
    warnings: list[str]


def prepare(job: Job) -> Plan:
    """Read what the job names and check that it fits together, before any work.

    Raises:
        VideoError, ModelError: a file that cannot be used.
        StartError, PoseError: no pose to start from.
        ValueError: a model for another figure or frame rate.
    """
    frame = start_frame(job)
    if job.stop is not None and job.stop < frame:
        raise StartError(f"--stop {job.stop} comes before the start frame {frame}; choose a later --stop")
    video = Video(job.video)
    start = _start(job.marks, frame, job.facing, (video.width, video.height))
    rates = job.settings.rates if job.rate is None else (job.rate,)
    settings = job.settings.model_copy(update={"rates": rates})
    slds = find_model(job.model, video.fps, settings)
    return Plan(job, video, start, slds, make_tracker(start, slds, settings))


def follow(job: Job, progress: Progress) -> Run:
    """Track the clip: ahead from the start frame, and backwards from it to frame 0.

    Raises:
        VideoError, ModelError, StartError, PoseError, ValueError: as `prepare`; or the clip ends too early.
    """
    plan, frame, clock = prepare(job), start_frame(job), _Clock()
    times: list[float] = []
    images = clock.timed("read", _images(plan.video, job.stop, times))
    with progress.task(f"{job.video.name} with {job.model}", _total(plan)) as advance:
        before = list(islice(images, frame))
        marked = next(images, None)
        if marked is None:
            raise StartError(
                f"frame {frame} is not in {job.video.name}, which has {len(before)}; mark another frame"
            )
        ahead, behind = [], []
        for estimate in _tracked(plan.tracker, plan, chain([marked], images), clock):
            ahead.append(estimate)
            advance()
        if before:
            back = _reversed(plan)
            for estimate in islice(_tracked(back, plan, [marked, *before[::-1]], clock), 1, None):
                behind.append(estimate)
                advance()
    track = _track(plan, times, behind[::-1] + ahead)
    return Run(
        job=job,
        track=track,
        fps=plan.video.fps,
        frames=len(times),
        rate=_rate(plan, track),
        seconds=clock.per_frame(len(times)),
        warnings=_warnings(plan.video, track),
    )


def write_run(finished: Run, folder: Path, progress: Progress) -> None:
    """keypoints.csv, pose.csv, track.npz, overlay.mp4 and, last, run.json."""
    began = time.perf_counter()
    write_tables(finished.track, folder, finished.frames, finished.fps)
    write_overlay(finished, folder / "overlay.mp4", progress)
    write = (time.perf_counter() - began) / finished.frames
    job = finished.job
    news = {
        "figtrack": __version__,
        "video": job.called or str(job.video),
        "model": job.model,
        "smooth": job.smooth,
        "settings": job.settings.model_dump(mode="json"),
        "fps": finished.fps,
        "frames": finished.frames,
        "start": start_frame(job),
        "rate": finished.rate,
        "facing": "right" if finished.track.view.facing > 0 else "left",
        "seconds_per_frame": finished.seconds | {"write": round(write, 5)},
        "warnings": finished.warnings,
    }
    (folder / "run.json").write_text(json.dumps(news, indent=2) + "\n", encoding="utf-8")


def write_overlay(finished: Run, path: Path, progress: Progress) -> None:
    """The clip with the figure drawn on every frame."""
    job = finished.job
    video = Video(job.video)
    scale = enlargement(video.height)
    size = (video.width * scale, video.height * scale)
    drawing = progress.task(f"{job.video.name} overlay", finished.frames)
    with drawing as advance, Writer(path, finished.fps, size) as writer:
        for frame in islice(video, finished.frames):
            writer.write(paint(frame.image, finished.track, frame.index, f"{job.model}  "), frame.time)
            advance()


def start_frame(job: Job) -> int:
    """The marked frame to start from; StartError if `start` is not marked."""
    if job.start is None:
        return min(job.marks)
    if job.start not in job.marks:
        marked = ", ".join(str(frame) for frame in sorted(job.marks)[:8])
        raise StartError(f"frame {job.start} is not marked in the keypoints table; marked are {marked}")
    return job.start


def _start(marks: Marks, frame: int, facing: int | None, size: tuple[int, int]) -> Start:
    marked = marks[frame]
    figure = marked_part(load_figure(), points(marked))
    _check_in_picture(marked, figure.base, frame, size)
    later = next((points(marks[f]) for f in sorted(marks) if f > frame), None)
    return start_pose(figure, points(marked), facing or facing_of(points(marked), later))


def _check_in_picture(marked: dict[str, Mark], base: str, frame: int, size: tuple[int, int]) -> None:
    width, height = size
    outside = [
        name
        for name, mark in marked.items()
        if not (-0.5 <= mark.x <= width - 0.5 and -0.5 <= mark.y <= height - 0.5)
    ]
    if base in outside or 2 * len(outside) > len(marked):
        raise StartError(
            f"the start pose of frame {frame} lies outside the picture of {width} x {height} px "
            f"({', '.join(outside)}); mark it on the very video that is tracked"
        )


def _images(video: Video, stop: int | None, times: list[float]) -> Iterator[Image]:
    """Pictures up to frame `stop`; notes the time of each."""
    for frame in video if stop is None else islice(video, stop + 1):
        times.append(frame.time)
        yield frame.image


def _tracked(tracker: Tracker, plan: Plan, images: Iterable[Image], clock: "_Clock") -> Iterator[Estimate]:
    """Estimates of all images, the first of which is the marked one."""
    estimates = clock.timed("track", run(tracker, plan.start, images))
    return clock.timed("smooth", smoothed(tracker, estimates)) if plan.job.smooth else estimates


def _reversed(plan: Plan) -> Tracker:
    """The tracker that goes backwards in time."""
    # A constant velocity is one in either direction; conversion would only change its noise.
    slds = plan.slds if plan.job.model == CONSTANT_VELOCITY else backwards(plan.slds)
    return make_tracker(plan.start, slds, plan.tracker.settings)


def _track(plan: Plan, times: Sequence[float], estimates: Sequence[Estimate]) -> Track:
    return Track(
        figure=plan.start.figure,
        view=plan.start.view,
        model=plan.job.model,
        labels=plan.slds.labels,
        first=0,
        times=np.array(times) - times[0],
        q=np.stack([estimate.pose.mean for estimate in estimates]),
        cov=np.stack([estimate.pose.cov for estimate in estimates]),
        s=np.array([estimate.s for estimate in estimates]),
        outcome=tuple(estimate.outcome for estimate in estimates),
    )


def _rate(plan: Plan, track: Track) -> float:
    if plan.job.rate is not None:
        return plan.job.rate
    rates = state_rates(plan.slds, plan.tracker.settings)[track.s]
    known = rates[np.isfinite(rates)]
    return float(np.median(known)) if len(known) else 1.0


def _warnings(video: Video, track: Track) -> list[str]:
    warnings = [video.cut_short] if video.cut_short else []
    lost = [t for t, outcome in enumerate(track.outcome) if outcome == LOST]
    if lost:
        warnings.append(f"nothing matched in {len(lost)} of {len(track)} frames, first in frame {lost[0]}")
    return warnings


def _total(plan: Plan) -> int | None:
    """About how many frames there are to track."""
    counts = [plan.video.count_hint, None if plan.job.stop is None else plan.job.stop + 1]
    return min((count for count in counts if count is not None), default=None)


class _Clock:
    """Seconds spent inside iterators, by stage; what one iterator takes from another counts once."""

    def __init__(self) -> None:
        self.spent: dict[str, float] = defaultdict(float)

    def timed(self, stage: str, items: Iterable[T]) -> Iterator[T]:
        iterator = iter(items)
        while True:
            began, before = time.perf_counter(), sum(self.spent.values())
            try:
                item = next(iterator)
            except StopIteration:
                return
            finally:
                nested = sum(self.spent.values()) - before
                self.spent[stage] += time.perf_counter() - began - nested
            yield item

    def per_frame(self, frames: int) -> dict[str, float]:
        return {stage: round(seconds / frames, 5) for stage, seconds in self.spent.items()}
