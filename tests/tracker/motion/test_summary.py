"""What the motion commands print."""

import numpy as np

from dynamics.motion.tasks import Labelling
from tests.tracker.gaits import sequence
from tracker.motion.fill import Filled
from tracker.motion.summary import filled_cells, forecast_errors, free_motion, label_shares

NOTHING = np.full((4, 8), np.nan)


def test_forecast_errors_are_over_measured_angles_in_degrees():
    y = np.zeros((4, 8))
    y[:, :2] = 100.0  # the root is no angle
    y[2:, 2:] = np.radians(10.0)
    y[3, 3] = np.nan
    mean = np.vstack([np.full((1, 8), np.nan), np.radians(np.full((4, 8), 4.0))])
    text = forecast_errors([sequence(y)], [mean], 1)
    # Frame 1: 6 cells off by 4; frame 2: 6 off by 6; frame 3: 5 off by 6. Unchanged: 6 cells off by 10.
    rmse, still = np.sqrt((6 * 16 + 11 * 36) / 17), np.sqrt(6 * 100 / 17)
    assert f"1 frame ahead in 1 sequence: {rmse:.2f} degrees RMSE" in text
    assert f"an unchanged pose {still:.2f}" in text
    assert "nothing was measured" in forecast_errors([sequence(y[:1])], [mean[:2]], 1)


def test_filled_cells_are_counted_and_so_is_what_stays_empty():
    sd = NOTHING.copy()
    sd[1, 2:] = np.radians(3.0)
    y = np.zeros((4, 8))
    y[1] = np.nan
    text = filled_cells([sequence(y)], [Filled(y, sd)])
    assert text.startswith("6 cells filled in 1 frame of 1 sequence, angles to 3.0 degrees")
    assert filled_cells([sequence(y)], [Filled(y, sd[:, :3])]).startswith("1 cell filled in 1 frame")
    assert "gaps filled" not in text
    by = ("stride", "switching model", "stride")
    told = filled_cells([sequence(y)], [Filled(y, sd, by)])
    assert "; gaps filled by the stride 2 and the switching model 1" in told
    assert "2 of a root that was never measured stay empty" in text
    assert filled_cells([sequence(np.zeros((4, 8)))] * 2, []) == "nothing was missing in 2 sequences"


def test_shares_and_the_tables_own_labels_are_told():
    found = Labelling(
        ("walk", "walk", "run", "walk"), np.zeros(4, dtype=int), ("walk", "run"), np.ones((4, 2))
    )
    own = sequence(np.zeros((4, 8)), labels=("walk", "run", "", "walk"))
    first, second = label_shares([own], [found])
    assert first == "4 frames in 1 sequence: walk 75.0 %, run 25.0 %"
    assert second == "the table's own label on 66.67 % of 3 frames that have one"
    assert len(label_shares([sequence(np.zeros((4, 8)))], [found])) == 1


def test_the_shares_of_a_free_motion_are_told():
    text = free_motion("gait.npz", ["walk"] * 150 + ["run"] * 50, 25.0)
    assert text == "200 frames of gait.npz at 25 a second: walk 75 %, run 25 %"
