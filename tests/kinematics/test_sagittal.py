"""A body in space seen from its side: known poses from any direction, the floor, the names of joints."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kinematics.bvh import Capture
from kinematics.mocap import POSE_COLUMNS
from kinematics.sagittal import Body, find_body, project
from tests.kinematics.bodies import CMU, stepping_body, walker
from tests.kinematics.figures import ARMS, Puppet, upright


@pytest.mark.parametrize("facing", [0.0, 0.7, 3.0, -2.0])
def test_a_known_pose_is_read_back_from_whatever_side_it_walks(facing):
    y = project(walker(10, facing=facing, torso=0.2, neck=-0.3, right=(0.4, 0.1), left=(-0.5, 0.9)))
    assert POSE_COLUMNS[2:] == ("torso", "neck", "hip_near", "knee_near", "hip_far", "knee_far")
    assert_allclose(y[:, 2:], [[0.2, -0.3, 0.4, 0.1, -0.5, 0.9]] * 10, atol=1e-12)
    assert_allclose(y[:, 0], np.arange(10) * 0.1 / 2.0, atol=1e-12)


def test_who_walks_backwards_has_a_falling_root_and_the_same_angles():
    pose = {"torso": 0.2, "right": (0.4, 0.1), "left": (-0.5, 0.9)}
    there, back = project(walker(20, **pose)), project(walker(20, step=-0.1, **pose))
    assert_allclose(back[:, 0], -there[:, 0], atol=1e-12)
    assert_allclose(back[:, 2:], there[:, 2:], atol=1e-12)


def test_a_body_that_stays_is_seen_from_its_right_side():
    y = project(walker(10, facing=1.0, step=0.0, right=(0.4, 0.1)))
    assert_allclose(y[:, 4:6], [[0.4, 0.1]] * 10, atol=1e-12)
    assert_allclose(y[:, 0], 0.0, atol=1e-12)


def test_who_rises_on_the_way_still_travels_level():
    body, rise = walker(20, torso=0.2, right=(0.4, 0.1)), np.arange(20)[:, None] * [0.0, 0.05, 0.0]
    legs = (leg + rise[:, None] for leg in (body.right, body.left))
    y = project(Body(*legs, body.neck + rise, body.head + rise))
    assert_allclose(y[:, [2, 4, 5]], [[0.2, 0.4, 0.1]] * 20, atol=1e-12)
    assert_allclose(y[:, 0], np.arange(20) * 0.1 / 2.0, atol=1e-12)
    assert_allclose(np.diff(y[:, 1]), 0.05 / 2.0, atol=1e-12)


def test_on_a_curve_each_frame_is_seen_the_way_it_faces():
    angles = np.linspace(0.0, 1.5, 40)
    parts = [walker(1, facing=angle, right=(0.4, 0.1), left=(-0.5, 0.9)) for angle in angles]
    way = np.cumsum([[np.sin(angle), 0.0, np.cos(angle)] for angle in angles], axis=0) * 0.1
    right = np.concatenate([part.right for part in parts]) + way[:, None]
    left = np.concatenate([part.left for part in parts]) + way[:, None]
    neck, head = (np.concatenate([getattr(part, key) for part in parts]) + way for key in ("neck", "head"))
    y = project(Body(right, left, neck, head), curve=True)
    assert_allclose(y[:, 4:], [[0.4, 0.1, -0.5, 0.9]] * 40, atol=1e-12)
    # Chords of a turn of 0.04 rad a frame are shorter than its arc by 0.04^2 / 8.
    assert_allclose(y[:, 0], np.arange(40) * 0.05, rtol=5e-4)


def test_a_walk_up_a_tilted_floor_keeps_its_height():
    body = stepping_body(tilt=0.02)
    assert_allclose(project(body)[:, 1], project(stepping_body(tilt=0.0))[:, 1], atol=1e-3)
    hips_rise = 0.02 * (body.right[-1, 0, 2] - body.right[0, 0, 2]) / body.leg_length
    assert hips_rise > 0.05


def test_a_capture_that_freezes_in_mid_step_keeps_its_floor():
    body, held = stepping_body(tilt=0.0), np.r_[:150, np.full(12, 150)]
    frozen = Body(*(joints[held] for joints in (body.right, body.left, body.neck, body.head)))
    assert_allclose(project(frozen)[:, 1], project(body)[held, 1], atol=1e-3)


@pytest.mark.parametrize(
    ("leg", "neck", "head"),
    [
        ("RightUpLeg RightLeg RightFoot RightToeBase", ["Neck"], "Head_end"),
        ("UpperLeg_R LowerLeg_R Foot_R Toes_R", ["Neck"], "Head"),
        ("RightUpLeg RightLeg RightFoot RightToes", ["RightArm", "LeftArm"], "HEad_end"),
        ("rhipjoint rfemur rtibia rfoot", ["thorax"], "head"),
    ],
)
def test_a_body_is_found_in_every_dialect_in_whatever_order_its_joints_come(rng, leg, neck, head):
    right = leg.split()
    other = {"Right": "Left", "_R": "_L"}
    pair = next((pair for pair in other.items() if pair[0] in leg), None)
    left = [name.replace(*pair) if pair else "l" + name[1:] for name in right]
    names = rng.permutation([*right, *left, *neck, head, "Spine", "LeftHand"]).tolist()
    capture = Capture(tuple(names), rng.normal(size=(3, len(names), 3)), 30.0)
    body = find_body(capture)
    for i in range(4):
        assert_allclose(body.right[:, i], capture.at(right[i]), rtol=0)
        assert_allclose(body.left[:, i], capture.at(left[i]), rtol=0)
    assert_allclose(body.neck, sum(capture.at(name) for name in neck) / len(neck), rtol=1e-15)
    assert_allclose(body.head, capture.at(head), rtol=0)


@pytest.mark.parametrize("facing", [0.0, 0.7, 3.0])
def test_arms_are_seen_against_the_trunk_and_elbows_bend_ahead(facing):
    body = walker(10, facing=facing, torso=0.2, arm=(0.5, 1.2), other_arm=(-0.4, 0.1))
    y = project(body, arms=True)
    assert_allclose(y[:, 8:], np.tile([0.5, 1.2, -0.4, 0.1], (10, 1)), atol=1e-12)
    assert_allclose(y[:, :8], project(body), rtol=0)
    assert_allclose(project(body.between(2, 5), arms=True), y[2:5] - np.eye(12)[0] * y[2, 0], atol=1e-12)


def test_a_figure_with_arms_points_them_as_the_capture_does():
    body = walker(2, torso=0.3, arm=(0.4, 0.9))
    q = upright(ARMS, torso=0.3, shoulder_near=0.4, elbow_near=0.9)
    places = Puppet(ARMS, q).joints()
    shoulder, elbow, wrist = (joint[[2, 1]] for joint in body.arms[0, 0])  # along the way and up
    upper, fore = (elbow - shoulder) / 0.7, (wrist - elbow) / 0.5
    neck, near_elbow, near_wrist = (np.array(places[name]) for name in ("neck", "near_elbow", "near_wrist"))
    assert_allclose(near_elbow - 0.85 * neck, 0.36 * upper, atol=1e-12)
    assert_allclose(near_wrist - near_elbow, 0.3 * fore, atol=1e-12)


def test_a_capture_without_a_hand_has_no_arms(rng):
    names = (*CMU, "LeftArm", "LeftForeArm", "LeftHand", "RightArm", "RightForeArm", "RightHand")
    whole = Capture(names, rng.normal(size=(3, len(names), 3)), 30.0)
    assert_allclose(find_body(whole).arms[1, :, 2], whole.at("LeftHand"), rtol=0)
    less = Capture(names[:-1], whole.positions[:, :-1], 30.0)
    assert find_body(less).arms is None


def test_a_leg_is_as_long_as_thigh_and_shank_whatever_the_pose():
    assert walker(5, right=(0.4, 0.1), left=(-0.5, 0.9)).leg_length == pytest.approx(2.0, rel=1e-12)
