"""What the program promises on the hand-marked open clips, with one set of settings for all."""

from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from tests.evaluate import Case, outcome
from tracker.compare import Score
from tracker.settings import Settings

Scores = dict[str, Score]


@pytest.fixture(scope="module")
def scores(data_dir: Path) -> dict[str, Scores]:
    """Scores by model and clip."""
    clips = sorted((data_dir / "video").glob("*.mp4"))
    cases = [Case(clip, model, Settings()) for model in ("walk-run", "cv") for clip in clips]
    with ProcessPoolExecutor(2) as pool:
        found = pool.map(outcome, cases)
    by_model: dict[str, Scores] = {"walk-run": {}, "cv": {}}
    for case, score in zip(cases, found, strict=True):
        by_model[case.model][case.clip.stem] = score
    return by_model


def test_the_learned_model_follows_at_least_seven_of_the_eight_clips(scores: dict[str, Scores]) -> None:
    followed = [clip for clip, score in scores["walk-run"].items() if score.first_failure_frame is None]
    assert len(scores["walk-run"]) == 8
    assert len(followed) >= 7, followed


def test_the_learned_model_holds_every_walk_within_a_tenth_of_a_leg(scores: dict[str, Scores]) -> None:
    walks = {clip: s.mean_error_leg for clip, s in scores["walk-run"].items() if "walk" in clip}
    assert len(walks) == 4
    assert max(walks.values()) <= 0.10, walks


def test_the_median_error_over_the_clips_is_at_most_seven_hundredths(scores: dict[str, Scores]) -> None:
    assert np.median([s.mean_error_leg for s in scores["walk-run"].values()]) <= 0.07


def test_the_learned_model_errs_at_most_three_fifths_as_much_as_constant_velocity(
    scores: dict[str, Scores],
) -> None:
    learned, cv = (np.mean([s.mean_error_leg for s in scores[name].values()]) for name in ("walk-run", "cv"))
    assert learned <= 0.6 * cv


def test_the_learned_model_outlives_constant_velocity_wherever_that_is_lost(
    scores: dict[str, Scores],
) -> None:
    for clip, rival in scores["cv"].items():
        lost = scores["walk-run"][clip].first_failure_frame
        if rival.first_failure_frame is not None:
            assert lost is None or lost > rival.first_failure_frame, clip
