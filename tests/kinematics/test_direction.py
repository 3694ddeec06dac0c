"""Who goes backwards, and from which frame on it is known."""

import numpy as np
from numpy.testing import assert_array_equal

from kinematics.direction import gone_back, turning

T = np.arange(90) / 30.0


def test_who_goes_backwards_is_known_from_half_a_leg_length_on():
    x = 3.0 - 0.06 * np.arange(90)
    assert_array_equal(np.flatnonzero(gone_back(x, T)), range(9, 90))
    x[[0, 10, 89]] = np.nan  # counts from the first measured place, and the last one lasts
    assert_array_equal(np.flatnonzero(gone_back(x, T)), range(11, 90))


def test_others_go_forwards():
    for x in (0.06 * np.arange(90), np.zeros(90), np.linspace(0.0, -0.45, 90), np.full(90, np.nan)):
        assert not gone_back(x, T).any()
    assert not gone_back(np.linspace(0.0, -0.9, 90), 4.0 * T)[-1]  # a drift on a treadmill


def test_who_goes_back_where_the_way_led_turns_there():
    there = 0.06 * np.abs(np.arange(90) - 40.0)
    there[38:43] = np.nan
    assert [turning(x, T) for x in (there, -there)] == [37, 37]
    for x in (0.06 * np.arange(90), there[20:60], np.full(90, np.nan)):
        assert turning(x, T[: len(x)]) is None
    assert turning(there, 20.0 * T) is None  # a drift on a treadmill
