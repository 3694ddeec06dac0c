"""What is taken off poses before a model is shown them."""

import numpy as np
from numpy.testing import assert_allclose

from kinematics.mocap import POSE_COLUMNS
from tracker.models.centred import centred, own_offset


def test_the_first_place_and_the_mean_neck_of_what_was_measured_are_taken_off(rng):
    y = rng.normal(size=(9, len(POSE_COLUMNS)))
    y[:3] = np.nan
    y[:, POSE_COLUMNS.index("root_y")] = np.nan
    want = dict.fromkeys(POSE_COLUMNS, 0.0) | {"root_x": y[3, 0], "neck": y[3:, 3].mean()}
    assert_allclose(own_offset(y), list(want.values()), rtol=1e-15)
    assert_allclose(centred(y) + own_offset(y), y, atol=1e-15)
