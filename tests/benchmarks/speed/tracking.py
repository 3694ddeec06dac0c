"""What a tracked frame costs, by stage, beside the Lucas-Kanade rival; and how its cost grows.

CPU time of one thread; a run is repeated and the best kept, as another program only ever adds to it. Everyone
decodes the same clip, from the same marks.
"""

import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from unittest.mock import patch

import cv2
import numpy as np

from dynamics.gaussian import Gaussian
from tests.benchmarks.evaluation.cases import QUIET, marks_of
from tests.benchmarks.rivals import lucas_kanade
from tests.benchmarks.rivals.body import body_at
from tests.benchmarks.speed.measure import cpu
from tracker.clip import follow as clip
from tracker.clip import outlines, part
from tracker.clip.follow import follow
from tracker.clip.job import Job
from tracker.clip.plan import prepare
from tracker.loop import smoothing
from tracker.loop import tracker as track
from tracker.loop.begin import begin
from tracker.picture.backdrop import Backdrop
from tracker.picture.camera import Camera
from tracker.registration import objective
from tracker.registration.align import align
from tracker.registration.field import Field
from tracker.registration.objective import Objective
from tracker.settings import Settings
from videos.frames import Video

MODEL = "walk-run"  # two learned states and a free one
REPEATS = 3
HYPOTHESES = (1, 2, 4, 8)
SPACINGS = (0.044, 0.031, 0.022, 0.0156)  # leg lengths; 0.022 is the default

# Where a stage's work is done: what is inside another's counts for the inner one.
STAGES = {
    "survey": (part, "surveyed"),
    "outline": (outlines, "look"),
    "pyramid": (track, "pyramid"),
    "camera": (Camera, "follow"),
    "background": (Backdrop, "follow"),
    "points of the outline": (track.Tracker, "detected"),
    "registration": (track, "align"),
    "kernel": (objective, "lay"),
    "propose": (track, "propose"),
    "fuse": (track.Tracker, "conditioned"),
    "templates": (track.Tracker, "_templates"),
    "smooth": (smoothing, "_back"),
    "playback speed": (clip, "playback_rate"),
}


@dataclass(frozen=True)
class Cost:
    """Milliseconds of CPU time a frame.

    stages  : of a whole run, by stage
    whole   : of a whole run
    tracked : of one without survey and outline
    rival   : of Lucas-Kanade
    """

    stages: dict[str, float]
    whole: float
    tracked: float
    rival: float


@dataclass(frozen=True)
class Growth:
    """Milliseconds of registration a frame at each size, and the straight line through them."""

    sizes: tuple[float, ...]
    milliseconds: tuple[float, ...]

    @property
    def line(self):
        """Slope and intercept."""
        return tuple(float(x) for x in np.polyfit(self.sizes, self.milliseconds, 1))

    @property
    def astray(self):
        """How far the farthest is from the line, as a share of the greatest cost."""
        apart = np.subtract(np.polyval(self.line, self.sizes), self.milliseconds)
        return float(np.abs(apart).max() / max(self.milliseconds))


def job_of(video: Path) -> Job:
    """A clip with its marks beside it."""
    return Job(video, marks_of(video), model=MODEL, start=0)


def cost(job: Job) -> Cost:
    """Runs without pictures, the rival's beside them, turn by turn."""
    cv2.setNumThreads(1)
    frames = sum(1 for _ in Video(job.video))
    alone = replace(job, settings=Settings(outline=False))
    contenders = (
        lambda: follow(job, QUIET),
        lambda: follow(alone, QUIET),
        lambda: _flow(job),
    )
    for run in contenders:
        run()  # the kernel is compiled, libraries load
    spent = np.array([[cpu(run) for run in contenders] for _ in range(REPEATS)])
    per_frame = 1e3 / frames
    whole, tracked, rival = (float(each) for each in per_frame * spent.min(0))
    least = min((_stages(job) for _ in range(REPEATS)), key=lambda run: sum(run.values()))
    stages = {name: per_frame * seconds for name, seconds in least.items()}
    return Cost({**stages, "anything else": whole - sum(stages.values())}, whole, tracked, rival)


def by_hypotheses(job: Job) -> Growth:
    """Registration of so many priors side by side."""
    field, prior = _field(job, Settings())
    times = []
    for H in HYPOTHESES:
        priors = Gaussian(np.repeat(prior.mean, H, 0), np.repeat(prior.cov, H, 0))
        # Each climbs from elsewhere, or all would end at the same step.
        priors.mean[:, 3:7] += 0.05 * np.random.default_rng(1).normal(size=(max(HYPOTHESES), 4))[:H]
        times.append(_best(lambda priors=priors: align(field, priors)))
    return Growth(HYPOTHESES, tuple(times))


def by_points(job: Job) -> Growth:
    """One laying of the templates on every blur at 4 poses, by the number of template points."""
    sizes, times = [], []
    for spacing in SPACINGS:
        field, prior = _field(job, Settings(spacing=spacing))
        levels = [Objective(field, n) for n in range(len(field.levels))]
        q = np.repeat(prior.mean, 4, 0)
        sizes.append(len(field.templates.link))
        times.append(_best(lambda q=q, levels=levels: [level.compare(q) for level in levels]))
    return Growth(tuple(sizes), tuple(times))


def draw(hypotheses: Growth, points: Growth, path: Path) -> None:
    """Both growths with their lines."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 3.4), layout="constrained")
    panels = figure.subplots(1, 2)
    for axes, growth, name, what in (
        (panels[0], hypotheses, "hypotheses", "one registration, all blurs"),
        (panels[1], points, "template points", "templates laid once on each of three blurs"),
    ):
        slope, intercept = growth.line
        ends = np.array([0.0, 1.05 * max(growth.sizes)])
        axes.plot(ends, intercept + slope * ends, color="0.6", label=f"{intercept:.2f} + {slope:.2g} n")
        axes.plot(growth.sizes, growth.milliseconds, "o", color="tab:blue", label="measured, best of several")
        axes.set(xlabel=name, ylabel="milliseconds", title=what, xlim=(0, None), ylim=(0, None))
        axes.legend(frameon=False, loc="upper left")
        axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=120)


def _field(job: Job, settings: Settings) -> tuple[Field, Gaussian]:
    """What frame 1 offers to be compared with, and one prior for it."""
    plan = prepare(replace(job, settings=settings))
    tracker, images = plan.tracker, [frame.image for frame in islice(Video(job.video), 2)]
    state, _ = begin(tracker, plan.start, images[0])
    priors = tracker.pose(state.belief.states)[:1]
    state = tracker.with_scene(state, images[1], priors)
    levels = tracker._levels(images[1], state.curve, tracker.box(priors.mean))
    return Field(state.templates, levels, plan.start.figure, tracker.view, settings, state.scenery), priors


def _flow(job: Job) -> int:
    plan = prepare(job)
    body = body_at(plan.start, job.marks[0])
    return sum(1 for _ in lucas_kanade.follow((frame.image for frame in plan.video), body))


def _stages(job: Job) -> dict[str, float]:
    """Seconds of CPU time in each stage of one run."""
    spent = dict.fromkeys(STAGES, 0.0)
    with ExitStack() as stack:
        for name, (home, function) in STAGES.items():
            stack.enter_context(_watched(spent, name, home, function))
        follow(job, QUIET)
    return spent


@contextmanager
def _watched(spent: dict[str, float], name: str, home: object, function: str) -> Iterator[None]:
    plain = getattr(home, function)

    def timed(*args, **kwargs):
        began, inside = time.process_time(), sum(spent.values())
        result = plain(*args, **kwargs)
        spent[name] += time.process_time() - began - (sum(spent.values()) - inside)
        return result

    with patch.object(home, function, timed):
        yield


def _best(run) -> float:
    """Milliseconds of the best of many."""
    run()
    return 1e3 * min(cpu(run) for _ in range(15))
