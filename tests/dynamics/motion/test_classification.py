"""Classification against inference by a sum over all paths, plain inference and motions that are known."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.gpb2 import gpb2_all, switching_all
from dynamics.motion.noise import among_strangers, at_noise
from dynamics.motion.tasks import classify, classify_hmm
from dynamics.region import pose_hints
from dynamics.slds import combine
from dynamics.variational import variational_all
from dynamics.viterbi import viterbi_all
from tests.dynamics.hmms import enumerated as enumerated_hmm
from tests.dynamics.hmms import random_hmm
from tests.dynamics.motion.motions import named, settled, two_motions
from tests.oracles import enumerated, enumerated_all, log_density, random_slds, sample


def quiet(slds, T, rng):
    """A sequence of the model's own with nothing of its measurement noise, so that it keeps its own R."""
    return sample(slds, T, rng)[1] @ slds.C.T


def spoken_for(slds, y, weight):
    """(T, K) the pose's term by its definition: what of a and c was measured, b travels."""
    hints = np.zeros((len(y), slds.K))
    for t, k in product(range(len(y)), range(slds.K)):
        seen = [i for i in (0, 2) if not np.isnan(y[t, i])]
        if seen:
            mean, cov = slds.C @ slds.mean0[k], slds.C @ slds.cov0[k] @ slds.C.T + slds.R
            hints[t, k] = weight * log_density(y[t, seen], mean[seen], cov[np.ix_(seen, seen)])
    return hints


@pytest.mark.parametrize("weight", [None, 0.0, 2.0])
def test_motions_are_as_probable_as_their_states_together(weight, rng):
    slds = two_motions(rng)
    ys = [quiet(slds, T, rng) for T in (5, 1, 4)]
    ys[0][2, 0] = ys[2][1] = ys[2][:, 1] = np.nan
    options = {} if weight is None else {"pose": weight}
    got = classify(slds, ys, infer=enumerated_all, **options)
    noisy = among_strangers(at_noise(slds, ys))
    for y, labelling in zip(ys, got, strict=True):
        want = enumerated(noisy, y, spoken_for(noisy, y, 0.5 if weight is None else weight))
        shares = np.column_stack([want.prob[:, :2].sum(1), want.prob[:, 2]])
        assert_allclose(labelling.prob, shares, atol=1e-9)
        assert_allclose(labelling.prob.sum(1), 1.0, atol=1e-12)
        assert labelling.label == tuple(("walk", "run")[m] for m in shares.argmax(1))
        assert_array_equal(labelling.state, want.path)


def test_sequences_noisier_than_the_model_are_classified_with_their_noise(rng):
    slds = two_motions(rng, noise=0.05)
    ys = [
        y + [0.3, 0.0, 0.3] * rng.normal(size=y.shape) for y in (sample(slds, 30, rng)[2] for _ in range(6))
    ]
    noisy = at_noise(slds, ys)
    assert noisy.R[0, 0] > 10.0 * slds.R[0, 0]
    wide = among_strangers(noisy)
    plain = gpb2_all(wide, ys, [pose_hints(wide, y) for y in ys])
    for got, want in zip(classify(slds, ys), plain, strict=True):
        assert_allclose(got.prob[:, 1], want.prob[:, 2], atol=1e-11)
    assert np.abs(got.prob[:, 1] - gpb2_all(slds, ys)[-1].prob[:, 2]).max() > 0.01


@pytest.mark.parametrize("infer", [viterbi_all, switching_all, variational_all])
def test_a_walk_that_turns_into_a_run_is_told_from_it(infer, rng):
    walk, run = (settled(random_slds(1, noise=0.2, rng=rng)) for _ in range(2))
    run = settled(replace(run, b=run.b + np.array([1.0, -1.0]), R=walk.R))
    slds = combine([named(walk, "walk"), named(run, "run")], crossing=0.01)
    ys = [np.vstack([sample(one, 40, rng)[2] for one in pair]) for pair in ((walk, run), (run, walk))]
    for (first, second), got in zip(
        (("walk", "run"), ("run", "walk")), classify(slds, ys, infer=infer), strict=True
    ):
        assert got.labels == ("walk", "run")
        right = [label == want for label, want in zip(got.label, [first] * 40 + [second] * 40, strict=True)]
        # The two come to rest several deviations apart; around the join the model may be in doubt.
        assert all(right[:36] + right[44:])


def test_labels_of_a_hidden_markov_model_are_those_of_all_its_paths(rng):
    hmm = replace(random_hmm(3, rng), labels=("run", "walk", "run"))
    ys = [rng.normal(size=(T, 2)) for T in (5, 1)]
    ys[0][1] = ys[0][3, 0] = np.nan
    for y, labelling in zip(ys, classify_hmm(hmm, ys), strict=True):
        prob, _, _, path = enumerated_hmm(hmm, y)
        assert labelling.labels == ("run", "walk")
        assert_allclose(labelling.prob, np.column_stack([prob[:, 0] + prob[:, 2], prob[:, 1]]), atol=1e-12)
        assert labelling.label == tuple(("run", "walk")[m] for m in labelling.prob.argmax(1))
        assert_array_equal(labelling.state, path)
