"""The M-step with exact posteriors: no round lowers the evidence, and each parameter is at a maximum."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from dynamics.learning.mstep import maximise
from dynamics.learning.options import Options
from dynamics.learning.prior import data_prior, log_prior
from dynamics.viterbi import viterbi_all
from tests.dynamics.learning.systems import FIELDS, drawn
from tests.oracles import central_difference, enumerated_all, expected_log_joint, random_slds, sum_over_paths


def setting(order, travelling, rng, *, prior, K=2, lengths=(5, 4, 5)):
    """A system, sequences from another one, and what `maximise` needs."""
    slds = random_slds(K, order=order, travelling=travelling, rng=rng)
    ys = drawn(random_slds(K, order=order, travelling=travelling, rng=rng), lengths, rng)
    return slds, ys, data_prior(ys, slds.layout, Options(states=K, order=order, prior=prior))


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("travelling", [(), ("a",)])
def test_a_round_with_exact_posteriors_never_lowers_the_evidence(order, travelling, rng):
    # Order 2 needs more steps than coefficients, or maximum likelihood fits some exactly.
    lengths = (5, 6, 5) if order == 1 else (6, 6, 6, 6, 6)
    slds, ys, prior = setting(order, travelling, rng, prior=0.0, lengths=lengths)
    values = [sum(sum_over_paths(slds, y) for y in ys)]
    for _ in range(3):
        slds = maximise(slds, ys, enumerated_all(slds, ys), prior, np.ones(len(ys)))
        values.append(sum(sum_over_paths(slds, y) for y in ys))
    # Rounding in sums of log-likelihoods near 100.
    assert np.diff(values).min() > -1e-8
    assert values[-1] > values[0] + 1.0


@pytest.mark.parametrize(
    ("order", "travelling", "prior"),  # every pair of values
    [(1, (), 0.0), (2, (), 1.0), (1, ("a",), 1.0), (2, ("a",), 0.0)],
)
def test_the_m_step_is_a_maximum_of_the_expected_log_joint_plus_log_prior(order, travelling, prior, rng):
    lengths = (6, 6, 6, 6)
    slds, ys, priors = setting(order, travelling, rng, prior=prior, lengths=lengths)
    weights = np.array([1.0, 0.5, 2.0, 1.0])
    posteriors = enumerated_all(slds, ys)
    best = maximise(slds, ys, posteriors, priors, weights)

    def value(system):
        return expected_log_joint(system, ys, posteriors, weights) + log_prior(system, priors)

    d = len(slds.names)
    for name in FIELDS:
        there = getattr(best, name)
        direction = rng.normal(size=there.shape)
        if name in ("pi0", "Pi"):  # rows keep summing to one
            direction = there * (direction - (there * direction).sum(-1, keepdims=True))
        if name in ("Q", "R", "cov0"):  # positive definite in proportion to what is there
            direction = there @ direction @ there
            direction = 0.5 * (direction + np.swapaxes(direction, -1, -2))
        if name == "A":  # what the form leaves free
            direction[:, d:] = 0.0
            direction[:, :d] = rng.normal(size=(slds.K, d, len(slds.layout.regard))) @ slds.layout.regard
        if name == "b":
            direction[:, d:] = 0.0
        direction /= np.abs(direction).max() / np.abs(there).max()

        def along(step, name=name, there=there, direction=direction):
            return value(replace(best, **{name: there + float(step) * direction}))

        slope = central_difference(along, np.array(0.0), step=1e-5)
        bend = (along(1e-3) - 2.0 * along(0.0) + along(-1e-3)) / 1e-6
        assert bend < 0.0, name
        # Of a parabola of this bend, a slope of 1e-4 bend means 1e-4 of the parameter away from its top;
        # differences of values near 100 over 1e-5 are exact to 1e-8.
        assert abs(slope[0]) < 1e-6 + 1e-5 * abs(bend), name


@pytest.mark.parametrize("prior", [0.0, 1.0])
def test_a_state_that_is_never_entered_stays_finite(prior, rng):
    slds, ys, priors = setting(2, ("a",), rng, prior=prior, K=3, lengths=(30, 30))
    ring = np.array([[0.7, 0.3, 0.0], [0.3, 0.7, 0.0], [0.0, 0.0, 1.0]])
    slds = replace(slds, Pi=ring, pi0=[0.5, 0.5, 0.0])
    fitted = maximise(slds, ys, viterbi_all(slds, ys), priors, np.ones(2))
    assert np.linalg.eigvalsh(fitted.Q[:, :2, :2]).min() > 0.0
    if prior == 0.0:  # nothing was learnt about it
        for name in ("A", "b", "Q", "mean0", "cov0"):
            assert_array_equal(getattr(fitted, name)[2], getattr(slds, name)[2])
