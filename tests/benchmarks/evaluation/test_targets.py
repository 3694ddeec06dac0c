"""What is wanted: both bounds count, and what is no number is never reached."""

import math

import pytest

from tests.benchmarks.evaluation.targets import Target


@pytest.mark.parametrize(("value", "reached"), [(0.9, False), (1.0, True), (4.0, True), (4.1, False)])
def test_a_figure_must_lie_between_its_bounds(value, reached):
    target = Target("", value, 4.0, 1.0)
    assert target.reached is reached
    assert target.row()[-1] == ("yes" if reached else "**no**")


def test_no_number_reaches_nothing():
    assert not Target("", math.nan, 4.0).reached


def test_a_bound_below_is_told():
    assert Target("", 1.0, 4.0, 1.0).row()[1] == "1 to 4"
    assert Target("", 1.0, 4.0).row()[1] == "at most 4"
