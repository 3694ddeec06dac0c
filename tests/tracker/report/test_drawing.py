"""A figure drawn on a frame: where its joints are, near and far told apart, and what the caption says."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from tests.kinematics.figures import WALKER, upright
from tests.tracker.tracks import random_track, standing
from tracker.report import drawing
from tracker.report.drawing import paint
from videos.overlay import FAR, NEAR, TRUNK

GREY = 128
POSE = upright(WALKER, torso=0.1, hip_near=0.5, knee_near=0.3, hip_far=-0.4, knee_far=0.2)


@pytest.fixture
def track(rng):
    made = standing(random_track(rng, 4, first=3), POSE)
    return replace(made, cov=1e-2 * made.cov, s=np.zeros(4, np.intp))


def ground(height=240):
    return np.full((height, 320, 3), GREY, np.uint8)


@pytest.fixture
def captions(monkeypatch):
    """What is written on frames, in order."""
    told = []

    def draw(image, segments=(), ellipses=(), caption=""):
        told.append(caption)
        return image

    monkeypatch.setattr(drawing, "draw", draw)
    return told


def test_limbs_are_drawn_between_their_joints_in_their_side_s_colour(track):
    out = paint(ground(), track, 3)
    assert out.shape == (240, 320, 3)
    at = dict(zip(WALKER.joints, track.joints()[0], strict=True))
    limbs = [("hip", "near_knee", NEAR), ("near_knee", "near_ankle", NEAR), ("hip", "neck", TRUNK)]
    limbs += [("neck", "head_top", TRUNK), ("hip", "far_knee", FAR), ("far_knee", "far_ankle", FAR)]
    limbs += [("near_ankle", "near_toe", NEAR), ("far_ankle", "far_toe", FAR)]
    for start, end, colour in limbs:
        x, y = np.rint(0.5 * (at[start] + at[end])).astype(int)
        assert_array_equal(out[y, x], colour)


def test_near_limbs_lie_over_far_ones(track):
    together = standing(track, upright(WALKER))
    out = paint(ground(), together, 3)
    x, y = np.rint(together.joints()[0][WALKER.joints.index("near_knee")]).astype(int)
    assert_array_equal(out[y - 8, x], NEAR)


def test_each_joint_has_its_own_ellipse(track):
    # An ankle that may turn by 0.3 rad either way moves its toe by 0.3 feet and no other joint.
    cov = np.zeros_like(track.cov)
    ankle = WALKER.index("ankle_near")
    cov[:, ankle, ankle] = 0.3**2
    loose, tight = (paint(ground(520), replace(track, cov=size * cov), 3) for size in (1.0, 1e-6))
    rows, columns = np.nonzero((loose != tight).any(axis=-1))
    toe = track.joints()[0][WALKER.joints.index("near_toe")]
    reach = 2.0 * 0.3 * 0.27 * track.view.unit
    away = np.hypot(columns - toe[0], rows - toe[1])
    assert 0.5 * reach < away.max() < reach + 6.0  # and the width of the line


def test_the_caption_says_frame_motion_and_outcome(track, captions):
    frames = (3, 4, 5)
    for frame in frames:
        paint(ground(), track, frame, "learned  ")
    assert captions == [
        "learned  frame 3  walk",
        "learned  frame 4  walk  hidden",
        "learned  frame 5  walk  lost",
    ]


def test_a_model_of_one_state_is_drawn_without_a_motion(track, captions):
    paint(ground(), replace(track, labels=("cv",)), 3)
    assert captions == ["frame 3"]


def test_a_frame_of_a_long_track_takes_no_work_on_the_others(track, monkeypatch):
    def copied(_):
        raise AssertionError("the whole track was gone through")

    monkeypatch.setattr(type(track), "__post_init__", copied)
    monkeypatch.setattr(type(track), "measured", property(copied))
    paint(np.zeros((300, 400, 3), np.uint8), track, track.first)
