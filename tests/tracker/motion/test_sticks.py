"""Sticks: angles to places, and the ground below them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kinematics.figure_file import WALKER
from kinematics.mocap import POSE_COLUMNS
from tests.tracker.gaits import gait
from tracker.motion.sticks import LAYERS, sticks

NAMES = [link.name for link in WALKER.links]


def pose(**angles):
    y = np.zeros((1, 8))
    for name, value in angles.items():
        y[0, POSE_COLUMNS.index(name)] = np.radians(value)
    return y


def lowest(links):
    return links[..., 1].min(axis=(1, 2))


@pytest.mark.parametrize(("side", "layer"), [("near", 2), ("far", 0)])
def test_angles_turn_the_leg_they_name_the_way_the_table_says(side, layer):
    straight = sticks(pose(), 30.0)[0]
    ahead = sticks(pose(**{f"hip_{side}": 30.0}), 30.0)[0]
    bent = sticks(pose(**{f"knee_{side}": 60.0}), 30.0)[0]
    leg = [i for i, of in enumerate(LAYERS) if of == layer]
    rest = [i for i in range(len(NAMES)) if i not in leg]
    knee, ankle = straight[leg[0], 1], straight[leg[-1], 1]
    assert ahead[leg[0], 1, 0] > knee[0] + 0.2
    assert bent[leg[-1], 1, 0] < ankle[0] - 0.2
    shift = ahead[rest] - straight[rest]
    assert_allclose(shift, np.broadcast_to(shift[0, 0], shift.shape), atol=1e-12)


def test_feet_touch_the_ground_whatever_height_the_table_has(rng):
    y = gait("walk", 120, rng)
    for lift in (np.zeros(120), np.full(120, 5.0), np.linspace(0.0, 2.0, 120)):
        raised = y.copy()
        raised[:, 1] += lift
        low = lowest(sticks(raised, 30.0))
        # A climb of 2 leg lengths in 120 frames is 0.6 within the 37 frames that the ground looks at.
        assert np.abs(low).max() < (0.35 if np.ptp(lift) else 0.12)
    assert abs(lowest(sticks(y, 30.0)).mean()) < 0.05


def test_a_figure_whose_root_was_not_measured_stands_still(rng):
    y = gait("walk", 10, rng)
    y[:, :2] = np.nan
    links = sticks(y, 30.0)
    assert np.isfinite(links).all()
    hip = links[:, LAYERS.index(1), 0, 0]
    assert_allclose(hip, hip[0])
