"""The joints of a figure's outline in every frame: the film surveyed, the outline fitted, then followed."""

from dataclasses import replace

import numpy as np

from kinematics.figure import Figure
from kinematics.figure_file import load_figure
from kinematics.recover import Start
from tracker.clip.plan import Plan, Seen
from tracker.clip.staged import POINT, detections, every, surveyed
from tracker.clip.start import marked_start
from tracker.loop.tracker import make_tracker
from tracker.models.find import CONSTANT_VELOCITY, for_seen
from tracker.outline.bodies import paths
from tracker.outline.cycles import Cycles
from tracker.outline.fit import fitted
from tracker.outline.others import path_of, without_others
from tracker.outline.person import seen_figure
from tracker.outline.pieces import joined
from tracker.outline.shape import Shape
from tracker.outline.smooth import finer
from tracker.outline.stage import Stage
from tracker.progress import Progress
from tracker.survey.evidence import SOME_GREY

REACH = 600  # surveyed frames before and after the marked one, which bounds memory
LEG = 40.0  # largest length of a leg in the small pictures, pixels
EXCHANGE = 0.01  # least probability of an outline with exchanged legs
MOST = 0.49  # largest probability of an outline with exchanged legs
ONE_LEG = 0.002  # probability that an outline has both legs of a frame in one place
DOUBTED = 0.25  # probability of wrongly named legs in the start marks above which a warning says so
USUAL = 0.7  # weight of people's usual lengths in the fitted figure; the rest is for the marked lengths


def outlined(plan: Plan, seen: Seen) -> Plan:
    """The plan with the joints of the figure's outline as points; unchanged if no outline was seen."""
    if not seen.points:
        return plan
    exchange = min(max(seen.wrong, EXCHANGE), MOST)
    settings = plan.tracker.settings.model_copy(
        update={"point": POINT, "exchange": exchange, "one_leg": ONE_LEG}
    )
    slds = plan.slds if plan.job.model == CONSTANT_VELOCITY else for_seen(plan.slds)
    return replace(
        plan,
        slds=slds,
        points=seen.points,
        places=seen.places,
        gait=seen.gait if seen.gait in plan.slds.labels else "",
        misnamed=seen.misnamed if seen.misnamed > DOUBTED else 0.0,
        tracker=make_tracker(plan.start, slds, settings),
    )


def look(plan: Plan, progress: Progress) -> Seen:
    """Fit the figure's outline to the film; the result does not depend on the motion model.

    It is empty if points are given, the settings disable outlines, the figure has none, or it does not stand
    out from a known scene.
    """
    settings = plan.tracker.settings
    wanted = plan.start.figure.outline and settings.outline and settings.templates and settings.mode == "full"
    if not wanted or plan.measured is not None:
        return Seen({})
    figure, shown = plan.start.figure, load_figure(plan.start.figure.outline)
    if found := plan.job.found:
        return Seen({t: of.named(shown, figure) for t, of in found.points.items()}, gait=found.gait)
    video, start, frame, stop = plan.video, _shown(plan, shown), plan.frame, plan.job.stop
    step = every(video)
    before = min(REACH, (frame - plan.job.first) // step)
    first, last = frame - before * step, frame + REACH * step
    last = last if stop is None else min(last, stop)
    film = surveyed(video, first, last, start.view.unit / LEG, progress)
    if film is None or before >= len(film.survey.places):
        return Seen({})
    # A marked person is certainly there, so what is as dark as a shadow may be clothes.
    cycles, stage = Cycles.load(), film.stage(start.view.facing, SOME_GREY)
    del film  # frees its small pictures
    stage = _alone(stage, start, before, cycles)
    outline = fitted(stage, start, before, cycles).finer(step)
    points = {t: of.named(shown, figure) for t, of in detections(outline, first, video).items()}
    to_start = np.linalg.inv(stage.places[before])
    places = {t: to_start @ place for t, place in enumerate(finer(stage.places, step), first)}
    return Seen(points, outline.wrong, outline.gait, outline.misnamed, places)


def _shown(plan: Plan, shown: Figure) -> Start:
    """The start pose in terms of the figure whose outline is fitted."""
    start = plan.start
    if start.figure.joints != shown.joints:
        marks = plan.job.marks[plan.frame]
        own = {name: mark for name, mark in marks.items() if name in shown.marks}
        size = (plan.video.width, plan.video.height)
        start = marked_start({plan.frame: own}, plan.frame, start.view.facing, size, shown)
    # A length from two marks is no more exact than people's usual length.
    figure, usual = start.figure, {link.name: link.length for link in seen_figure().links}
    lengths = [
        (1.0 - USUAL) * link.length + USUAL * usual.get(link.name, link.length) for link in figure.links
    ]
    return replace(start, figure=figure.with_lengths(lengths))


def _alone(stage: Stage, start: Start, frame: int, cycles: Cycles) -> Stage:
    """The film with the places of other people set to unknown, if there are any."""
    hip, unit = np.asarray(start.view.origin), start.view.unit
    everybody = joined(stage, paths(stage, Shape.of(start.figure), cycles, unit))
    own = path_of(stage, hip, unit, frame, everybody)
    return stage if own is None else without_others(stage, own, everybody)
