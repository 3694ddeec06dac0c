"""The figure as rivals get it: the very marks, outlines between them, and what covers what."""

import numpy as np
from numpy.testing import assert_allclose

from tests.benchmarks.rivals.body import by_frame
from tests.benchmarks.rivals.scenes import SIZE, STANDING, standing_body

BODY = standing_body()
THIGH_NEAR, THIGH_FAR = 2, 4


def test_joints_lie_where_they_are_marked_though_both_legs_share_their_lengths():
    wanted = [STANDING[name] for name in BODY.names]
    assert_allclose(BODY.joints, wanted, atol=1e-9)


def test_every_link_lies_between_the_joints_of_the_figure():
    ends = [(BODY.names[a], BODY.names[b]) for a, b in BODY.ends]
    assert ends[:4] == [
        ("hip", "neck"),
        ("neck", "head_top"),
        ("hip", "near_knee"),
        ("near_knee", "near_ankle"),
    ]


def test_an_outline_is_as_wide_as_its_link_and_square_to_it():
    corners = BODY.outlines(BODY.joints)[THIGH_NEAR]
    hip, knee = BODY.joints[BODY.ends[THIGH_NEAR]]
    assert_allclose(corners[:2].mean(0), hip, atol=1e-9)
    assert_allclose(corners[2:].mean(0), knee, atol=1e-9)
    assert_allclose(
        [np.hypot(*(corners[1] - corners[0])), np.hypot(*(corners[3] - corners[2]))], BODY.widths[THIGH_NEAR]
    )
    assert_allclose((corners[1] - corners[0]) @ (knee - hip), 0.0, atol=1e-9)


def test_what_a_nearer_link_covers_belongs_to_no_other():
    masks = BODY.masks(BODY.joints, SIZE)
    near, far = masks[THIGH_NEAR] > 0, masks[THIGH_FAR] > 0
    assert near.any()
    assert far.any()
    assert not (near & far).any()
    knee = tuple(BODY.joints[BODY.ends[THIGH_FAR, 1]].astype(int)[::-1])
    assert far[knee]


def test_a_covered_link_has_no_place_left():
    behind = BODY.joints.copy()
    behind[BODY.ends[THIGH_FAR, 1]] = behind[BODY.ends[THIGH_NEAR, 1]]
    assert not BODY.masks(behind, SIZE)[THIGH_FAR].any()


def test_a_joint_lies_in_the_middle_of_what_its_links_say():
    carried = BODY.joints[BODY.ends].copy()
    carried[THIGH_NEAR, 1] += (6.0, -4.0)
    moved = BODY.at_joints(carried) - BODY.joints
    knee = BODY.ends[THIGH_NEAR, 1]
    assert_allclose(moved[knee], (3.0, -2.0))
    assert_allclose(np.delete(moved, knee, axis=0), 0.0, atol=1e-9)


def test_frames_count_from_the_start():
    found = by_frame(BODY, [BODY.joints, BODY.joints + 5.0])
    assert found[1]["neck"] == (STANDING["neck"][0] + 5.0, STANDING["neck"][1] + 5.0)
    assert set(found[0]) == set(STANDING)
