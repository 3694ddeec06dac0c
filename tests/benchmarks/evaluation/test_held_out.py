"""Settings held out: no clip has a say in what it is followed with."""

import numpy as np
import pytest

from tests.benchmarks.evaluation.held_out import tune
from tests.benchmarks.evaluation.outcomes import outcome


def results(table):
    """Outcomes by values, from mean errors (clips) by values."""
    return {values: [outcome(mean) for mean in means] for values, means in table.items()}


def test_what_is_best_on_all_clips_is_tuned():
    tuned = tune(results({(1,): [0.3, 0.3, 0.3], (2,): [0.1, 0.2, 0.5]}))
    assert tuned.best == (2,)
    assert [found.score.mean_error_leg for found in tuned.tuned] == [0.1, 0.2, 0.5]


def test_a_clip_that_alone_makes_a_value_the_best_does_not_get_it():
    # Without the first clip, (1,) is better; the others still choose (2,) by it.
    tuned = tune(results({(1,): [0.9, 0.2, 0.2], (2,): [0.1, 0.3, 0.3]}))
    assert tuned.best == (2,)
    assert tuned.chosen == [(1,), (2,), (2,)]
    assert [found.score.mean_error_leg for found in tuned.held_out] == [0.9, 0.3, 0.3]
    assert tuned.ratio == pytest.approx(1.5 / 0.7)


def test_held_out_choices_are_those_of_a_search_clip_by_clip(rng):
    means = {(i,): rng.uniform(size=6) for i in range(12)}
    tuned = tune(results(means))
    for clip, values in enumerate(tuned.chosen):
        others = {key: np.delete(row, clip).sum() for key, row in means.items()}
        assert others[values] == min(others.values())


def test_one_clip_leaves_nothing_to_choose_by():
    with pytest.raises(ValueError, match="two at least"):
        tune(results({(1,): [0.1]}))
