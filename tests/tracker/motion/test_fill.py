"""Gaps of pose tables filled each way: what must not matter, what must stay, which way is taken."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.periodic.synthesis import synthesise_stride
from kinematics.mocap import POSE_COLUMNS
from tests.tracker.gaits import OFFSET, blanked, gait, gait_hmm, gait_model, gait_stride, sequence
from tracker.models.find import motion_model
from tracker.motion.fill import (
    BY_STRIDE,
    BY_SWITCHING,
    Fillers,
    angles_evidence,
    at_table_noise,
    fill_gaps,
    fillers,
)
from tracker.tables.poses import PosesError

WAYS = {
    "switching": lambda: Fillers(gait_model(), None, 30.0),
    "stride": lambda: Fillers(None, gait_stride(), 30.0),
    "by evidence": lambda: Fillers(gait_model(), gait_stride(), 30.0),
}
EACH_WAY = pytest.mark.parametrize("way", WAYS)


@EACH_WAY
def test_what_was_measured_stays_and_the_rest_is_filled(rng, way):
    y = gait("walk", 70, rng) + OFFSET
    given = blanked(blanked(y, slice(30, 38)), slice(50, 60), [4, 5])
    filled = fill_gaps(WAYS[way](), sequence(given), rng)
    seen = np.isfinite(given)
    assert_array_equal(filled.y[seen], given[seen])
    assert_array_equal(np.isnan(filled.sd), seen)
    assert (filled.sd[~seen] > 0).all()
    away = np.degrees(np.abs(filled.y - y)[~seen])
    assert away.mean() < 6.0
    assert np.abs(filled.y - y)[30:38, 0].max() < 0.05


def test_a_table_is_filled_at_its_own_noise(rng):
    y = gait("walk", 80, rng, noise=0.0)
    given = sequence(
        blanked(y + np.radians(rng.normal(scale=[0] * 2 + [4.0] * 6, size=y.shape)), slice(40, 48))
    )
    used = at_table_noise(gait_model(), [given])
    assert np.sqrt(used.R.diagonal()[2:]) == pytest.approx(np.radians(4.0), rel=0.2)
    error, without = (
        np.abs(fill_gaps(Fillers(slds, None, 30.0), given, rng).y - y)[40:48].mean()
        for slds in (used, gait_model())
    )
    assert error < 0.8 * without


@EACH_WAY
def test_a_gap_at_the_start_and_at_the_end_is_filled(rng, way):
    y = gait("walk", 60, rng)
    filled = fill_gaps(WAYS[way](), sequence(blanked(y, [*range(8), *range(52, 60)])), rng)
    assert np.isfinite(filled.y).all()
    assert np.degrees(np.abs(filled.y - y)[:, 2:]).mean() < 5.0
    # The figure goes on at its pace to both sides.
    assert np.abs(filled.y - y)[:, 0].max() < 0.15


@EACH_WAY
def test_filling_does_not_hang_on_the_place_or_the_head(rng, way):
    given = blanked(gait("walk", 40, rng), slice(15, 22))
    here, there = (
        fill_gaps(WAYS[way](), sequence(shifted), np.random.default_rng(1))
        for shifted in (given, given + OFFSET)
    )
    # As above: rounding of the place.
    assert_allclose(there.y - OFFSET, here.y, atol=1e-6)
    assert_allclose(there.sd, here.sd, atol=1e-6)


@EACH_WAY
def test_a_root_that_was_never_measured_stays_empty(rng, way):
    given = blanked(blanked(gait("walk", 40, rng), slice(None), slice(0, 2)), slice(15, 20))
    filled = fill_gaps(WAYS[way](), sequence(given), rng)
    assert np.isnan(filled.y[:, :2]).all()
    assert np.isnan(filled.sd[:, :2]).all()
    assert np.isfinite(filled.y[:, 2:]).all()


@EACH_WAY
def test_who_goes_backwards_is_filled_as_if_time_ran_back(rng, way):
    given = blanked(gait("walk", 70, rng), [*range(15, 22), *range(40, 50)])
    ahead, back = (
        fill_gaps(WAYS[way](), sequence(p), np.random.default_rng(1)) for p in (given, given[::-1])
    )
    assert_allclose(back.y[::-1], ahead.y, atol=1e-6)
    assert_allclose(back.sd[::-1], ahead.sd, atol=1e-6)
    assert back.by[::-1] == ahead.by
    noises = (at_table_noise(gait_model(), [sequence(p)]).R for p in (given, given[::-1]))
    assert_allclose(*noises, rtol=1e-6)


@EACH_WAY
def test_a_neck_that_was_never_measured_may_be_held_anyhow(rng, way):
    neck = POSE_COLUMNS.index("neck")
    filled = fill_gaps(WAYS[way](), sequence(blanked(gait("walk", 40, rng), slice(None), neck)), rng)
    assert np.isfinite(filled.y).all()
    assert (np.degrees(filled.sd[:, neck]) > 19.9).all()


def test_the_switching_model_learns_a_constant_difference_of_an_angle(rng, monkeypatch):
    y = gait("walk", 80, rng)
    y[:, POSE_COLUMNS.index("knee_far")] += np.radians(10.0)
    given = sequence(blanked(y, slice(35, 45)))
    found = fill_gaps(WAYS["switching"](), given, np.random.default_rng(1))
    monkeypatch.setattr("tracker.motion.fill.UNKNOWN_ANGLES", {})
    without = fill_gaps(WAYS["switching"](), given, np.random.default_rng(1))
    away, farther = (np.abs(f.y - y)[35:45, 4:].mean() for f in (found, without))
    assert away < 0.8 * farther


def test_a_gap_that_is_too_long_for_the_stride_is_filled_by_the_switching_model(rng, monkeypatch):
    monkeypatch.setattr("tracker.motion.fill.MOST", 9)
    given = blanked(gait("walk", 60, rng), slice(25, 35))
    assert fill_gaps(WAYS["by evidence"](), sequence(given), rng).by == (BY_SWITCHING,)


@EACH_WAY
def test_a_sequence_without_gaps_comes_back_as_it_was(rng, way):
    y = gait("walk", 12, rng)
    filled = fill_gaps(WAYS[way](), sequence(y), rng)
    assert_array_equal(filled.y, y)
    assert np.isnan(filled.sd).all()


def test_each_gap_is_filled_by_what_its_neighbourhood_speaks_for(rng, monkeypatch):
    y = gait("walk", 140, rng)
    given = blanked(y, [*range(10, 18), *range(110, 118)])
    evidence = iter([-1e6, 1e6])
    monkeypatch.setattr("tracker.motion.fill.angles_evidence", lambda slds, window, fps: next(evidence))
    found = fill_gaps(WAYS["by evidence"](), sequence(given), np.random.default_rng(1))
    assert found.by == (BY_STRIDE, BY_SWITCHING)
    one, other = (
        fill_gaps(WAYS[way](), sequence(given), np.random.default_rng(1)) for way in ("stride", "switching")
    )
    assert_array_equal(found.y[:100], one.y[:100])
    assert_array_equal(found.y[100:], other.y[100:])
    assert_array_equal(found.sd[100:], other.sd[100:])


def test_a_gait_is_filled_by_the_stride_and_what_is_not_periodic_by_the_switching_model(rng):
    both = fillers("gait", motion_model("gait"), 30.0)
    walk = synthesise_stride(both.stride, 0, 60, 30.0, rng)
    t = np.arange(60)[:, None] / 30.0
    reaching = 0.7 * np.tanh(3.0 * (t - rng.uniform(0.3, 1.7, 8))) * rng.choice([-1.0, 1.0], 8)
    for y, by in ((walk, BY_STRIDE), (walk * 0.0, BY_SWITCHING), (reaching, BY_SWITCHING)):
        assert fill_gaps(both, sequence(blanked(y, slice(25, 35))), rng).by == (by,)


def test_the_switching_model_is_asked_at_its_likeliest_noise(rng):
    y = gait("walk", 60, rng)
    noisy = y + 0.1 * rng.normal(size=y.shape)
    slds = gait_model()
    louder = replace(slds, R=slds.R + 0.1**2 * np.diag(~slds.travels))
    assert angles_evidence(slds, y, 30.0) > angles_evidence(louder, y, 30.0)
    assert angles_evidence(slds, noisy, 30.0) > angles_evidence(louder, noisy, 30.0) - 10.0


def test_only_angles_speak_for_a_way(rng):
    y = gait("walk", 30, rng)
    here, there = (angles_evidence(gait_model(), p, 30.0) for p in (y, y + OFFSET * [1, 1, *[0] * 6]))
    assert here == there


def test_a_gap_near_which_no_angle_was_measured_is_left_to_the_switching_model(rng):
    y = blanked(gait("walk", 20, rng), slice(None), slice(2, 8))
    y[0, 2:] = 0.1
    y = np.vstack([y[:1], np.full((300, 8), np.nan), y[1:]])
    y[1:90, 0] = np.arange(89) * 0.06
    assert np.isfinite(fill_gaps(WAYS["by evidence"](), sequence(y), rng).y).all()
    with pytest.raises(ValueError, match="no angle was measured near a gap"):
        fill_gaps(WAYS["stride"](), sequence(blanked(y, 0, slice(2, 8))), rng)


def test_a_gap_in_which_the_models_poses_diverge_is_refused(rng):
    wild = replace(gait_model(), A=2.0 * gait_model().A)
    with pytest.raises(ValueError, match="poses grow without limit; give the frames after it a seq"):
        fill_gaps(Fillers(wild, None, 30.0), sequence(blanked(gait("walk", 90, rng), slice(20, 80))), rng)


def test_models_that_fill_no_gaps_are_refused(rng):
    nothing = sequence(np.full((4, 8), np.nan), "b")
    with pytest.raises(PosesError, match="sequence 'b' has no measured number"):
        fill_gaps(WAYS["switching"](), nothing, rng)
    with pytest.raises(ValueError, match="a hidden Markov model, which cannot interpolate"):
        fillers("hmm.npz", gait_hmm(), 30.0)


def test_a_file_that_is_named_as_the_shipped_stride_is_not_taken_for_it(tmp_path, monkeypatch):
    (tmp_path / "stride").write_text("how far I walked")
    monkeypatch.chdir(tmp_path)
    assert fillers("gait", gait_model(), 30.0).stride is not None


def test_the_shipped_stride_joins_the_shipped_gait_alone():
    both, one = (fillers(name, gait_model(), 30.0) for name in ("gait", "mine.npz"))
    assert both.stride is not None
    assert both.stride.names == POSE_COLUMNS
    assert one.stride is None
