"""Which leg is nearer, by the arms: they swing against the legs, and only the near one is seen on the trunk.

Where grey levels on the trunk move forward relative to it, the near arm swings forward, and the near leg
moves backward relative to the far one. Their displacement between two frames is the least-squares one along
the body's x, d = -sum(I_t I_x) / sum(I_x^2), as Lucas and Kanade have it. The evidence is the mean of -d
times the forward displacement of the leg named near relative to the other one.
"""

import cv2
import numpy as np

from kinematics.figure import Array, Flags
from kinematics.spm import joints, skeleton
from tracker.outline.doubt import in_standard_errors
from tracker.outline.near import near_leg
from tracker.outline.shape import Shape
from tracker.outline.stage import Stage

ALONG = np.linspace(0.0, 0.85, 18)  # places along the trunk, shares of its length
ACROSS = np.linspace(0.6, -0.6, 9)  # and across it, forward, shares of its half width; beyond is the scene
FLAT = 0.1  # share of a usual frame's sum(I_x^2) that is added to each one's
TOGETHER = 8.0  # number of neighbouring frames with correlated errors, at 30 a second


def swing(shape: Shape, q: Array, stage: Stage, hips: Array, units: Array, seen: Flags) -> float:
    """Evidence that the leg named near is in front, standard errors, as by `nearness`."""
    step = round(stage.often)
    if len(q) <= 2 * step:
        return 0.0
    before, here, after = slice(None, -2 * step), slice(step, -step), slice(2 * step, None)
    places = shape.places(skeleton(shape.figure, q), [shape.trunk], ALONG, ACROSS)
    greys = stage.at(stage.light, hips, units, places).reshape(len(q), len(ALONG), len(ACROSS))
    looks = np.stack([cv2.blur(grey, (3, 3)) for grey in greys])  # each grey the mean of nine neighbours
    ahead = _ahead(shape, q)
    change, slope = looks[after] - looks[before], np.gradient(looks[here], axis=2)
    change -= np.median(change, axis=(1, 2), keepdims=True)  # of the light
    steep = np.square(slope).sum((1, 2))
    moved = -(change * slope).sum((1, 2)) / (steep + FLAT * np.median(steep) + 1e-9)
    against = -moved * (ahead[after] - ahead[before])
    return in_standard_errors(against[seen[before] & seen[here] & seen[after]], TOGETHER * stage.often)


def _ahead(shape: Shape, q: Array) -> Array:
    """(T,) by how much knee and ankle of the leg named near are ahead of the other's, leg lengths."""
    figure = shape.figure
    near = [figure.joints.index(figure.links[i].joint) for i in near_leg(figure)]
    x = joints(figure, q)[..., 0]
    return np.asarray((x[:, near] - x[:, figure.joint_twins[near]]).mean(1))
