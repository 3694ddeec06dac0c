"""Near and far, by name and by position."""

import pytest
from numpy.testing import assert_array_equal

from kinematics.sides import exchanged, on_side, other_side
from tests.kinematics.figures import WALKER


@pytest.mark.parametrize(
    ("name", "other"),
    [
        ("near_knee", "far_knee"),
        ("thigh_far", "thigh_near"),
        ("stretch_thigh_near", "stretch_thigh_far"),
        ("neck", "neck"),
        ("nearly_there", "nearly_there"),
    ],
)
def test_the_other_side_of_a_name_leads_back_to_it(name, other):
    assert other_side(name) == other
    assert other_side(other) == name


def test_a_name_is_of_the_side_that_it_says():
    assert on_side("hip_near", "near")
    assert not on_side("hip_near", "far")
    assert not on_side("nearly_there", "near")


def test_names_are_exchanged_with_their_twins_and_those_that_have_none_stay():
    assert_array_equal(exchanged(["hip", "near_knee", "near_toe", "far_knee"]), [0, 3, 2, 1])


def test_the_walker_exchanges_joints_and_freedoms_as_their_names_say():
    assert_array_equal(WALKER.joint_twins, exchanged(WALKER.joints))
    assert_array_equal(WALKER.exchanged, exchanged(WALKER.freedoms))
