"""One clip followed: from a job to a run."""

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from dynamics.belief import Belief
from dynamics.gaussian import Array
from kinematics.direction import turning
from tracker.clip.again import Kept
from tracker.clip.agreement import agreed
from tracker.clip.clock import Clock
from tracker.clip.job import Job
from tracker.clip.measure import Judged
from tracker.clip.pictures import Reel
from tracker.clip.plan import Plan, Seen, facing_unknown, prepare
from tracker.clip.playback import motions_at, playback_rate
from tracker.clip.start import StartError
from tracker.compiled import tell_unkept
from tracker.loop.anchors import Anchor
from tracker.loop.begin import begin
from tracker.loop.both_ways import Passage, prolong
from tracker.loop.estimate import Estimate
from tracker.loop.outcome import Outcome, in_time
from tracker.loop.smoothing import smoothed, turned_belief
from tracker.loop.trail import Trail
from tracker.progress import Progress
from tracker.run.track import FREE, Track
from tracker.settings import Settings
from tracker.tables.keypoints import hidden, points
from videos.frames import count_to
from videos.upright import Image


@dataclass(frozen=True)
class Run:
    """A finished run: the track and its report data.

    start    : start frame
    settings : as used: the job's, with values that were given or measured for this clip
    frames   : how many frames were read
    size     : (width, height) of each, pixels
    rate     : playback speed, as given or as `tracker.clip.playback` finds it
    seconds  : spent on each frame, by stage
    points   : the judgement of the points of `Job.measure`
    mended   : number of damaged pictures that the decoder repaired
    """

    job: Job
    start: int
    settings: Settings
    track: Track
    fps: float
    frames: int
    size: tuple[int, int]
    rate: float
    seconds: dict[str, float]
    warnings: list[str]
    points: Judged | None = None
    mended: int = 0


def follow(job: Job, progress: Progress, kept: Kept | None = None, seen: Seen | None = None) -> Run:
    """Track the clip forwards from the start frame, and backwards from it to the first frame asked for.

    Args:
        kept: part of an earlier track to keep; ignored if its figure differs.
        seen: the outline of this job, which does not depend on the model; None to survey the film.

    Raises:
        VideoError, ModelError, StartError, PoseError, ValueError: as `prepare`, or the clip ends too early.
    """
    plan, clock = prepare(job), Clock()
    tell_unkept(progress)
    if kept is not None and not kept.fits(plan.start, plan.slds.labels):
        kept = None
    with clock.stage("survey"):
        from tracker.clip.naming import as_the_film_names  # slow to import
        from tracker.clip.outlines import look, outlined

        seen = look(plan, progress) if seen is None else seen
        if (named := as_the_film_names(job, seen.misnamed)) is not job:
            job, plan = named, prepare(named)
        plan = outlined(plan, seen)
    span = _in_shot(plan, (job.first, job.stop) if kept is None else kept.span)
    track = agreed(plan, _track(plan, span[0], *_followed(plan, span, clock, progress)))
    if kept is not None:
        track = kept.joined(track)
    rate = job.rate or 1.0
    if job.rate is None and not plan.beside:
        rate = playback_rate(job.model, _tracked(track), plan.video.fps, track.figure)
    track = replace(track, motions=motions_of(plan, track, rate), outcome=in_time(track.outcome))
    judged = None if plan.measured is None else plan.measured.judged(track, plan.tracker.settings)
    return Run(
        job=job,
        start=plan.frame,
        settings=plan.tracker.settings,
        track=track,
        fps=plan.video.played,
        frames=track.first + len(track),
        size=(plan.video.width, plan.video.height),
        rate=rate,
        seconds=clock.per_frame(len(track)),
        warnings=_warnings(plan, track, judged),
        points=judged,
        mended=plan.video.mended,
    )


def _in_shot(plan: Plan, span: tuple[int, int | None]) -> tuple[int, int | None]:
    """As much of a span, its first and last frame, None for the film's last, as shows the figure's scene."""
    (first, last), (begins, ends) = span, plan.seen.shot
    return max(first, begins or 0), ends if last is None else min(last, last if ends is None else ends)


def _followed(
    plan: Plan, span: tuple[int, int | None], clock: Clock, progress: Progress
) -> tuple[list[float], Trail]:
    """Times of the job's frames, and estimates of the span's: from a frame to another, None for the last."""
    job, frame, (first, last) = plan.job, plan.frame, span
    reel = Reel(plan.video, job.stop, lights=plan.seen.lights)
    end, images = count_to(plan.video, last), reel.ahead()
    foreseen = None if end is None else max(end - first, 0)
    with progress.task(f"{job.video.name} with {job.model}", foreseen) as advance:
        marked = next(islice(clock.timed("read", images), frame, None), None)
        if marked is None:
            raise StartError(
                f"frame {frame} is not in {job.video.name}, which has {len(reel.times)}; mark another frame"
            )
        ways = _Ways(plan, reel, marked, clock, advance)
        trail, belief = Trail(len(plan.start.q), foreseen or 0), None
        if frame > first:
            belief = ways.follow(trail, -1, reel.span(frame - 1, first))
            trail.reverse()
            trail.pop(1)  # the start frame, which the forward pass contains as well
        ways.follow(trail, 1, images if last is None else islice(images, last - frame), belief)
    deque(clock.timed("read", images), 0)  # the video's notes are of all frames, not of the span's alone
    return reel.times, trail


@dataclass(frozen=True)
class _Ways:
    """The forward and the backward pass through a clip from its start frame.

    marked  : the start frame's picture
    advance : to be called once a frame
    """

    plan: Plan
    reel: Reel
    marked: Image
    clock: Clock
    advance: Callable[[], None]

    def follow(
        self, trail: Trail, way: int, images: Iterable[Image], belief: Belief | None = None
    ) -> Belief | None:
        """Append the estimates from the start frame on; returns the start belief for the other direction.

        Args:
            way: +1 forwards, -1 backwards.
            images: of the frames that follow the start in this direction.
            belief: at the start, None for that of the marks.
        """
        plan, passage = self.plan, self._passage(way)
        tracker = passage.tracker
        state, estimate = begin(tracker, plan.start, self.marked, belief)
        run = passage.run(plan.frame, state, estimate, self.marked, self.clock.timed("read", images))
        tracked = self._counted(way, self.clock.timed("track", run))
        turned, moved = None, 0
        for estimate in self.clock.timed("smooth", passage.smooth(tracker, tracked)):
            moved += not estimate.repeats
            second = moved == 2 and not estimate.repeats
            if second and plan.job.smooth and estimate.outcome.measured and not estimate.began:
                turned = turned_belief(tracker.slds, state.belief, estimate.belief)
            prolong(tracker, trail, estimate)
        return turned

    def _counted(self, way: int, run: Iterable[Estimate]) -> Iterator[Estimate]:
        for t, estimate in enumerate(run):
            if way > 0 or t > 0:  # both passes begin with the start frame
                self.advance()
            yield estimate

    def _passage(self, way: int) -> Passage:
        plan = self.plan
        here, other = (plan.tracker, lambda: plan.back) if way > 0 else (plan.back, lambda: plan.tracker)
        marks, figure = plan.job.passed(plan.frame), plan.start.figure
        anchors = {t: Anchor.of(figure, points(each), hidden(each)) for t, each in marks.items()}
        smooth = smoothed if plan.job.smooth else lambda _, estimates: estimates  # as first known
        return Passage(here, other, anchors, way, self.reel.span, smooth, plan.seen.points, plan.seen.places)


def _track(plan: Plan, first: int, times: Sequence[float], trail: Trail) -> Track:
    return Track(
        figure=plan.start.figure,
        view=plan.start.view,
        model=plan.job.model,
        labels=plan.slds.labels,
        first=first,
        times=np.array(times[first : first + len(trail)]) - times[0],
        q=trail.column("mean"),
        cov=trail.column("cov"),
        s=trail.column("s"),
        motions=(),  # found from the whole track, see `motions_of`
        outcome=tuple(trail.outcome),
        moved=trail.column("moved"),
        mark=plan.tracker.settings.mark,
        misnamed=plan.seen.misnamed,
        before=tuple(time - times[0] for time in times[:first]),
    )


def motions_of(plan: Plan, track: Track, rate: float) -> tuple[str, ...]:
    """The motion of each frame, judged by the whole clip; "free" where neither model nor outline knows it."""
    own = tuple(track.labels[k] for k in track.s)
    if len(set(track.labels)) == 1 or not track.measured.any():
        return own
    whole = motions_at(plan.job.model, _tracked(track), plan.video.played / rate, track.figure)
    return tuple(
        FREE if state == FREE and not plan.seen.gait else motion
        for state, motion in zip(own, whole, strict=True)
    )


def _tracked(track: Track) -> Array:
    """(T, M) root and angles; NaN where the figure was lost."""
    poses = track.q[:, : len(track.figure.learned_freedoms)].copy()
    poses[~track.measured] = np.nan
    return poses


def _warnings(plan: Plan, track: Track, points: Judged | None) -> list[str]:
    warnings = plan.video.notes
    if plan.beside:
        warnings.append(
            f"the marks of frame {plan.frame} lie {plan.beside:.1f} leg lengths from the figure in the film; "
            "check them"
        )
    if plan.video.untimed is not None and plan.job.rate is None:
        warnings.append(plan.video.untimed)
    if facing_unknown(plan.job, track.figure):
        side = track.view.side
        warnings.append(
            f"the marks do not show which way the figure faces; it is taken to face {side}, --facing tells "
            "otherwise"
        )
    if plan.job.found is not None and plan.job.found.against:
        warnings.append(
            f"--facing says {track.view.side}, but in the film the figure seems to face the other way; leave "
            "--facing out unless it is right"
        )
    back = turning(np.where(track.measured, track.q[:, 0], np.nan), track.times)
    if back is not None:
        at = track.first + back
        warnings.append(
            f"at frame {at} the figure goes back where it came from; if it turns round there, follow either "
            f"way by itself: --stop {at} or --from {at}"
        )
    if plan.job.found is not None and plan.job.found.near_leg == "unsure":
        other = plan.job.found.nearer.other
        warnings.append(
            f"it is not sure which leg is the nearer one; if it is the one {other} in frame {plan.frame}, "
            f"give --near {other}"
        )
    if plan.seen.misnamed:
        found = plan.job.found
        mend = "exchange near and far in the marks" if found is None else f"give --near {found.nearer.other}"
        warnings.append(
            f"the leg that is called far looks like the nearer one where they pass; if it is, {mend}"
        )
    begins, ends = plan.seen.shot
    if begins is not None:
        warnings.append(f"up to frame {begins - 1} another scene is shown; what comes later is followed")
    if ends is not None:
        warnings.append(f"from frame {ends + 1} on another scene is shown; what comes before is followed")
    lost = [t for t, outcome in enumerate(track.outcome, track.first) if outcome is Outcome.LOST]
    if lost:
        warnings.append(f"nothing matched in {len(lost)} of {len(track)} frames, first in frame {lost[0]}")
    if points is not None and 2 * points.frames < len(track):
        warnings.append(f"{points.file} has points in {points.frames} of {len(track)} frames")
    return warnings
