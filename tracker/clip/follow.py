"""One clip followed from the video file to a run's folder."""

import json
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from itertools import islice
from pathlib import Path

import numpy as np

from dynamics.belief import Belief
from dynamics.motion.rate import backwards
from dynamics.slds import SLDS
from kinematics.mocap import POSE_COLUMNS
from kinematics.recover import Start
from tracker import __version__
from tracker.clip.clock import Clock
from tracker.clip.heading import FRAMES, footless, heading
from tracker.clip.job import Job
from tracker.clip.measure import Judged, Measured, read_measured
from tracker.clip.pictures import Reel
from tracker.clip.playback import playback_rate
from tracker.clip.start import StartError, marked_start
from tracker.gait.figures import gait_of
from tracker.loop.anchors import Anchor
from tracker.loop.both_ways import Passage
from tracker.loop.outcome import Outcome
from tracker.loop.smoothing import smoothed, turned_belief
from tracker.loop.tracker import Estimate, Tracker, make_tracker
from tracker.models.find import CONSTANT_VELOCITY, find_model
from tracker.picture.backdrop import Backdrop
from tracker.picture.plate import REACH, plate
from tracker.progress import Progress
from tracker.report.chapter import Chapter
from tracker.report.drawing import enlargement, paint
from tracker.report.page import write_report
from tracker.run.track import Track, write_tables
from tracker.settings import Settings
from videos.frames import Image, Video
from videos.writer import Writer

OVERLAY = "overlay.mp4"


@dataclass(frozen=True)
class Plan:
    """A job that can be done: all that it names was read and fits together."""

    job: Job
    video: Video
    reel: Reel
    start: Start
    slds: SLDS
    tracker: Tracker
    measured: Measured | None

    @cached_property
    def scene(self) -> Backdrop | None:
        """What lies behind the figure in the start frame, as the frames around show it."""
        frame, tracker = start_frame(self.job), self.tracker
        first = max(frame - REACH, 0)
        images = self.reel.span(first, frame + REACH)
        return plate(images, frame - first, tracker.start_box(self.start), tracker.view.unit)

    @cached_property
    def back(self) -> Tracker:
        """The tracker that goes back in time."""
        # A constant velocity is one in either direction; conversion would only change its noise.
        slds = self.slds if self.job.model == CONSTANT_VELOCITY else backwards(self.slds)
        return make_tracker(self.start, slds, self.tracker.settings)


@dataclass(frozen=True)
class Run:
    """A finished run: the track and what is to be said of it.

    frames  : how many frames were read
    size    : (width, height) of each, pixels
    rate    : playback speed, as given or as `tracker.clip.playback` finds it
    seconds : spent a frame, by stage
    points  : what is to be said of those of `Job.measure`
    """

    job: Job
    track: Track
    fps: float
    frames: int
    size: tuple[int, int]
    rate: float
    seconds: dict[str, float]
    warnings: list[str]
    points: Judged | None = None


def prepare(job: Job) -> Plan:
    """Read what the job names and check that it fits together, before any work.

    Raises:
        VideoError, ModelError, ForeignError: a file that cannot be used.
        StartError, PoseError: no pose to start from.
        ValueError: a model for another figure or frame rate.
    """
    if job.measure is None and not job.settings.templates:
        raise ValueError("without templates there is nothing to follow; give --measure FILE")
    frame = start_frame(job)
    if job.stop is not None and job.stop < frame:
        raise StartError(f"--stop {job.stop} comes before the start frame {frame}; choose a later --stop")
    video = Video(job.video)
    rates = job.settings.rates if job.rate is None else (job.rate,)
    settings = job.settings.model_copy(update={"rates": rates})
    start = _start(job, video, settings)
    slds = find_model(job.model, video.fps, settings)
    measured = None if job.measure is None else read_measured(job.measure, start, frame, settings)
    if measured is not None:
        settings = measured.known_by(settings)
    return Plan(job, video, Reel(video, job.stop), start, slds, make_tracker(start, slds, settings), measured)


def follow(job: Job, progress: Progress) -> Run:
    """Track the clip: ahead from the start frame, and backwards from it to frame 0.

    Raises:
        VideoError, ModelError, StartError, PoseError, ValueError: as `prepare`; or the clip ends too early.
    """
    plan, frame, clock = prepare(job), start_frame(job), Clock()
    reel = plan.reel
    images = clock.timed("read", reel.ahead())
    with progress.task(f"{job.video.name} with {job.model}", _total(plan)) as advance:
        marked = next(islice(images, frame, None), None)
        if marked is None:
            raise StartError(
                f"frame {frame} is not in {job.video.name}, which has {len(reel.times)}; mark another frame"
            )
        behind: list[Estimate] = []
        belief = None
        reel.curve = plan.tracker.tone_curve(plan.start, marked)
        marked = reel.shown(marked)
        if frame > 0:
            before = clock.timed("read", reel.span(frame - 1, 0))
            behind, belief = _followed(plan, _passage(plan, -1), marked, before, clock, advance)
        ahead, _ = _followed(plan, _passage(plan, 1), marked, images, clock, advance, belief)
    reel.forget()
    track = _track(plan, reel.times, behind[:0:-1] + ahead)
    points = None if plan.measured is None else plan.measured.judged(track, plan.tracker.settings)
    return Run(
        job=job,
        track=track,
        fps=plan.video.fps,
        frames=len(reel.times),
        size=(plan.video.width, plan.video.height),
        rate=_rate(plan, track),
        seconds=clock.per_frame(len(reel.times)),
        warnings=_warnings(plan, track, points),
        points=points,
    )


def write_run(finished: Run, folder: Path, progress: Progress, key: str = "") -> Chapter:
    """Tables, overlay.mp4, gait.json, report.html and, last, run.json; what the report tells.

    Args:
        key: tells a batch's job.
    """
    began = time.perf_counter()
    write_tables(finished.track, folder, finished.frames, finished.fps)
    write_overlay(finished, folder / OVERLAY, progress)
    told = _chapter(finished, folder / OVERLAY)
    if told.gait is not None:
        figures = json.dumps(told.gait.summary(), indent=2)
        (folder / "gait.json").write_text(figures + "\n", encoding="utf-8")
    write_report(folder / "report.html", told)
    write = (time.perf_counter() - began) / finished.frames
    job = finished.job
    news = {
        "figtrack": __version__,
        "video": job.called or str(job.video),
        "model": job.model,
        "smooth": job.smooth,
        "anchors": job.anchors,
        "measure": None if finished.points is None else asdict(finished.points),
        "settings": job.settings.model_dump(mode="json"),
        "fps": finished.fps,
        "frames": finished.frames,
        "size": finished.size,
        "start": start_frame(job),
        "rate": round(finished.rate, 2),
        "camera": _camera(finished.track),
        "facing": finished.track.view.side,
        "seconds_per_frame": finished.seconds | {"write": round(write, 5)},
        "warnings": finished.warnings,
    } | ({"job": key} if key else {})
    (folder / "run.json").write_text(json.dumps(news, indent=2) + "\n", encoding="utf-8")
    return told


def write_overlay(finished: Run, path: Path, progress: Progress) -> None:
    """The clip with the figure drawn on every frame, from time 0 on."""
    job = finished.job
    video = Video(job.video)
    scale = enlargement(video.height)
    size = (video.width * scale, video.height * scale)
    drawing = progress.task(f"{job.video.name} overlay", finished.frames)
    with drawing as advance, Writer(path, finished.fps, size) as writer:
        for frame, moment in zip(islice(video, finished.frames), finished.track.times, strict=True):
            writer.write(paint(frame.image, finished.track, frame.index, f"{job.model}  "), float(moment))
            advance()


def _start(job: Job, video: Video, settings: Settings) -> Start:
    """The start pose; which way it faces is seen from the film where its marks and the job do not tell it."""
    frame, size = start_frame(job), (video.width, video.height)
    start = marked_start(job.marks, frame, job.facing, size)
    if job.facing is None and footless(start) and settings.templates:
        images = (each.image for each in islice(video, frame, frame + FRAMES))
        start = marked_start(job.marks, frame, heading(images, start, video.fps, settings), size)
    return start


def start_frame(job: Job) -> int:
    """The marked frame to start from; StartError if `start` is not marked."""
    if job.start is None:
        return min(job.marks)
    if job.start not in job.marks:
        marked = ", ".join(str(frame) for frame in sorted(job.marks)[:8])
        raise StartError(f"frame {job.start} is not marked in the keypoints table; marked are {marked}")
    return job.start


def _passage(plan: Plan, way: int) -> Passage:
    """The way ahead (+1) or back (-1) through the clip."""
    here, other = (plan.tracker, lambda: plan.back) if way > 0 else (plan.back, lambda: plan.tracker)
    frame = start_frame(plan.job)
    marks = plan.job.marks if plan.job.anchors else {frame: plan.job.marks[frame]}
    anchors = {t: Anchor.of(plan.start.figure, marked) for t, marked in marks.items()}
    smooth = smoothed if plan.job.smooth else _as_they_are
    detections = {} if plan.measured is None else plan.measured.frames
    return Passage(here, other, anchors, way, plan.reel.span, smooth, detections)


def _followed(
    plan: Plan,
    passage: Passage,
    marked: Image,
    images: Iterable[Image],
    clock: Clock,
    advance: Callable[[], None],
    belief: Belief | None = None,
) -> tuple[list[Estimate], Belief | None]:
    """Estimates from the start frame on, and the belief there from which to go the other way.

    Args:
        marked: the start frame's picture.
        images: those after it, in the passage's way.
        belief: to begin with, None for what the marks say.
    """
    tracker, frame = passage.tracker, start_frame(plan.job)
    state, estimate = tracker.begin(plan.start, marked, belief)
    if state.templates.strange.any() and state.backdrop is not None:
        state, estimate = tracker.begin(plan.start, marked, belief, plan.scene)
    run = clock.timed("track", passage.run(frame, state, estimate, images))
    found: list[Estimate] = []
    turned = None
    for estimate in clock.timed("smooth", passage.smooth(tracker, run)):
        if len(found) == 1 and plan.job.smooth and estimate.outcome.measured:
            turned = turned_belief(tracker.slds, state.belief, estimate.belief)
        found.append(estimate.light())
        advance()
    return passage.joined(found, frame), turned


def _as_they_are(_: Tracker, estimates: Iterable[Estimate]) -> Iterable[Estimate]:
    return estimates


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
        shift=np.stack([estimate.shift for estimate in estimates]),
        mark=plan.tracker.settings.mark,
    )


def _chapter(finished: Run, overlay: Path) -> Chapter:
    job = finished.job
    return Chapter(
        name=job.model,
        video=job.video.name,
        overlay=overlay,
        track=finished.track,
        frames=finished.frames,
        fps=finished.fps,
        rate=finished.rate,
        given=job.rate is not None,
        # A speed that was only found would pull every walker towards the model's own.
        gait=gait_of(finished.track, 1.0 if job.rate is None else job.rate),
        warnings=finished.warnings,
    )


def _camera(track: Track) -> dict[str, bool | float]:
    """Whether the camera moved, and how far from the start at most, pixels."""
    farthest = float(np.hypot(*track.shift.T).max())
    return {"moves": farthest > 0.0, "pixels": round(farthest, 1)}


def _rate(plan: Plan, track: Track) -> float:
    if plan.job.rate is not None:
        return plan.job.rate
    poses = track.q[:, : len(POSE_COLUMNS)].copy()
    poses[~track.measured] = np.nan
    return playback_rate(plan.job.model, poses, plan.video.fps)


def _warnings(plan: Plan, track: Track, points: Judged | None) -> list[str]:
    warnings = [plan.video.cut_short] if plan.video.cut_short else []
    if plan.job.facing is None and footless(plan.start):
        side = track.view.side
        warnings.append(f"no foot was marked: the figure is taken to face {side}, --facing tells otherwise")
    lost = [t for t, outcome in enumerate(track.outcome) if outcome is Outcome.LOST]
    if lost:
        warnings.append(f"nothing matched in {len(lost)} of {len(track)} frames, first in frame {lost[0]}")
    if points is not None and 2 * points.frames < len(track):
        warnings.append(f"{points.file} has points in {points.frames} of {len(track)} frames")
    return warnings


def _total(plan: Plan) -> int | None:
    """About how many frames there are to track."""
    counts = [plan.video.count_hint, None if plan.job.stop is None else plan.job.stop + 1]
    return min((count for count in counts if count is not None), default=None)
