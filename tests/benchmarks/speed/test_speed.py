"""The limits on speed, and that the baselines do the same work."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from dynamics.viterbi import viterbi
from tests.benchmarks.speed import rivals
from tests.benchmarks.speed.measure import FILTER_LIMITS, ROUND_LIMITS, STATES
from tests.oracles import random_slds

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def tables():
    """The benchmark's numbers, from a process of its own, which alone can say how many threads it takes."""
    for name in ("filterpy", "hmmlearn", "pykalman"):
        pytest.importorskip(name)
    command = [sys.executable, "-m", "tests.benchmarks.speed", "--json"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


@pytest.mark.speed
@pytest.mark.parametrize("K", STATES)
@pytest.mark.parametrize("name", FILTER_LIMITS)
def test_a_filter_is_so_many_times_as_fast_as_an_imm(name, K, tables):
    fast = 1.0 / tables["filters"][str(K)][name]["ratio"]
    assert fast >= FILTER_LIMITS[name][STATES.index(K)]


@pytest.mark.speed
@pytest.mark.parametrize("name", FILTER_LIMITS)
def test_a_filters_cost_grows_no_faster_than_the_square_of_the_states(name, tables):
    few, many = (tables["filters"][str(K)][name]["microseconds"] for K in (STATES[0], STATES[-1]))
    assert many / few <= (STATES[-1] / STATES[0]) ** 2


@pytest.mark.speed
@pytest.mark.parametrize("name", ROUND_LIMITS)
def test_an_em_round_takes_no_more_than_so_many_one_state_loops(name, tables):
    assert tables["rounds"][name]["ratio"] <= ROUND_LIMITS[name]


@pytest.fixture
def one_state(rng):
    slds = random_slds(1, d=3, order=2, rng=rng)
    return slds, slds.sample(20, rng)[2]


def test_the_one_state_loop_does_what_inference_does(one_state):
    slds, y = one_state
    mean, cov, lag, log_p = rivals.one_state_loop(slds, y)
    got = viterbi(slds, y)
    # Ours raises predicted covariances by 1e-12 of their size; the inverse may be 1e3 larger.
    assert_allclose(got.states.mean, mean, atol=1e-9)
    assert_allclose(got.states.cov, cov, atol=1e-9)
    assert_allclose(got.lag, lag, atol=1e-9)
    assert got.log_evidence == pytest.approx(log_p, rel=1e-11)


def test_the_rivals_filter_the_same_system(one_state):
    slds, y = one_state
    want = viterbi(slds, y).states[-1]  # the last frame is filtered and smoothed at once
    pytest.importorskip("filterpy")
    pytest.importorskip("pykalman")
    filterpy, (mean, cov) = rivals.filterpy_one_state(slds, y), rivals.pykalman_one_state(slds, y)
    for got, P in ((filterpy.x, filterpy.P), (mean[-1], cov[-1])):
        assert_allclose(got, want.mean, atol=1e-10)  # the same sums, otherwise ordered
        assert_allclose(P, want.cov, atol=1e-10)


def test_the_imm_has_settled_on_the_state_that_made_the_data(rng):
    pytest.importorskip("filterpy")
    slds = random_slds(4, d=8, order=2, rng=rng)
    s, _, y = slds.sample(60, rng)
    imm = rivals.filterpy_imm(slds, y)
    assert np.isfinite(imm.x).all()
    assert imm.mu.argmax() == s[-1]
