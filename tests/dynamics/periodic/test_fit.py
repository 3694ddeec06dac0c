"""One stretch under a stride: its gradient by differences, the rest by a dense Gaussian written naively."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from dynamics.periodic import fit as fitting
from dynamics.periodic.fit import Stretch
from tests.dynamics.periodic.strides import M, Z, drawn, little, noisy
from tests.oracles import central_difference


@pytest.fixture
def to_the_end(monkeypatch):
    """The search goes on until nothing is gained."""
    monkeypatch.setattr(fitting, "ENOUGH", 1e-18)


@pytest.fixture
def stretch(rng):
    """Thirty frames of which some cells and eight whole frames were not measured."""
    stride = little(rng)
    t, y, phase = drawn(stride, 30, rng)
    y = noisy(stride, y, rng)
    y[12:20] = np.nan
    y[rng.random(y.shape) < 0.1] = np.nan
    return Stretch(stride, 0, t, y, noise=np.full(M, 1e-4)), float(np.interp(0.0, t, phase))


def prior(stretch):
    """Mean and covariance of z as the module's text has them."""
    stride, W = stretch.stride, stretch.moves.shape[1]
    cov = np.eye(Z + 1 + W)
    cov[:Z, :Z] = stride.root[0] @ stride.root[0].T
    cov[Z, Z], cov[Z + 1, Z + 1] = 100.0**2, 3.0**2
    return np.append(stride.mean[0], np.zeros(1 + W)), cov


def noise_and_residual(stretch, cells, measured):
    """Covariance between cells, one after the other."""
    stride, t = stretch.stride, stretch.t
    out = np.zeros((len(cells), len(cells)))
    for a, (f, i) in enumerate(cells):
        for b, (g, j) in enumerate(cells):
            for scale, S in ((0.1, stride.quick[0]), (0.4, stride.slow[0])):
                r = np.sqrt(3.0) * abs(t[f] - t[g]) / scale
                out[a, b] += (1.0 + r) * np.exp(-r) * S[i, j]
            if f == g and measured[a] and measured[b]:
                out[a, b] += stride.R[0, i, j] + (1e-4 if i == j else 0.0)
    return out


def dense(stretch, fit):
    """Log evidence of what was measured, and mean and covariance of every cell, linearised at the fit."""
    seen = list(zip(*stretch.cells, strict=True))
    every = [(f, i) for f in range(len(stretch.t)) for i in range(M)]
    cells = tuple(np.array(seen + every).T)
    f, J, _ = stretch.value(fit.z, fit.start, cells)
    m, P = prior(stretch)
    mean = f + J @ (m - fit.z)
    n = len(seen)
    cov = J @ P @ J.T + noise_and_residual(stretch, seen + every, [True] * n + [False] * len(every))
    away = stretch.y[stretch.cells] - mean[:n]
    _, log_det = np.linalg.slogdet(2.0 * np.pi * cov[:n, :n])
    evidence = -0.5 * (log_det + away @ np.linalg.solve(cov[:n, :n], away))
    gain = np.linalg.solve(cov[:n, :n], cov[:n, n:]).T
    return evidence, mean[n:] + gain @ away, cov[n:, n:] - gain @ cov[:n, n:]


def test_the_slope_of_what_is_measured_is_its_derivative(stretch, rng):
    stretch, start = stretch
    m, P = prior(stretch)
    z = m + 0.3 * np.sqrt(np.diag(P)) * rng.normal(size=len(m))
    z[Z] = 0.4
    _, J, _ = stretch.value(z, start, stretch.cells)
    want = central_difference(lambda z: stretch.value(z, start, stretch.cells)[0], z, step=1e-6)
    assert_allclose(J, want, atol=1e-7)


@pytest.mark.usefixtures("to_the_end")
def test_the_search_ends_where_no_step_is_more_probable(stretch):
    stretch, start = stretch
    fit = stretch.fit(start, 6.0, steps=60)
    m, P = prior(stretch)
    seen = list(zip(*stretch.cells, strict=True))
    C = noise_and_residual(stretch, seen, [True] * len(seen))

    def log_density(z):
        away = stretch.y[stretch.cells] - stretch.value(z, start, stretch.cells)[0]
        return -0.5 * (away @ np.linalg.solve(C, away) + (z - m) @ np.linalg.solve(P, z - m))

    deviation = np.sqrt(np.diag(fit.cov))
    for n in range(len(m)):
        step = 1e-3 * deviation[n] * np.eye(len(m))[n]
        slope = (log_density(fit.z + step) - log_density(fit.z - step)) / 2e-3
        # Gauss-Newton converges linearly here; a thousandth of a deviation is left.
        assert abs(slope) < 1e-3


@pytest.mark.usefixtures("to_the_end")
def test_evidence_and_poses_are_those_of_the_dense_gaussian(stretch):
    stretch, start = stretch
    fit = stretch.fit(start, 6.0, steps=60)
    evidence, mean, cov = dense(stretch, fit)
    # The place's variance of 1e4 beside 1e-4 of the noise costs eight digits.
    assert fit.log_evidence == pytest.approx(evidence, abs=1e-4)
    T = len(stretch.t)
    got = fit.predict(np.arange(T))
    assert_allclose(got.mean, mean.reshape(T, M), atol=1e-5)
    blocks = cov.reshape(T, M, T, M)[np.arange(T), :, np.arange(T)]
    assert_allclose(got.cov, blocks, atol=1e-6)


def test_time_beside_the_frames_measured_does_not_matter_to_the_evidence(stretch, rng):
    stretch, start = stretch
    t = np.append(stretch.t, stretch.t[-1] + 0.1)
    longer = Stretch(stretch.stride, 0, t, np.vstack([stretch.y, np.full(M, np.nan)]), stretch.noise)
    one, other = (s.fit(start, 6.0).log_evidence for s in (stretch, longer))
    # The drift keeps its principal components over other frames.
    assert one == pytest.approx(other, abs=0.05)
