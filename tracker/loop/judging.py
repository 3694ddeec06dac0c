"""Whether the figure was followed in a frame, by the evidence."""

import numpy as np

from dynamics.gaussian import Array
from kinematics.figure import Figure
from kinematics.spm import View, joints
from tracker.loop.detections import Detections, Detector
from tracker.loop.outcome import Outcome
from tracker.picture.pyramid import within
from tracker.registration.field import Field, Registration


def judged(
    field: Field, before: Outcome, foreseen: Array, found: Registration, size: tuple[int, ...]
) -> Outcome:
    """The outcome of a frame that templates were laid on.

    Args:
        before: of the frame before.
        foreseen: (D,) pose in which the figure was expected.
        found: where the templates settled at the best hypothesis.
        size: height and width of the picture.
    """
    templates, settings = field.templates, field.settings
    inner = templates.inner
    matched = found.match[inner].sum() / max(found.shown * inner.sum(), 1.0)
    gone = found.inside < settings.least_inside or matched < settings.least_match
    doubtful = matched < settings.doubtful_match or not before.measured
    lost = gone or (doubtful and found.cost > 0.0) or field.bare(found) > settings.bare
    # A climb that found nothing may have ended anywhere.
    if inside(field.figure, field.view, foreseen if lost else found.q, size) < settings.least_inside:
        return Outcome.OUTSIDE
    if lost:
        return Outcome.LOST
    if not before.measured:
        return Outcome.FOUND
    visible = inner & (found.match > 0)
    share = [visible[inner & (templates.link == i)].mean() for i in np.unique(templates.link[inner])]
    return Outcome.HIDDEN if min(share) < settings.least_visible else Outcome.OK


def judged_by_points(detector: Detector, detections: Detections, q: Array, before: Outcome) -> Outcome:
    """The outcome of a frame in which no template matches but points were detected about a pose (D,)."""
    agree, whole = detector.agreement(detections, q)
    if agree < detector.settings.least_match:
        return Outcome.LOST
    if not before.measured:
        return Outcome.FOUND
    return Outcome.OK if whole else Outcome.HIDDEN


def inside(figure: Figure, view: View, q: Array, size: tuple[int, ...]) -> float:
    """Share of the joints of a pose (D,) that lie in a picture of this height and width."""
    return float(within(view.to_pixels(joints(figure, q)), size).mean())
