"""The tracker's belief: what it proposes, what it drops, what it amounts to."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.belief import Belief, either, first_belief, propose, together
from dynamics.gaussian import Gaussian
from tests.oracles import assert_gaussian, enumerated, mixture, random_covariance, random_slds, sample


def some_belief(slds, s, rng):
    N = slds.A.shape[-1]
    states = Gaussian(rng.normal(size=(len(s), N)), np.stack([random_covariance(N, rng) for _ in s]))
    return Belief(
        states, rng.uniform(0.0, 5.0, size=len(s)), np.array(s), np.zeros(len(s), dtype=int), np.ones(len(s))
    )


def test_the_first_belief_is_the_exact_posterior_of_one_frame(rng):
    slds, R = random_slds(3, order=2, rng=rng), random_covariance(2, rng)
    y = sample(slds, 1, rng)[2]
    exact = enumerated(replace(slds, R=R), y)
    belief = first_belief(slds, y[0], R)
    # Condition numbers below 1e3.
    assert_allclose(belief.weights, exact.prob[0], atol=1e-11)
    assert_gaussian(belief.states, exact.starts, atol=1e-11)
    assert belief.best == exact.path[0]
    assert_gaussian(belief.merged(), exact.states[0], atol=1e-11)


def test_a_first_pose_that_is_unknown_leaves_the_prior(rng):
    slds = random_slds(3, rng=rng)
    belief = first_belief(slds, np.full(2, np.nan), np.eye(2))
    assert_array_equal(belief.states.mean, slds.mean0)
    assert_allclose(belief.states.cov, slds.cov0, rtol=1e-15)  # made symmetric again
    assert_allclose(belief.weights, slds.pi0, rtol=1e-12)  # through logarithms and back


@pytest.mark.parametrize("s", [(0, 1, 2), (2, 0), (1,), (0, 0, 2, 1, 2)])
def test_every_state_is_proposed_from_its_best_predecessor(s, rng):
    slds = random_slds(3, order=2, rng=rng)
    belief = some_belief(slds, s, rng)
    got = propose(slds, belief, prune=np.inf, most=9)
    assert_array_equal(got.s, [0, 1, 2])
    for j in range(3):
        costs = [belief.cost[h] - np.log(slds.Pi[i, j]) for h, i in enumerate(s)]
        h = int(np.argmin(costs))
        assert got.cost[j] == pytest.approx(costs[h], rel=1e-14)
        assert got.parent[j] == h
        # A product of matrices with entries near 1.
        assert_allclose(got.states.mean[j], slds.A[j] @ belief.states.mean[h] + slds.b[j], atol=1e-12)
        want = slds.A[j] @ belief.states.cov[h] @ slds.A[j].T + slds.Q[j]
        assert_allclose(got.states.cov[j], want, atol=1e-12)


@pytest.mark.parametrize("keep", [1, 2, 3, 4])
@pytest.mark.parametrize("by", ["cost", "number"])
def test_only_the_cheapest_are_proposed(by, keep, rng):
    slds = random_slds(4, rng=rng)
    belief = some_belief(slds, (0, 1, 2, 3), rng)
    everything = propose(slds, belief, prune=np.inf, most=7)
    assert_array_equal(everything.s, np.arange(4))
    dearer = np.append(np.sort(everything.cost) - everything.cost.min(), np.inf)
    between = 0.5 * (dearer[keep - 1] + dearer[keep])
    got = propose(slds, belief, prune=between if by == "cost" else np.inf, most=9 if by == "cost" else keep)
    want = everything.at(np.sort(np.argsort(everything.cost)[:keep]))
    for name in ("s", "parent", "cost"):
        assert_array_equal(getattr(got, name), getattr(want, name))
    assert_array_equal(got.states.mean, want.states.mean)
    assert_array_equal(got.states.cov, want.states.cov)
    assert len(propose(slds, belief, prune=0.0, most=9).s) == 1


def test_a_state_that_cannot_be_reached_is_not_proposed(rng):
    slds = replace(random_slds(3, rng=rng), Pi=[[0.5, 0.5, 0.0], [0.5, 0.5, 0.0], [0.0, 0.0, 1.0]])
    got = propose(slds, some_belief(slds, (0, 1), rng), prune=1e9, most=9)
    assert_array_equal(got.s, [0, 1])


def test_levelled_the_best_costs_nothing_and_all_weigh_what_they_did(rng):
    belief = some_belief(random_slds(3, rng=rng), [0, 1, 2], rng)
    levelled = belief.levelled()
    assert levelled.cost.min() == 0.0
    assert_allclose(levelled.weights, belief.weights, rtol=1e-12)
    assert levelled.states is belief.states


def test_only_differences_of_cost_matter(rng):
    belief = some_belief(random_slds(3, rng=rng), (0, 1, 2), rng)
    dear = replace(belief, cost=belief.cost + 1e5)
    assert_allclose(dear.weights, belief.weights, atol=1e-10)  # 1e5 keeps eleven digits behind the point
    assert dear.best == belief.best == int(np.argmax(belief.weights))
    far = replace(belief, cost=np.array([0.0, 1e5, np.inf]))
    assert_array_equal(far.weights, [1.0, 0.0, 0.0])


def test_hypotheses_stand_one_after_another_and_are_taken_by_position(rng):
    slds = random_slds(3, rng=rng)
    first, second = some_belief(slds, [0, 1, 2], rng), some_belief(slds, [2], rng)
    both = together([first, second])
    for one, positions in ((first, [0, 1, 2]), (second, [3])):
        some = both.at(positions)
        for name in ("cost", "s", "parent"):
            assert_array_equal(getattr(some, name), getattr(one, name))
        assert_array_equal(some.states.mean, one.states.mean)
        assert_array_equal(some.states.cov, one.states.cov)


def test_of_measurements_that_exclude_each_other_each_hypothesis_is_the_mixture(rng):
    slds = random_slds(2, rng=rng)
    first = some_belief(slds, [0, 1], rng)
    second = replace(some_belief(slds, [0, 1], rng), s=first.s, parent=first.parent)
    one = either([first, second])
    weight = np.exp(-np.column_stack([first.cost, second.cost]))
    assert_allclose(np.exp(-one.cost), weight.sum(1), rtol=1e-12)
    for h, share in enumerate(weight / weight.sum(1, keepdims=True)):
        means, covs = zip(*((b.states.mean[h], b.states.cov[h]) for b in (first, second)), strict=True)
        want = mixture(share, means, covs)
        assert_allclose(one.states.mean[h], want.mean, rtol=1e-12)
        assert_allclose(one.states.cov[h], want.cov, atol=1e-12)
    assert_array_equal(one.s, [0, 1])


def test_a_measurement_that_cannot_be_changes_nothing(rng):
    slds = random_slds(2, rng=rng)
    first = some_belief(slds, [0, 1], rng)
    never = replace(some_belief(slds, [0, 1], rng), cost=np.full(2, 1e4))
    one = either([first, never])
    assert_allclose(one.states.mean, first.states.mean, rtol=1e-12)
    assert_allclose(one.states.cov, first.states.cov, rtol=1e-12)
    assert_allclose(one.cost, first.cost, rtol=1e-12)
