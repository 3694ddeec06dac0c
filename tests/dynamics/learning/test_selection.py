"""Choosing order and states: the arithmetic by hand, then on data of a known kind."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from dynamics.learning import selection
from dynamics.learning.em import from_origin, learn
from dynamics.learning.options import Options
from dynamics.learning.selection import choose
from dynamics.viterbi import best_log_p_all, viterbi_all
from tests.oracles import random_slds, sample

LEARNT = {"names": ("a", "b"), "travelling": ("a",), "fps": 30.0}
GROUPS = ("p", "p", "q", "r", "r", "r")


def walks(rng, lengths=(12, 9, 15, 8, 10, 11)):
    """Sequences that wander, with a mark of their own in the first entry of the second freedom."""
    ys = [rng.normal(size=(T, 2)).cumsum(axis=0) for T in lengths]
    for n, y in enumerate(ys):
        y[0, 1] = float(n)
    return ys


def marks(ys):
    return {int(y[0, 1]) for y in ys}


def quick(**more):
    return Options(states=1, order=1, rounds=1, **more)


@pytest.fixture
def scored(monkeypatch):
    """Puts another score in the place of the likelihood of the best paths."""
    return lambda score: monkeypatch.setattr(selection, "best_log_p_all", score)


def scored_by(values):
    """A score that knows what every candidate gets on every sequence, by its number of states."""

    def score(slds, ys):
        return np.array([values[slds.K][int(y[0, 1])] for y in ys])

    return score


def test_every_group_is_scored_once_by_what_never_saw_it(scored, rng):
    ys, learnt, shown = walks(rng), [], []

    def infer(slds, sequences):
        learnt.append(marks(sequences))
        return viterbi_all(slds, sequences)

    def score(slds, sequences):
        shown.append(marks(sequences))
        return best_log_p_all(slds, sequences)

    scored(score)
    choose(ys, GROUPS, [quick()], folds=9, begin=lambda: infer, **LEARNT)
    assert shown == [{0, 1}, {2}, {3, 4, 5}]
    assert learnt == [{2, 3, 4, 5}, {0, 1, 3, 4, 5}, {0, 1, 2}]
    shown.clear()
    choose(ys, GROUPS, [quick()], folds=2, begin=lambda: infer, **LEARNT)
    assert shown == [{0, 1, 3, 4, 5}, {2}]


def test_values_are_the_likelihood_a_measured_frame_of_every_group(scored, rng):
    ys = walks(rng)
    ys[2][5:9] = np.nan  # 11 frames measured something
    ys[0][3, 0] = np.nan  # still 12
    values = {1: [24.0, 18.0, 33.0, 29.0, 29.0, 29.0]}
    scored(scored_by(values))
    best, found = choose(ys, GROUPS, [quick()], **LEARNT)
    assert_allclose(found, [[42.0 / 21.0, 3.0, 3.0]])
    assert best == quick()


def test_the_score_is_what_learning_on_the_others_gives_weighted_by_group(rng):
    ys = walks(rng)
    _, values = choose(ys, GROUPS, [replace(quick(), rounds=3)], folds=3, **LEARNT)
    weights = np.array([1.0 / 15.0, 1.0 / 29.0, 1.0 / 29.0, 1.0 / 29.0])
    options = replace(quick(), rounds=3)
    fit = learn(ys[2:], label="x", options=options, weights=weights, **LEARNT)
    held = [from_origin(y, ("a", "b"), ("a",)) for y in ys[:2]]
    want = sum(p.log_evidence for p in viterbi_all(fit.slds, held)) / 21.0
    assert values[0, 0] == pytest.approx(want, rel=1e-9)  # the same sums
    alike = learn(ys[2:], label="x", options=options, **LEARNT)
    assert abs(sum(best_log_p_all(alike.slds, held)) / 21.0 - want) > 1e-3


@pytest.mark.parametrize(
    ("small", "large", "best"),
    [
        # Hard and easy groups alike gain: the difference is sure though the means scatter.
        ((0.0, 5.0, 10.0), (0.5, 5.4, 10.6), 2),
        # One group gains and the others lose a little: not sure, so the simpler.
        ((0.0, 5.0, 10.0), (2.0, 4.9, 9.9), 1),
        # The simpler is better.
        ((1.0, 5.0, 10.0), (0.0, 4.9, 9.9), 1),
        # Exactly alike.
        ((0.0, 5.0, 10.0), (0.0, 5.0, 10.0), 1),
    ],
)
def test_the_simplest_within_a_standard_error_of_the_difference_is_taken(small, large, best, scored, rng):
    ys, groups = walks(rng, (5, 5, 5)), ("p", "q", "r")
    scored(scored_by({1: 5.0 * np.array(small), 2: 5.0 * np.array(large)}))
    for states in ((1, 2), (2, 1)):
        candidates = [replace(quick(), states=K) for K in states]
        assert choose(ys, groups, candidates, **LEARNT)[0].states == best


def test_of_equally_simple_candidates_the_likelier_is_taken(scored, rng):
    ys, groups = walks(rng, (5, 5, 5)), ("p", "q", "r")
    calls = iter([[0.0], [5.0], [10.0], [10.0], [4.0], [10.0]])
    candidates = [quick(seed=1), quick(seed=2)]
    scored(lambda slds, ys: np.array(next(calls)))
    assert choose(ys, groups, candidates, **LEARNT)[0] == candidates[1]


def test_two_oscillators_are_given_second_order_and_neither_one_state_nor_eight(rng):
    slds = random_slds(2, order=2, noise=0.05, stay=0.95, rng=rng)
    ys, groups = [sample(slds, 90, rng)[2][30:] for _ in range(12)], np.repeat(list("abcdef"), 2)
    sizes = ((2, 1), (1, 2), (2, 2), (8, 2))
    candidates = [Options(states=K, order=order, rounds=8, ridge=1e-3) for K, order in sizes]
    best, values = choose(ys, groups, candidates, names=slds.names, travelling=(), fps=30.0, folds=3)
    assert (best.states, best.order) == (2, 2)
    assert values[2].mean() > values[0].mean() + 0.1


def test_what_cannot_be_compared_is_named(rng):
    ys = walks(rng)
    with pytest.raises(ValueError, match="two folds and two groups at least; got 5 and 1"):
        choose(ys, ["p"] * 6, [quick()], **LEARNT)
    with pytest.raises(ValueError, match="two folds and two groups at least; got 1 and 3"):
        choose(ys, GROUPS, [quick()], folds=1, **LEARNT)
    with pytest.raises(ValueError, match="group 'q' measured nothing; leave it out"):
        choose([*ys[:2], np.full((9, 2), np.nan), *ys[3:]], GROUPS, [quick()], **LEARNT)
