"""The joints of a figure's outline in every frame: the film surveyed, the outline fitted, then followed."""

from dataclasses import replace

from kinematics.figure_file import load_figure
from kinematics.recover import Start
from tracker.clip.part import Ends, Part, Pose, part_around
from tracker.clip.plan import Plan, Seen
from tracker.clip.staged import POINT, detections
from tracker.clip.start import marked_start
from tracker.loop.tracker import make_tracker
from tracker.models.find import CONSTANT_VELOCITY, for_seen
from tracker.outline.fit import Outline
from tracker.outline.person import seen_figure
from tracker.progress import Progress

REACH = 600  # surveyed frames before and after the marked one in the first part of the film
SHARED = 60  # surveyed frames that two neighbouring parts have in common
EXCHANGE = 0.01  # least probability of an outline with exchanged legs
MOST = 0.49  # largest probability of an outline with exchanged legs
ONE_LEG = 0.002  # probability that an outline has both legs of a frame in one place
DOUBTED = 0.25  # probability of wrongly named legs in the start marks above which a warning says so
USUAL = 0.7  # weight of people's usual lengths in the fitted figure; the rest is for the marked lengths


def outlined(plan: Plan, seen: Seen) -> Plan:
    """The plan with what was seen of the figure's outline; without its joints with the film's cuts alone.

    Of the gait only a label of the model is kept, and of a misnaming only one that a warning must tell.
    """
    if not seen.points:
        return replace(plan, seen=replace(plan.seen, shot=seen.shot))
    exchange = min(max(seen.wrong, EXCHANGE), MOST)
    settings = plan.tracker.settings.model_copy(
        update={"point": POINT, "exchange": exchange, "one_leg": ONE_LEG}
    )
    slds = plan.slds if plan.job.model == CONSTANT_VELOCITY else for_seen(plan.slds)
    seen = replace(
        seen,
        gait=seen.gait if seen.gait in plan.slds.labels else "",
        misnamed=seen.misnamed if seen.misnamed > DOUBTED and plan.job.names_legs else 0.0,
    )
    return replace(plan, slds=slds, seen=seen, tracker=make_tracker(plan.start, slds, settings))


def look(plan: Plan, progress: Progress) -> Seen:
    """Fit the figure's outline to the film; the result does not depend on the motion model.

    It is empty if points are given, the settings disable outlines or the figure has none, and holds only the
    film's cuts if the figure does not stand out from a known scene.
    """
    settings = plan.tracker.settings
    wanted = plan.start.figure.outline and settings.outline and settings.templates and settings.mode == "full"
    if not wanted or plan.measured is not None:
        return Seen({})
    shot, part = _part(plan, (plan.frame, _shown(plan)), (REACH, REACH), progress)
    if part is None:
        return Seen({}, shot=shot)
    seen = as_seen(part.outline, part.first, plan)
    seen = replace(seen, places=part.places, lights=part.lights, shot=shot)
    seen = _beyond(seen, part.after, 1, plan, progress)
    return _beyond(seen, part.before, -1, plan, progress)


def as_seen(outline: Outline, first: int, plan: Plan) -> Seen:
    """An outline, whose first row is of frame `first`, in terms of the figure that is followed."""
    figure = plan.start.figure
    shown, points = load_figure(figure.outline), detections(outline, first, plan.video)
    named = {t: found.named(shown, figure) for t, found in points.items()}
    return Seen(named, outline.wrong, outline.gait, outline.misnamed)


def _part(
    plan: Plan, pose: Pose, around: tuple[int, int], progress: Progress, named: bool = False
) -> tuple[Ends, Part | None]:
    return part_around(plan.video, pose, around, (plan.job.first, plan.job.stop), progress, named)


def _beyond(seen: Seen, onward: Pose | None, way: int, plan: Plan, progress: Progress) -> Seen:
    """What is seen, with the parts of the film beyond, as far as the figure is seen in them.

    Args:
        onward: from which the next part starts, None for no part.
        way: +1 for later parts, -1 for earlier ones.
    """
    points, places, lights = dict(seen.points), dict(seen.places), dict(seen.lights)
    wrong, far, (begins, ends) = seen.wrong, 2 * REACH - SHARED, seen.shot
    while onward is not None:
        shot, part = _part(plan, onward, (SHARED, far) if way > 0 else (far, SHARED), progress, named=True)
        if part is None:
            break
        wrong = max(wrong, part.outline.wrong)
        for t, found in as_seen(part.outline, part.first, plan).points.items():
            points.setdefault(t, found)
        for t, place in part.places.items() if onward[0] in places else ():
            places.setdefault(t, places[onward[0]] @ place)
        for t, light in part.lights.items():
            lights.setdefault(t, lights[onward[0]] * light)
        begins, ends = (begins, shot[1]) if way > 0 else (shot[0], ends)
        onward = part.after if way > 0 else part.before
    return replace(seen, points=points, places=places, lights=lights, wrong=wrong, shot=(begins, ends))


def _shown(plan: Plan) -> Start:
    """The start pose in terms of the figure whose outline is fitted."""
    start, shown = plan.start, load_figure(plan.start.figure.outline)
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
