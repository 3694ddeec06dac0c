"""Whether the figure was followed in a frame, by the evidence."""

import numpy as np

from dynamics.gaussian import Array
from kinematics.figure import Figure
from kinematics.spm import View, joints
from tracker.loop.detections import Detections, Detector
from tracker.loop.outcome import Outcome
from tracker.picture.pyramid import within
from tracker.registration.field import Field, Registration

LEAST_INSIDE = 0.3  # share of joints in the picture below which the figure is outside
LEAST_MATCH = 0.25  # mean robust weight of the visible points below which the figure is lost
DOUBTFUL_MATCH = 0.5  # the same limit where the background explains the picture better
BARE = 0.5  # share of points that show just the background above which the figure is lost
DENIED = 16.0  # disagreement with detected points, nats, above which matching templates are on something else
LEAST_VISIBLE = 0.3  # share of each link, visible and not bare background, below which the figure is hidden


def judged(
    field: Field, before: Outcome, foreseen: Array, found: Registration, size: tuple[int, ...]
) -> Outcome:
    """The outcome of a frame by the match of the templates.

    Args:
        before: outcome of the frame before.
        foreseen: (D,) pose in which the figure was expected.
        found: where the templates settled at the best hypothesis.
        size: height and width of the picture.
    """
    templates = field.templates
    inner = templates.inner
    matched = found.match[inner].sum() / max(found.shown * inner.sum(), 1.0)
    gone = found.inside < LEAST_INSIDE or matched < LEAST_MATCH
    doubtful = matched < DOUBTFUL_MATCH or not before.measured
    bare = field.scenery.plain(found.pixels)
    lost = gone or (doubtful and found.cost > 0.0) or bare[inner].mean() > BARE
    # A climb without a match may have ended anywhere.
    if inside(field.figure, field.view, foreseen if lost else found.q, size) < LEAST_INSIDE:
        return Outcome.OUTSIDE
    if lost:
        return Outcome.LOST
    if not before.measured:
        return Outcome.FOUND
    number = np.bincount(templates.link[inner])
    visible = np.bincount(templates.link[inner & (found.match > 0) & ~bare], minlength=len(number))
    hidden = (visible < LEAST_VISIBLE * number).any()
    return Outcome.HIDDEN if hidden else Outcome.OK


def denied(detector: Detector, detections: Detections, q: Array) -> bool:
    """Whether the detected points contradict a pose (D,); fewer points must be farther off to do so."""
    agreed = detector.agreement(detections, q)[0]
    return bool(len(detections.joint) * -np.log(max(agreed, 1e-9)) > DENIED)


def judged_by_points(detector: Detector, detections: Detections, q: Array, before: Outcome) -> Outcome:
    """The outcome of a frame without matching templates, by points detected about a pose (D,)."""
    agree, whole = detector.agreement(detections, q)
    if agree < LEAST_MATCH:
        return Outcome.LOST
    if not before.measured:
        return Outcome.FOUND
    return Outcome.OK if whole else Outcome.HIDDEN


def inside(figure: Figure, view: View, q: Array, size: tuple[int, ...]) -> float:
    """Share of the joints of a pose (D,) that lie in a picture of this height and width."""
    return float(within(view.to_pixels(joints(figure, q)), size).mean())
