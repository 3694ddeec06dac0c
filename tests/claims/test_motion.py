"""What the learned models make of walks and runs on captures; docs/motion.md has all of it.

Splices and predictions are of the splices' six subjects, left out together, predictions of segments
that are not mirrored; what is made is runs alone, by that part of the same model.
"""

import pytest

from dynamics.slds import SLDS
from tests.benchmarks.motion.ahead import SHARE, best_rival, errors
from tests.benchmarks.motion.data import SPLICED, learn, straight
from tests.benchmarks.motion.splices import FAR_TARGETS, TARGETS, Segmentation
from tests.benchmarks.motion.synthesis import RUN_STRIDE, Making
from tracker.experiments.measures import rms
from tracker.experiments.study import Recipe
from tracker.motion.choices import Inference
from tracker.motion.free_run import of_motion

pytestmark = pytest.mark.claims

UNSEEN = Recipe(held=SPLICED)
RUNS = Recipe(held=SPLICED, motions=("run",))


@pytest.fixture(scope="module")
def model(data_dir):
    """Of walks and runs, without the six subjects."""
    both = learn(data_dir, UNSEEN)
    assert isinstance(both, SLDS)
    return both


@pytest.mark.parametrize("noise", TARGETS)
def test_motions_of_people_not_learned_from_are_told_apart_in_nearly_all_frames(data_dir, model, noise):
    wrong = Segmentation(UNSEEN, noise, Inference.VITERBI).run(data_dir, model)
    assert wrong.all <= TARGETS[noise], wrong
    assert wrong.far <= FAR_TARGETS.get(noise, 100.0), wrong


def test_the_next_frame_of_a_run_is_foreseen_better_than_by_the_best_constant_velocity(data_dir, model):
    runs = straight(data_dir, "run", SPLICED)[::2]  # without their mirror images
    assert 100.0 * rms(errors(model, runs)) / rms(best_rival(runs).all) <= SHARE


def test_a_synthetic_run_stays_bounded_and_keeps_the_stride_of_the_captures(data_dir, model):
    made = Making(RUNS, True).run(data_dir, of_motion(model, "run"))
    assert made.finite
    assert made.far_out == 0.0
    assert 100.0 * made.stride_error <= RUN_STRIDE, made
