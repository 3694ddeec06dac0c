import numpy as np

from kinematics.figure_file import load_figure
from kinematics.sides import exchanged
from tracker.outline.cycles import COLUMNS, NECK, PHASES, Cycles, at_phases, poses

CYCLES = Cycles.load()


def test_half_a_stride_later_every_cycle_is_the_same_with_the_legs_exchanged():
    later = np.roll(CYCLES.pose, -PHASES // 2, axis=1)
    np.testing.assert_allclose(later[..., exchanged(COLUMNS)], CYCLES.pose, atol=1e-6)


def test_walks_and_runs_are_among_the_cycles_that_ship():
    assert CYCLES.runs.max() > 0.9
    assert CYCLES.runs.min() < 0.1


def test_walks_on_bent_knees_and_with_short_steps_are_among_the_cycles_that_ship():
    walks = np.degrees(CYCLES.pose[CYCLES.runs < 0.1])
    knee, hip = (walks[..., COLUMNS.index(name)] for name in ("knee_near", "hip_near"))
    assert knee.min(axis=1).max() > np.median(knee.min(axis=1)) + 20.0
    assert np.ptp(hip, axis=1).min() < 0.6 * np.median(np.ptp(hip, axis=1))


def test_a_phase_between_two_is_their_mean_and_phases_go_round():
    between = at_phases(CYCLES.pose[3], np.array([PHASES - 0.5]))
    np.testing.assert_allclose(between[0], 0.5 * (CYCLES.pose[3, -1] + CYCLES.pose[3, 0]))


def test_the_near_thigh_is_farthest_ahead_at_phase_zero():
    ahead = CYCLES.pose[..., COLUMNS.index("hip_near")] - CYCLES.pose[..., COLUMNS.index("hip_far")]
    assert np.all(ahead[:, 0] >= ahead.max(axis=1) - np.radians(2.0))


def test_half_cycles_hold_the_neck_where_it_was_marked():
    assert np.all(CYCLES.halves(0.3)[..., NECK] == 0.3)


def test_a_pose_has_the_angles_of_its_columns():
    figure = load_figure()
    q = poses(figure, np.arange(8.0))
    assert [q[figure.index(name)] for name in COLUMNS] == list(range(8))
