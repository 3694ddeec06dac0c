"""A textured picture that moves as a whole, with a marked figure on it."""

import cv2
import numpy as np

from kinematics.figure import load_figure
from kinematics.recover import start_pose
from tests.benchmarks.rivals.body import body_at
from tracker.tables.keypoints import Mark

SIZE = (240, 320)
STANDING = {
    "head_top": (160.0, 30.0),
    "neck": (160.0, 55.0),
    "hip": (160.0, 100.0),
    "near_knee": (175.0, 140.0),
    "near_ankle": (170.0, 180.0),
    "near_toe": (190.0, 188.0),
    "far_knee": (145.0, 140.0),
    "far_ankle": (135.0, 180.0),
    "far_toe": (155.0, 188.0),
}


def standing_body():
    """The body of the marks above."""
    return body_at(
        start_pose(load_figure(), STANDING, 1), {name: Mark(*place) for name, place in STANDING.items()}
    )


def texture(rng, size=2.0):
    """A picture of smooth grey blobs of about this many pixels."""
    grain = cv2.GaussianBlur(rng.normal(size=SIZE), (0, 0), size)
    grey = np.clip(127.0 + 40.0 * grain / grain.std(), 0, 255).astype(np.uint8)
    return np.repeat(grey[..., None], 3, axis=2)


def turning(t, degrees=1.0, step=(2.0, -1.0), growth=1.0):
    """(2, 3) where the picture has moved after t frames: turned about the hip, grown and shifted."""
    matrix = cv2.getRotationMatrix2D(STANDING["hip"], degrees * t, growth**t)
    matrix[:, 2] += np.multiply(step, t)
    return matrix


def moved_pictures(picture, motions):
    """The picture after each motion (2, 3)."""
    return [cv2.warpAffine(picture, motion, SIZE[::-1], borderMode=cv2.BORDER_REFLECT) for motion in motions]
