"""The motion tasks on pose tables: what must not matter, what must stay, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.stats import norm

from dynamics.viterbi import viterbi
from kinematics.mocap import POSE_COLUMNS
from tests.tracker.gaits import NECK, OFFSET, STRIDES, blanked, both, gait, gait_hmm, gait_model, sequence
from tracker.motion.free_run import of_motion
from tracker.motion.tasks import Inference, Use, chosen_inference, forecast_all, label_all, whole_pose
from tracker.tables.poses import PosesError

SLDS_INFERENCES = [Inference.VITERBI, Inference.GPB2, Inference.VARIATIONAL]


@pytest.mark.parametrize("inference", Inference)
@pytest.mark.parametrize("order", [("walk", "run"), ("run", "walk")])
def test_a_change_of_motion_is_found_where_it_is(rng, inference, order):
    y, labels = both(rng, *order, noise=2.0)
    model = gait_hmm() if inference is Inference.HMM else gait_model()
    (found,) = label_all(model, [sequence(y + OFFSET)], inference=inference)
    assert np.mean(np.array(found.label) == np.array(labels)) > 0.93
    assert found.labels == ("walk", "run")
    assert found.prob.shape == (100, 2)
    assert_allclose(found.prob.sum(1), 1.0, atol=1e-9)


@pytest.mark.parametrize("use", Use)
def test_where_the_figure_stands_and_how_it_carries_its_head_do_not_matter(rng, use):
    y, _ = both(rng, frames=20)
    here, there = (
        label_all(gait_model(), [sequence(shifted)], inference=Inference.GPB2, use=use)[0]
        for shifted in (y, y + OFFSET)
    )
    # The place is taken off by a subtraction: rounding of 7 leg lengths, 1e-15, grows through the filter.
    assert_allclose(there.prob, here.prob, atol=1e-6)


def test_the_angles_alone_hear_of_the_root_only_which_way_it_goes(rng):
    y, _ = both(rng)
    wild = y.copy()
    wild[1:-1, :2] = rng.normal(size=(98, 2))
    one, other = label_all(gait_model(), [sequence(y), sequence(wild)], inference=Inference.GPB2)
    assert_array_equal(one.prob, other.prob)


@pytest.mark.parametrize("label", STRIDES)
def test_the_root_is_heard_where_it_is_used(rng, label):
    y = sequence(blanked(gait(label, 60, rng), slice(1, None), slice(2, None)))
    by_angles, by_all = (label_all(gait_model(), [y], inference=Inference.GPB2, use=use)[0] for use in Use)
    column = by_all.labels.index(label)
    assert by_all.prob[10:, column].mean() > 0.9
    doubt, less = (1.0 - found.prob[10:, column].mean() for found in (by_angles, by_all))
    assert less < 0.5 * doubt


def test_the_inference_must_fit_the_model():
    assert chosen_inference(gait_model(), None) is Inference.GPB2
    assert chosen_inference(gait_hmm(), None) is Inference.HMM
    for inference in SLDS_INFERENCES:
        assert chosen_inference(gait_model(), inference) is inference
        with pytest.raises(ValueError, match="hidden Markov model: it wants --inference hmm, not"):
            chosen_inference(gait_hmm(), inference)
    with pytest.raises(ValueError, match="it wants --inference viterbi, gpb2 or variational, not hmm"):
        chosen_inference(gait_model(), Inference.HMM)


def test_models_that_do_not_speak_of_the_table_are_refused(rng):
    renamed = (*POSE_COLUMNS[:-1], "tail")
    y = [sequence(gait("walk", 20, rng))]
    with pytest.raises(ValueError, match=r"of root_x, .*, tail; a pose .* a model of the figure walker"):
        whole_pose(replace(gait_model(), names=renamed), "predict")
    with pytest.raises(ValueError, match="a hidden Markov model, which cannot predict"):
        whole_pose(gait_hmm(), "predict")
    with pytest.raises(ValueError, match="a pose table has no tail"):
        label_all(replace(gait_hmm(), names=renamed[2:]), y, inference=Inference.HMM)
    with pytest.raises(ValueError, match="give --use angles"):
        label_all(gait_hmm(), y, inference=Inference.HMM, use=Use.ALL)


def test_sequences_that_say_nothing_of_a_motion_are_refused_by_name(rng):
    y = gait("walk", 20, rng)
    no_angles, no_root = (sequence(blanked(y, slice(None), columns), "b") for columns in (slice(2, 8), [1]))
    with pytest.raises(PosesError, match="sequence 'b' has no measured angle"):
        label_all(gait_model(), [sequence(y), no_angles], inference=Inference.GPB2)
    with pytest.raises(PosesError, match="--use all wants root_x and root_y, sequence 'b' lacks them"):
        label_all(gait_model(), [no_root], inference=Inference.GPB2, use=Use.ALL)
    nothing = [sequence(blanked(y, slice(None)), "b")]
    with pytest.raises(PosesError, match="sequence 'b' has no measured number"):
        forecast_all(gait_model(), nothing, 1)


def test_forecasts_follow_the_gait_and_its_place(rng):
    y = gait("walk", 80, rng) + OFFSET
    (found,) = forecast_all(gait_model(), [sequence(y)], 3)
    away = np.abs(found.mean[30:80] - y[30:])
    unchanged = np.abs(y[27:77] - y[30:])
    assert (away.mean(0)[4:] < 0.6 * unchanged.mean(0)[4:]).all()
    assert away[:, 0].mean() < 0.05
    assert away[:, NECK].mean() < np.radians(4.0)


def test_a_place_is_forecast_once_it_was_measured(rng):
    y = gait("walk", 40, rng)
    late = blanked(y, slice(0, 10), slice(0, 2))
    never = blanked(y, slice(None), slice(0, 2))
    one, other = forecast_all(gait_model(), [sequence(late), sequence(never)], 2)
    assert np.isnan(one.mean[:12, :2]).all()
    assert np.isfinite(one.mean[12:, :2]).all()
    assert np.isnan(other.mean[:, :2]).all()
    assert np.isfinite(other.mean[2:, 2:]).all()


@pytest.mark.parametrize("use", Use)
def test_who_goes_backwards_is_labelled_as_if_time_ran_back(rng, use):
    y, _ = both(rng)
    ahead, back = (
        label_all(gait_model(), [sequence(p)], inference=Inference.GPB2, use=use)[0] for p in (y, y[::-1])
    )
    # Another place is taken off: rounding, as above.
    assert_allclose(back.prob[::-1], ahead.prob, atol=1e-6)
    assert back.label[::-1] == ahead.label
    assert_array_equal(back.state[::-1], ahead.state)


def test_who_goes_backwards_is_forecast_so_once_the_frames_so_far_show_it(rng):
    y, other = gait("walk", 80, rng)[::-1], sequence(gait("walk", 40, rng))
    ys = y, y[:40], blanked(y, slice(None), 0)
    found, cut, unplaced = (forecast_all(gait_model(), [other, sequence(p)], 3)[1] for p in ys)
    away, ahead = (np.abs(f.mean[30:80] - y[30:])[:, 4:].mean() for f in (found, unplaced))
    assert away < 0.6 * ahead
    assert_allclose(found.mean[3:43], cut.mean[3:43], atol=1e-9)


def test_forecasts_learn_a_constant_difference_of_an_angle(rng, monkeypatch):
    y = gait("walk", 80, rng)
    y[:, POSE_COLUMNS.index("knee_far")] += np.radians(10.0)
    (found,) = forecast_all(gait_model(), [sequence(y)], 5)
    monkeypatch.setattr("tracker.motion.tasks.UNKNOWN_ANGLES", {})
    (without,) = forecast_all(gait_model(), [sequence(y)], 5)
    away, farther = (np.abs(f.mean[30:80] - y[30:])[:, 4:].mean() for f in (found, without))
    assert away < 0.8 * farther


def test_an_unknown_constant_is_integrated_out(rng):
    one = of_motion(gait_model(), "walk")
    one = replace(
        one, pi0=np.ones(1), Pi=np.ones((1, 1)), labels=("walk",),
        **{name: getattr(one, name)[:1] for name in ("A", "b", "Q", "mean0", "cov0")},
    )  # fmt: skip
    y, spread, step = gait("walk", 6, rng, noise=3.0), 0.2, 0.003
    y[:, NECK] += 0.1
    carried = np.eye(8)[NECK]
    offsets = np.arange(-0.6, 0.6, step)
    each = [viterbi(one, y - c * carried).log_evidence + norm.logpdf(c, scale=spread) for c in offsets]
    found = viterbi(one.with_constants({"neck": spread}), y).log_evidence
    # The evidence is a Gaussian of the constant, some steps wide: a sum over a grid is its integral.
    assert found == pytest.approx(np.logaddexp.reduce(each) + np.log(step), abs=1e-6)


def test_what_an_inference_has_no_use_for_is_refused():
    y = sequence(np.zeros((5, 8)))
    with pytest.raises(ValueError, match="variational inference labels by angles only"):
        label_all(gait_model(), [y], inference=Inference.VARIATIONAL, use=Use.ALL)
