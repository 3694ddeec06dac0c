"""What the learned models make of walks and runs on captures; docs/motion.md has all of it.

Splices and predictions are of the splices' six subjects, left out together; what is made is runs alone, by
that part of the same model.
"""

from pathlib import Path
from typing import Any

import pytest

from dynamics.slds import SLDS
from dynamics.store import Model
from tests.benchmarks.motion.ahead import SHARE, Forecast, Rival
from tests.benchmarks.motion.data import SPLICED, Job, Source, learn
from tests.benchmarks.motion.measure import run
from tests.benchmarks.motion.splices import FAR_TARGETS, TARGETS, Segmentation
from tests.benchmarks.motion.synthesis import RUN_STRIDE, Likeness, Making
from tracker.experiments.measures import rms
from tracker.experiments.study import Recipe
from tracker.motion.choices import Inference
from tracker.motion.free_run import of_motion

pytestmark = pytest.mark.claims

UNSEEN = Recipe(held=SPLICED)
RUNS = Recipe(held=SPLICED, motions=("run",))


@pytest.fixture(scope="module")
def source(data_dir: Path) -> Source:
    return Source(data_dir)


@pytest.fixture(scope="module")
def models(source: Source) -> dict[Recipe, Model]:
    """Without the six subjects: of walks and runs, and its part of runs."""
    both = learn(source, UNSEEN)
    assert isinstance(both, SLDS)
    return {UNSEEN: both, RUNS: of_motion(both, "run")}


@pytest.fixture(scope="module")
def measured(source: Source, models: dict[Recipe, Model]) -> dict[Job, Any]:
    """The answer of every job, of the models by the jobs' recipes."""
    jobs: list[Job] = [
        *(Segmentation(UNSEEN, noise, Inference.VITERBI) for noise in TARGETS),
        Forecast(UNSEEN, "run"),
        Rival("run", SPLICED),
        Making(RUNS, True),
    ]
    return {job: run(source, job, None if job.recipe is None else models[job.recipe]) for job in jobs}


@pytest.mark.parametrize("noise", TARGETS)
def test_motions_of_people_not_learned_from_are_told_apart_in_nearly_all_frames(
    measured: dict[Job, Any], noise: int
) -> None:
    wrong = measured[Segmentation(UNSEEN, noise, Inference.VITERBI)]
    assert wrong.all <= TARGETS[noise], wrong
    assert wrong.far <= FAR_TARGETS.get(noise, 100.0), wrong


def test_the_next_frame_of_a_run_is_foreseen_better_than_by_the_best_constant_velocity(
    measured: dict[Job, Any],
) -> None:
    best = measured[Rival("run", SPLICED)]
    assert 100.0 * rms(measured[Forecast(UNSEEN, "run")]) / rms(best.all) <= SHARE


def test_a_synthetic_run_stays_bounded_and_keeps_the_stride_of_the_captures(measured: dict[Job, Any]) -> None:
    made: Likeness = measured[Making(RUNS, True)]
    assert made.finite
    assert made.far_out == 0.0
    assert 100.0 * made.stride_error <= RUN_STRIDE, made
