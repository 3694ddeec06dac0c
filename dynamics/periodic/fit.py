"""Fitting one motion of a harmonic stride to one stretch of gait.

The unknowns of the stretch are one vector z = [c, omega, travel, place, phase shift, bend, drift] with a
Gaussian prior. The measurements, f(z) and noise, are nonlinear in z through the phase only, so the most
probable z is found by Gauss-Newton steps, and the rest is one linear Gaussian conditioning at that z:
with L L' the covariance of residual and noise over the measured cells, J = df/dz and P the prior's
precision,

    e = L^-1 (y - f(z)),  A = L^-1 J,  Cov(z) = (P + A'A)^-1
    log p(y) = -(e'e + (z - m)' P (z - m) + log |2 pi L L'| + log |P + A'A| - log |P|) / 2,

Laplace's approximation, exact where the phase is known.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import block_diag, cho_factor, cho_solve, cholesky, solve_triangular

from dynamics.gaussian import LOG_2PI, Array, Gaussian, Ints, measured_mean, symmetric
from dynamics.stride import DRIFTING, QUICK, SLOW, Stride, harmonics, slopes

Cells = tuple[Ints, Ints]  # frame and freedom of each measured number

ANYWHERE = 100.0  # prior standard deviation of the place of a freedom that travels, body units
SHIFT = 3.0  # prior standard deviation of the phase about a start, radians
DRIFTS = 12  # largest number of principal components of the drift that are kept
NEGLIGIBLE = 1e-3  # components of the drift with a smaller share of the greatest variance are left out
NOTHING = 1e-12  # variance of the phase that counts as none, radians squared
STEPS = 8
ENOUGH = 1e-3  # gain of a step in nats that ends the search
SHORTEN = 4  # halvings of a step that does not rise


def matern(lag: Array, scale: float) -> Array:
    """Matern correlation of smoothness 3/2."""
    r = np.sqrt(3.0) * np.abs(lag) / scale
    return np.asarray((1.0 + r) * np.exp(-r))


@dataclass(frozen=True)
class Fit:
    """The most probable z of a stretch from one start, and Laplace's approximation about it.

    stretch      : what was fitted
    z            : (Z + W,) the unknowns
    start        : phase at t = 0 before the phase shift is added, radians
    factor       : Cholesky factor of P + A'A, as `scipy.linalg.cho_factor` gives it
    white, slope : e (n,) and A (n, Z + W) of the n measured cells
    phase        : (T,) phase of every frame, radians
    log_evidence : nats
    """

    stretch: "Stretch"
    z: Array
    start: float
    factor: tuple[Array, bool]
    white: Array
    slope: Array
    phase: Array
    log_evidence: float

    @cached_property
    def cov(self) -> Array:
        """(Z + W, Z + W) covariance of z."""
        return np.asarray(cho_solve(self.factor, np.eye(len(self.z))))

    def climbed(self) -> "Fit":
        """The search continued from where it ended."""
        return self.stretch.climb(self.z, self.start, STEPS)

    def given(self, y: Array, noise: Array | float = 0.0) -> "Fit":
        """The search continued with other measurements and noise for the same frames, as in `Stretch`."""
        own = self.stretch
        return Stretch(own.stride, own.k, own.t, y, noise).climb(self.z, self.start, STEPS)

    def predict(self, rows: Ints) -> Gaussian:
        """mean (m, M) and cov (m, M, M) of these frames' poses given all measurements, without noise."""
        own, stride = self.stretch, self.stretch.stride
        M = len(stride.names)
        cells = np.repeat(rows, M), np.tile(np.arange(M), len(rows))
        f, J, _ = own.value(self.z, self.start, cells)
        cross = solve_triangular(own.L, own.residual(own.cells, cells), lower=True, check_finite=False)
        mean = (f + cross.T @ self.white).reshape(-1, M)
        away = J - cross.T @ self.slope
        tied = cross.T.reshape(len(rows), M, -1)
        spread = solve_triangular(self.factor[0], away.T, lower=True).T.reshape(len(rows), M, -1)
        cov = stride.quick[own.k] + stride.slow[own.k] - tied @ tied.swapaxes(1, 2)
        return Gaussian(mean, symmetric(cov + spread @ spread.swapaxes(1, 2)))


class Stretch:
    """The frames of one stretch, t (T,) seconds and y (T, M), NaN where not measured, under motion k.

    noise (M,) is a variance added to R. In z, the phase speed stands at `speed`, the phase shift at `shift`,
    the bend and the drift after it.
    """

    def __init__(self, stride: Stride, k: int, t: Array, y: Array, noise: Array | float = 0.0) -> None:
        self.stride, self.k, self.t, self.y, self.noise = stride, k, t, y, noise
        self.R = stride.R[k] + np.diag(np.broadcast_to(noise, len(stride.names)))
        frame, freedom = np.nonzero(np.isfinite(y))
        self.cells: Cells = frame, freedom
        self.travels = np.flatnonzero(stride.travels)
        self.Z, self.speed = stride.mean.shape[1], len(stride.names) * stride.basis
        self.shift = self.Z + len(self.travels)
        self.moves = self._shapes()
        # The prior mean of z, and the prior variances of its entries after the Z of the population.
        more = self.moves.shape[1] - 1
        self.variances = np.append(np.full(len(self.travels), ANYWHERE**2), [SHIFT**2, *np.ones(more)])
        self.mean = np.append(stride.mean[k], np.zeros(len(self.variances)))
        noise_between = _spread(self.correlations[2], self.R, self.cells, self.cells)
        self.L = cholesky(self.residual(self.cells, self.cells) + noise_between, lower=True)

    @cached_property
    def precision(self) -> Array:
        """(Z + W, Z + W) prior precision of z."""
        population = cho_solve((self.stride.root[self.k], True), np.eye(self.Z))
        return np.asarray(block_diag(population, np.diag(1.0 / self.variances)))

    @cached_property
    def _constant(self) -> float:
        """Log determinants that do not depend on z: -log |2 pi L L'| / 2 + log |P| / 2."""
        spread = np.log(np.diag(self.stride.root[self.k])).sum() + 0.5 * np.log(self.variances).sum()
        return float(-np.log(np.diag(self.L)).sum() - 0.5 * len(self.L) * LOG_2PI - spread)

    @cached_property
    def correlations(self) -> Array:
        """(3, T, T) correlations over time of the quick residual, the slow residual and the noise."""
        lag = self.t[:, None] - self.t
        return np.stack([matern(lag, QUICK), matern(lag, SLOW), np.eye(len(lag))])

    def residual(self, one: Cells, other: Cells) -> Array:
        """(n, m) covariance of the residual between cells, without the noise."""
        quick = _spread(self.correlations[0], self.stride.quick[self.k], one, other)
        return quick + _spread(self.correlations[1], self.stride.slow[self.k], one, other)

    def value(self, z: Array, start: float, cells: Cells) -> tuple[Array, Array, Array]:
        """The pose f (n,) predicted at cells, df/dz (n, Z + W), and the phase (T,), `start` included."""
        frame, freedom = cells
        stride, M = self.stride, len(self.stride.names)
        size, rows = stride.basis, np.arange(len(frame))
        c = z[: M * size].reshape(M, size)
        speed = self.speed
        phase = start + z[speed] * self.t + self.moves @ z[self.shift :]
        basis = harmonics(phase, size)[frame]
        turn = (slopes(phase, size)[frame] * c[freedom]).sum(1)
        J = np.zeros((len(frame), len(z)))
        J[rows[:, None], freedom[:, None] * size + np.arange(size)] = basis
        J[:, speed] = turn * self.t[frame]
        J[:, self.shift :] = turn[:, None] * self.moves[frame]
        f = (basis * c[freedom]).sum(1)
        for n, column in enumerate(self.travels):
            here = freedom == column
            J[here, speed + 1 + n] = self.t[frame[here]]
            J[here, self.Z + n] = 1.0
            f[here] += z[speed + 1 + n] * self.t[frame[here]] + z[self.Z + n]
        return f, J, phase

    def fit(self, start: float, speed: float, bend: float = 0.0, steps: int = STEPS) -> Fit:
        """Climb from a phase at t = 0, a phase speed and a bend, in radians and seconds."""
        z = self.mean.copy()
        z[self.speed] = speed
        z[self.shift + 1] = bend / self.stride.bend[self.k]
        z[self.Z : self.shift] = measured_mean(self.y[:, self.travels])
        return self.climb(z, start, steps)

    def climb(self, z: Array, start: float, steps: int) -> Fit:
        """Gauss-Newton steps from z, each halved until the posterior density rises."""
        fit, cost, uphill = self._at(z, start)
        for _ in range(steps):
            step = cho_solve(fit.factor, uphill)
            if uphill @ step < ENOUGH:
                break
            for n in range(SHORTEN):
                following = self._at(fit.z + 0.5**n * step, start)
                if following[1] <= cost:
                    break
            else:
                break
            fit, cost, uphill = following
        return fit

    def _at(self, z: Array, start: float) -> tuple[Fit, float, Array]:
        """Laplace's approximation about z, minus its log density up to a constant, and the gradient of it."""
        f, J, phase = self.value(z, start, self.cells)
        away = self.y[self.cells] - f
        white = solve_triangular(self.L, np.column_stack([away, J]), lower=True, check_finite=False)
        e, A = white[:, 0], white[:, 1:]
        pull = self.precision @ (z - self.mean)
        cost = 0.5 * float(e @ e + (z - self.mean) @ pull)
        factor = cho_factor(self.precision + A.T @ A, lower=True)
        log_evidence = self._constant - cost - float(np.log(np.diag(factor[0])).sum())
        return Fit(self, z, start, factor, e, A, phase, log_evidence), cost, A.T @ e - pull

    def _shapes(self) -> Array:
        """(T, W) effects on the phase of shift, bend and the drift's principal components, per unit of each.

        The drift is orthogonal to shift, speed and bend.
        """
        cov = self.stride.drift[self.k] ** 2 * matern(self.t[:, None] - self.t, DRIFTING)
        told = np.linalg.qr(np.vander(self.t, 3))[0]
        rest = np.eye(len(self.t)) - told @ told.T
        variance, shapes = np.linalg.eigh(rest @ cov @ rest)
        kept = np.flatnonzero(variance > max(NEGLIGIBLE * variance[-1], NOTHING))[-DRIFTS:]
        drift = shapes[:, kept] * np.sqrt(variance[kept])
        return np.column_stack([np.ones(len(self.t)), self.stride.bend[self.k] * self.t**2, drift])


def _spread(over_time: Array, cov: Array, one: Cells, other: Cells) -> Array:
    """(n, m) covariance between cells of a process with these correlations (T, T) and covariance (M, M)."""
    (f, i), (g, j) = one, other
    return np.asarray(over_time[np.ix_(f, g)] * cov[np.ix_(i, j)])
