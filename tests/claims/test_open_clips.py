"""What the program promises on the hand-marked open clips, with one set of settings for all."""

from pathlib import Path

import numpy as np
import pytest

from tests.benchmarks.evaluation.cases import Case, Ours, outcome
from tests.benchmarks.processes import spawned
from tracker.run.score import Score

pytestmark = pytest.mark.claims

Scores = dict[str, Score]


@pytest.fixture(scope="module")
def scores(data_dir: Path) -> dict[str, Scores]:
    """Scores by model and clip."""
    clips = sorted((data_dir / "video").glob("*.mp4"))
    by_model: dict[str, Scores] = {"walk-run": {}, "cv": {}}
    cases = [(model, Case(clip, Ours(model))) for model in by_model for clip in clips]
    with spawned() as pool:
        found = pool.map(outcome, [case for _, case in cases])
    for (model, case), result in zip(cases, found, strict=True):
        by_model[model][case.clip.stem] = result.score
    return by_model


def test_the_learned_model_follows_all_eight_clips(scores: dict[str, Scores]) -> None:
    followed = [clip for clip, score in scores["walk-run"].items() if score.first_failure_frame is None]
    assert len(scores["walk-run"]) == len(followed) == 8, followed


def test_legs_are_never_exchanged(scores: dict[str, Scores]) -> None:
    assert {clip: s.swaps for clip, s in scores["walk-run"].items() if s.swaps} == {}


def test_every_walk_is_held_within_a_twentieth_of_a_leg_and_every_run_within_seven_hundredths(
    scores: dict[str, Scores],
) -> None:
    errors = {clip: s.mean_error_leg for clip, s in scores["walk-run"].items()}
    assert max(error for clip, error in errors.items() if "walk" in clip) <= 0.05, errors
    assert max(error for clip, error in errors.items() if "walk" not in clip) <= 0.07, errors


def test_the_learned_model_errs_less_than_constant_velocity_at_the_noise_that_is_best_on_these_clips(
    scores: dict[str, Scores],
) -> None:
    learned, cv = (np.mean([s.mean_error_leg for s in scores[name].values()]) for name in ("walk-run", "cv"))
    assert learned <= 0.9 * cv


def test_the_learned_model_outlives_constant_velocity_wherever_that_is_lost(
    scores: dict[str, Scores],
) -> None:
    for clip, rival in scores["cv"].items():
        lost = scores["walk-run"][clip].first_failure_frame
        if rival.first_failure_frame is not None:
            assert lost is None or lost > rival.first_failure_frame, clip
