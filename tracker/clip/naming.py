"""The naming of a found figure's legs: the start that it gives, and whether templates and film confirm it.

The nearer leg hides the other. With the names exchanged templates are cut from the wrong leg and laid the
wrong way round where legs pass, so that they fit worse. The mean difference of fit in the frames around the
start, in standard errors, is added to the evidence of `tracker.outline.near` and `tracker.outline.swing`.
"""

from collections.abc import Iterable
from dataclasses import replace
from itertools import islice

import numpy as np

from kinematics.figure import Array, Figure
from kinematics.sides import other_side
from tracker.clip.job import Following, Found, Job, Nearer
from tracker.clip.outlines import DOUBTED, as_seen, outlined
from tracker.clip.pictures import Reel
from tracker.clip.plan import Plan, prepare
from tracker.loop.begin import begin
from tracker.models.find import CONSTANT_VELOCITY
from tracker.often import often
from tracker.outline.doubt import in_standard_errors
from tracker.outline.person import Person
from tracker.picture.pyramid import Image
from tracker.settings import Settings
from tracker.tables.keypoints import Mark
from videos.frames import Video

SURE = 0.95  # probability of the nearer leg from which it counts as sure
AROUND = 2.0 / 3.0  # seconds before and after the start in which templates are laid
TOGETHER = 10.0  # number of neighbouring frames with correlated errors, at 30 a second
FITTING = 1.0  # log odds for a standard error; half of NEARER, as the pose in the start frame may be wrong
FEW = Settings(hypotheses=3)  # few hypotheses suffice for so short a time


def sure_of_leg(one: Person) -> bool:
    """Whether the leg named near is the nearer one with enough certainty."""
    return 1.0 - one.outline.wrong >= SURE


def nearer(one: Person) -> Nearer:
    """Whether the leg named near is ahead or behind in the start frame."""
    near, far = (one.joints[one.figure.joints.index(name), 0] for name in ("near_ankle", "far_ankle"))
    return Nearer.of(one.facing * (near - far))


def marks_of(one: Person) -> dict[str, Mark]:
    """The person's joints in the start frame, as marks."""
    return marked(one.figure, one.joints)


def marked(figure: Figure, joints: Array) -> dict[str, Mark]:
    """The joints (J, 2) of a figure, pixels, as marks."""
    return {name: Mark(x, y) for name, (x, y) in zip(figure.joints, joints.round(2).tolist(), strict=True)}


def start_from(one: Person, told: str, against: bool = False) -> Found:
    """The start from a person; `told` says whether the near leg is "sure", "unsure" or "given", `against`
    whether the film tells the other facing."""
    return Found(one.frame, marks_of(one), one.facing, nearer(one), told, against)


def as_the_film_names(job: Job, misnamed: float) -> Job:
    """The job, with the legs of a found start named as its outline in the whole film tells.

    Where that contradicts the pose of the start frame, the nearer leg counts as unsure. A job with corrected
    frames stays, as these name the legs. `misnamed` is the probability that the start names them wrongly.
    """
    found = job.found
    if found is None or job.names_legs or job.anchors or misnamed <= DOUBTED:
        return job
    found = replace(found, near_leg="unsure")
    if misnamed > 0.5:
        marks = {other_side(name): mark for name, mark in found.marks.items()}
        found = replace(found, marks=marks, nearer=found.nearer.other)
    return replace(job, found=found, marks={found.frame: dict(found.marks)})


def borne_out(one: Person, video: Video) -> Person:
    """The person with the legs named as templates fit better, and with the certainty that they give."""
    ours, others = _misfits(one, video).T
    told = in_standard_errors(others - ours, TOGETHER * often(video.fps))
    named = one.outline.named + FITTING * told
    heard = replace(one, outline=replace(one.outline, named=named))
    return heard if named >= 0.0 else heard.exchanged


def _misfits(one: Person, video: Video) -> Array:
    """(n, 2) misfit of templates in frames around the start, with legs named as found and exchanged."""
    plans = [_as_if_sure(each, video) for each in (one, one.exchanged)]
    around = round(AROUND * video.fps)
    first = max(one.frame - around, one.first)
    reel = Reel(video, min(one.frame + around, one.last))
    images = reel.ahead()
    marked = next(islice(images, one.frame, None))
    found = _one_way(plans, 1, marked, images)
    if one.frame > first:
        found += _one_way(plans, -1, marked, reel.span(one.frame - 1, first))
    return np.array(found).reshape(-1, 2)


def _as_if_sure(one: Person, video: Video) -> Plan:
    """The plan to follow a person whose legs count as named correctly."""
    start = start_from(one, "unsure")
    try:
        plan = prepare(Following(rate=video.rate).job(video.path, start, FEW))
    except ValueError:  # the learned model cannot be had at this frame rate
        plan = prepare(Following(model=CONSTANT_VELOCITY, rate=video.rate).job(video.path, start, FEW))
    return outlined(plan, replace(as_seen(one.outline, one.first, plan), wrong=0.0))


def _one_way(plans: list[Plan], way: int, start: Image, images: Iterable[Image]) -> list[list[float]]:
    """The misfits of both plans in every picture after the start, or before it."""
    trackers = [plan.tracker if way > 0 else plan.back for plan in plans]
    states = [begin(tracker, plan.start, start)[0] for tracker, plan in zip(trackers, plans, strict=True)]
    found = []
    for t, image in enumerate(images, 1):
        frame = plans[0].frame + way * t
        steps = [
            tracker.step(state, image, plan.seen.points.get(frame))
            for tracker, state, plan in zip(trackers, states, plans, strict=True)
        ]
        states = [state for state, _ in steps]
        found.append([estimate.misfit for _, estimate in steps])
    return found
