"""A gait in a sentence, and what is unusual in it in another, in words for whoever trains the walker."""

from kinematics.sides import SIDES
from tracker.gait.figures import Gait
from tracker.gait.times import STANCE, SWING
from tracker.gait.values import Measure, Value
from tracker.report.chapter import DISCORD, Chapter
from tracker.report.html_tables import SIGMAS
from tracker.report.over_stride import goes_backwards

NOTED = 10.0  # per cent of their mean by which the legs differ at least
SECOND = {"m/s": "m a second", "leg lengths/s": "leg lengths a second"}


def headline(chapter: Chapter) -> str:
    """Describe cadence, speed and stance in one sentence; empty without gait figures."""
    gait = chapter.gait
    cadence = None if gait is None else gait.named("cadence")
    if gait is None or cadence is None or cadence.both is None:
        return ""
    verb = {"walk": "Walks", "run": "Runs"}[gait.motion] + (
        " backwards" if goes_backwards(chapter.track) else ""
    )
    told = f"{verb} at {cadence.both.mean:.0f} steps a minute"
    speed = gait.named("speed")
    if speed is not None and speed.both is not None:
        told += f", {speed.both.mean:.2f} {SECOND[speed.unit]}"
    stance = gait.named(STANCE)
    legs = {} if stance is None else {side: getattr(stance, side) for side in SIDES}
    shares = [f"{value.mean:.0f} % {side}" for side, value in legs.items() if value]
    return f"{told}; stance {', '.join(shares)}." if shares else f"{told}."


def unusual(chapter: Chapter) -> str:
    """Legs that differ by more than NOTED and than their errors, and how many warnings there are."""
    gait = chapter.gait
    if gait is None or not gait.measures:
        return ""
    compared = list(_compared(gait))
    said = [_differs(measure, by) for measure, by in compared if abs(by.mean) > max(NOTED, SIGMAS * by.error)]
    if gait.discord > DISCORD:
        said.append("the legs' stride times differ")
    if chapter.warnings:
        count = len(chapter.warnings)
        said.append(f"{count} warning{'s' if count > 1 else ''} at the top of the page")
    if said:
        return f"Unusual: {'; '.join(said)}."
    if not compared:
        return "Too few strides to compare the legs."
    return f"Nothing unusual: the legs differ by no more than {NOTED:.0f} % or the errors of their figures."


def _compared(gait: Gait) -> list[tuple[Measure, Value]]:
    """Figures with their symmetry, where each leg has two strides; the swing is what the stance leaves."""
    found = [(measure, measure.symmetry) for measure in gait.measures if measure.name != SWING]
    return [(measure, by) for measure, by in found if by is not None and by.count > 1]


def _differs(measure: Measure, by: Value) -> str:
    leg = "near" if by.mean > 0.0 else "far"
    more = "longer" if measure.unit == "s" or measure.name.endswith("length") else "greater"
    return f"{measure.name} {abs(by.mean):.0f} % {more} on the {leg} leg"
