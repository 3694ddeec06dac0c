"""The system's checks, the one-state rival, and systems made of others."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from dynamics.chain import blocks
from dynamics.kalman import predict
from dynamics.slds import combine, constant_velocity
from dynamics.viterbi import viterbi
from tests.oracles import random_slds, sample

NAMES = ("x", "hip")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"A": np.zeros((2, 3, 3))}, r"A must have shape \(2, 2, 2\); got \(2, 3, 3\)"),
        ({"R": np.full((2, 2), np.nan)}, "R must be finite; 4 entries are not"),
        ({"Pi": [[0.5, 0.5], [0.5, 0.6]]}, "Pi rows must be probabilities.*row 1 sums to 1.100000"),
        ({"Pi": [[1.5, -0.5], [0.5, 0.5]]}, "Pi rows must be probabilities.*row 0"),
        ({"pi0": [0.5, 0.4]}, "pi0 rows must be probabilities.*row 0 sums to 0.900000"),
        ({"labels": ("walk",)}, "every state needs a label; got 1 for 2 states"),
        ({"travelling": ("z",)}, r"travelling freedoms must be among \('a', 'b'\); got \('z',\)"),
        ({"fps": 0.0}, "fps must be positive; got 0.0"),
        ({"fps": float("nan")}, "fps must be positive; got nan"),
    ],
)
def test_what_does_not_fit_is_named(change, words, rng):
    slds = random_slds(2, rng=rng)
    with pytest.raises(ValueError, match=words):
        replace(slds, **change)


def test_logs_of_zero_probabilities_are_minus_infinity(rng):
    slds = replace(random_slds(2, rng=rng), Pi=[[1.0, 0.0], [0.5, 0.5]], pi0=[0.0, 1.0])
    assert_array_equal(slds.log_pi0, [-np.inf, 0.0])
    assert slds.log_Pi[0, 1] == -np.inf


# Constant velocity


def test_constant_velocitys_spread_is_that_of_the_first_velocity():
    slds = constant_velocity(NAMES, noise=[0.1, 0.2], spread=[0.5, 2.0], fps=30.0)
    velocity = np.hstack([np.eye(2), -np.eye(2)])
    assert_allclose(velocity @ slds.cov0[0] @ velocity.T, np.diag([0.25, 4.0]), atol=1e-15)  # one rounding
    assert_allclose(velocity @ slds.Q[0] @ velocity.T, np.diag([0.01, 0.04]), atol=1e-15)


# Models of several motions


def motions(rng):
    names = ("walk", "jog", "jump")
    return [
        replace(random_slds(K, order=2, rng=rng), labels=(label,) * K)
        for K, label in zip((2, 3, 1), names, strict=True)
    ]


def test_combined_motions_are_left_at_the_given_rate(rng):
    models = motions(rng)
    both = combine(models, crossing=0.05)
    assert both.labels == ("walk",) * 2 + ("jog",) * 3 + ("jump",)
    assert_array_equal(both.Pi, blocks([model.Pi for model in models], 0.05))


def test_combined_motions_begin_as_often_as_is_said(rng):
    models = motions(rng)
    both = combine(models, first=[0.9, 0.02, 0.08])
    assert_allclose(both.pi0, np.r_[0.9 * models[0].pi0, 0.02 * models[1].pi0, 0.08], rtol=1e-14)
    alike = combine(models)
    assert_allclose([alike.pi0[:2].sum(), alike.pi0[2:5].sum(), alike.pi0[5]], 1.0 / 3.0, rtol=1e-14)
    assert_array_equal(both.Pi, alike.Pi)


def test_combined_states_keep_their_own_dynamics(rng):
    models = motions(rng)
    both = combine(models)
    for name in ("A", "b", "Q", "mean0", "cov0"):
        assert_array_equal(getattr(both, name)[2:5], getattr(models[1], name))
        assert_array_equal(getattr(both, name)[5:], getattr(models[2], name))
    # R is a mean of three.
    assert_allclose(3.0 * both.R, sum(model.R for model in models), rtol=1e-14)


def test_one_model_combines_to_itself(rng):
    slds = random_slds(2, rng=rng)
    assert combine([slds]) is slds


def test_models_of_other_freedoms_or_rates_are_not_combined(rng):
    one = random_slds(2, order=2, rng=rng)
    unlike = ({"order": 1}, {"d": 3}, {"travelling": ("a",)})
    others = [random_slds(2, rng=rng, **({"order": 2} | more)) for more in unlike]
    for other in [*others, replace(one, fps=25.0)]:
        with pytest.raises(ValueError, match="must share freedoms, order and frame rate"):
            combine([one, other])


# Drifts


@pytest.mark.parametrize("order", [1, 2])
def test_drifting_freedoms_do_not_touch_the_others(order, rng):
    slds = random_slds(2, order=order, rng=rng)
    wide = slds.with_drifts(
        ("scale", "light"), np.array([1.0, 0.9]), np.array([0.01, 0.1]), np.array([1.0, 2.0])
    )
    assert wide.names == ("a", "b", "scale", "light")
    y = sample(slds, 12, rng)[2]
    narrow = viterbi(slds, y)
    got = viterbi(wide, np.hstack([y, rng.normal(size=(12, 2))]))
    N = order * 2
    assert_array_equal(got.path, narrow.path)
    # The same numbers in larger systems of equations.
    assert_allclose(got.states.mean[:, :N], narrow.states.mean, atol=1e-10)
    assert_allclose(got.states.cov[:, :N, :N], narrow.states.cov, atol=1e-10)
    assert_allclose(got.states.cov[:, :N, N:], 0.0, atol=1e-10)


def test_drifting_freedoms_follow_their_own_recursion(rng):
    persistence, noise, spread = np.array([0.9]), np.array([0.1]), np.array([2.0])
    wide = random_slds(2, order=2, rng=rng).with_drifts(("scale",), persistence, noise, spread)
    belief = wide.start
    assert_array_equal(belief.cov[:, 4, 4], 4.0)
    variance = 4.0
    for _ in range(5):
        belief = predict(belief, wide.A, wide.b, wide.Q)
        variance = 0.81 * variance + 0.01
        assert_allclose(belief.cov[:, 4, 4], variance, rtol=1e-12)  # a few roundings
        assert_array_equal(belief.mean[:, 4], 0.0)
    assert_array_equal(wide.C[2], [0.0, 0.0, 0.0, 0.0, 1.0])


@pytest.mark.parametrize("order", [1, 2])
def test_a_system_with_drifts_knows_its_order_and_its_place(order, rng):
    slds = random_slds(2, d=3, order=order, travelling=("a",), rng=rng)
    for n in (1, 2, 4):  # more drifts than a pose has freedoms, too
        wide = slds.with_drifts([f"drift {i}" for i in range(n)], np.ones(n), np.ones(n), np.ones(n))
        assert (wide.order, wide.layout.d, wide.layout.N) == (order, 3, wide.A.shape[-1])
        x = rng.normal(size=wide.layout.N)
        here = np.where(np.arange(len(x)) % 3 == 0, x[0], 0.0)
        here[order * 3 :] = 0.0
        assert_array_equal(wide.layout.from_here @ x, x - here)
        assert_array_equal(wide.travels, [True, False, False] + [False] * n)


@pytest.mark.parametrize("order", [1, 2])
def test_a_shift_is_measured_as_such_and_leaves_constants_alone(order, rng):
    slds = random_slds(2, order=order, rng=rng).with_constants({"b": 2.0})
    wide = slds.with_drifts(("scale",), np.ones(1), np.ones(1), np.ones(1))
    assert_array_equal(wide.C @ wide.shift, np.eye(3))
    assert_array_equal(wide.shift[order * 2], 0.0)
    if order == 2:  # both poses alike
        assert_array_equal(wide.shift[:2], wide.shift[2:4])


def test_a_state_of_no_known_layout_is_refused(rng):
    wide = random_slds(2, order=2, rng=rng).with_drifts(("scale",), np.ones(1), np.ones(1), np.ones(1))
    with pytest.raises(ValueError, match=r"1 or 2 poses of 3 freedoms and 0 that drift; it has 5 entries"):
        replace(wide, drifts=())


def test_no_constants_leave_a_system_as_it_is(rng):
    slds = random_slds(2, rng=rng)
    assert_array_equal(slds.with_constants({}).C, slds.C)
