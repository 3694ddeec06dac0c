"""A job whose files have all been read and checked before any work."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from dynamics.gaussian import Array
from dynamics.slds import SLDS
from kinematics.figure import Figure
from kinematics.figure_file import load_figure
from kinematics.recover import Start, facing_told
from kinematics.spm import joints
from tracker.clip.job import Job, OptionsError
from tracker.clip.measure import Measured, read_measured
from tracker.clip.start import StartError, marked_start
from tracker.loop.begin import begin
from tracker.loop.detections import Detections
from tracker.loop.tracker import Tracker, make_tracker
from tracker.models.find import CONSTANT_VELOCITY, find_model, seen_backwards
from tracker.picture.pyramid import Image
from tracker.settings import Settings
from tracker.tables.keypoints import points
from videos.frames import Video

STEP = 0.5  # seconds of a step, over which the direction of travel is measured
TRAVEL = 0.1  # least travel in it, leg lengths; who stays in place faces as the start says
BESIDE = 0.4  # least distance of marks that lie beside the figure, leg lengths,
SOON, FASTEST = 0.25, 12.0  # as it is seen so many seconds from them at most, going so many a second at most
FOUND = 0.04  # error of a joint in a start without marks, leg lengths


@dataclass(frozen=True)
class Seen:
    """A figure's outline in the frames of a clip.

    points   : its joints by frame
    wrong    : probability that it names the legs wrongly
    gait     : "walk" or "run", "" if it was not seen
    misnamed : probability that the start marks name the legs wrongly
    places   : by frame, (3, 3) map from its pixels to the start frame's, where the camera's path is known
    lights   : by frame, its light as a share of the start frame's
    shot     : first and last frame of the scene that the figure is in, None for the film's
    """

    points: dict[int, Detections]
    wrong: float = 0.0
    gait: str = ""
    misnamed: float = 0.0
    places: dict[int, Array] = field(default_factory=dict)
    lights: dict[int, float] = field(default_factory=dict)
    shot: tuple[int | None, int | None] = (None, None)


@dataclass(frozen=True)
class Plan:
    """A job and the contents of its files.

    frame   : start frame
    tracker : runs forwards in time; its settings are the job's with values measured for this clip
    measured: points of another program's file, None for none
    seen    : the outline; its points, or else those of `measured`, measure each frame besides the templates
    """

    job: Job
    frame: int
    video: Video
    start: Start
    slds: SLDS
    tracker: Tracker
    measured: Measured | None
    seen: Seen

    @cached_property
    def beside(self) -> float:
        """How far the marks lie from the figure that the film shows, leg lengths; 0 if about there."""
        near = min(self.seen.points, key=lambda t: abs(t - self.frame), default=None)
        if near is None or self.job.found is not None or self.measured is not None:
            return 0.0
        found, seconds = self.seen.points[near], abs(near - self.frame) / self.video.fps
        marked = self.start.view.to_pixels(joints(self.start.figure, self.start.q))[found.joint]
        off = float(np.median(np.hypot(*(found.pixels - marked).T))) / self.start.view.unit
        return off if seconds < SOON and off > BESIDE + FASTEST * seconds else 0.0

    @cached_property
    def back(self) -> Tracker:
        """The tracker that runs backwards in time."""
        # Constant velocity is the same in both directions; conversion would only change its noise.
        slds = self.slds if self.job.model == CONSTANT_VELOCITY else seen_backwards(self.slds)
        return make_tracker(self.start, slds, self.tracker.settings)


def prepare(job: Job) -> Plan:
    """Read the job's files and check that they fit together, before any work.

    Raises:
        OptionsError: options that do not go together.
        VideoError, ModelError, ForeignError: a file that cannot be used.
        StartError, PoseError: no pose to start from.
        ValueError: a model for another figure or frame rate.
    """
    if job.measure is None and not job.settings.templates:
        raise OptionsError("without templates there is nothing to follow; give --measure FILE")
    if not load_figure(job.figure).outline and (job.height or job.scale):
        raise ValueError("height and scale are for people; leave them out, or follow a walker")
    frame = start_frame(job)
    if job.stop is not None and job.stop < frame:
        raise StartError(f"--stop {job.stop} comes before the start frame {frame}; choose a later --stop")
    video = Video(job.video, job.rate or 1.0)
    settings = job.settings
    if job.found is not None:
        settings = settings.model_copy(update={"mark": max(settings.mark, FOUND)})
    start = _start(job, video, settings)
    slds = find_model(job.model, video.fps, settings, start.figure)
    measured = None if job.measure is None else read_measured(job.measure, start, frame, video.fps, settings)
    if measured is not None:
        settings = settings.model_copy(update={"point": max(settings.point, measured.jitter)})
    seen = Seen({} if measured is None else measured.frames)
    return Plan(job, frame, video, start, slds, make_tracker(start, slds, settings), measured, seen)


def start_frame(job: Job) -> int:
    """The marked start frame; StartError if the one asked for, or all of the followed part, is unmarked."""
    start, first = job.start, job.first
    if start is None:
        within = [frame for frame in job.marks if frame >= first]
        if not within:
            raise StartError(f"no frame from {first} on is marked; choose an earlier --from")
        return min(within)
    if start < first:
        raise StartError(f"--from {first} comes after the start frame {start}; choose an earlier --from")
    if start not in job.marks:
        marked = ", ".join(str(frame) for frame in sorted(job.marks)[:8])
        raise StartError(f"frame {start} is not marked in the keypoints table; marked are {marked}")
    return start


def facing_unknown(job: Job, figure: Figure) -> bool:
    """Whether neither the job nor the marks of its start show which way the figure faces."""
    return job.facing is None and not facing_told(points(job.marks[start_frame(job)]), figure)


def heading(images: Iterable[Image], start: Start, fps: float, settings: Settings) -> int:
    """Direction of travel, +1 right, -1 left; that of the start's facing for a figure that stays in place.

    Args:
        images: RGB, the marked frame first.
        start: the pose there, facing either way.
        fps: frames a second.
    """
    tracker = make_tracker(start, find_model(CONSTANT_VELOCITY, fps, settings, start.figure), settings)
    frames = iter(images)
    first = next(frames, None)
    if first is None:  # the film is too short, which following reports
        return start.view.facing
    state, estimate = begin(tracker, start, first)
    for image in frames:
        state, estimate = tracker.step(state, image)
    backwards = estimate.pose.mean[0] - start.q[0] < -TRAVEL
    return -start.view.facing if backwards else start.view.facing


def _start(job: Job, video: Video, settings: Settings) -> Start:
    """The start pose; the film decides which way it faces if neither the marks nor the job do."""
    frame, size = start_frame(job), (video.width, video.height)
    figure = load_figure(job.figure)
    start = marked_start(job.marks, frame, job.facing, size, figure)
    if facing_unknown(job, figure) and settings.templates:
        images = video.pictures(frame, frame + max(round(STEP * video.fps), 1))
        facing = heading(images, start, video.fps, settings)
        start = marked_start(job.marks, frame, facing, size, figure)
    return start
