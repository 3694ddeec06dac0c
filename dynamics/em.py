"""Learning an SLDS from pose sequences by expectation-maximisation with any of the inferences.

The M-step is that of Pavlović et al. (1999), section 2.3, with the sums' ends put right, an affine offset,
weights per sequence, and priors: inverse-Wishart on Q, R and the first frame's covariance, Dirichlet on Pi,
and a ridge towards constant velocity, all scaled from the data so that units do not matter.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dynamics.gaussian import Array, Gaussian, symmetric
from dynamics.initialise import kmeans
from dynamics.posterior import Posterior
from dynamics.regression import Form, Ridge, form, maximum_likelihood, solve
from dynamics.slds import SLDS
from dynamics.viterbi import viterbi_all

RIDGE = 1e-2  # the prior's share of a state's regressors; measured on subjects held out, 1e-3 overfits runs
STILL = 1e-10  # variance that even a freedom which never moves is taken to have: 1e-5 leg lengths or radians

Infer = Callable[[SLDS, Sequence[Array]], list[Posterior]]


@dataclass(frozen=True)
class Options:
    """How to learn.

    states     : switching states
    order      : 1 or 2
    rounds     : EM rounds at most
    tolerance  : stop when the penalised value rises by less than this share
    prior      : strength of all priors; 0 is maximum likelihood
    stickiness : Dirichlet counts added to every state's staying
    seed       : of the k-means start
    """

    states: int = 4
    order: int = 2
    rounds: int = 10
    tolerance: float = 1e-5
    prior: float = 1.0
    stickiness: float = 2.0
    seed: int = 0


@dataclass(frozen=True)
class Fit:
    """A learned system, the value (log evidence, bound or path value, plus log prior) after every round, and
    why learning stopped."""

    slds: SLDS
    values: tuple[float, ...]
    stopped: str


@dataclass(frozen=True)
class Prior:
    """Priors scaled from the data; see `data_prior`.

    ridge : of the regression
    R     : (M,) diagonal of the inverse-Wishart scale of R, and its count
    start : (N,) diagonal of the inverse-Wishart scale of the first frame's covariance
    alpha : Dirichlet counts added to every transition, and `sticky` more to staying
    """

    ridge: Ridge
    R: Array
    R_count: float
    start: Array
    start_count: float
    alpha: float
    sticky: float


def learn(
    ys: Sequence[Array],
    *,
    names: Sequence[str],
    travelling: Sequence[str],
    fps: float,
    label: str,
    options: Options = Options(),
    weights: Array | None = None,
    infer: Infer = viterbi_all,
    progress: Callable[[int, float], None] | None = None,
) -> Fit:
    """Learn one motion's switching dynamics.

    Args:
        ys: sequences (T, M), T >= 3, in body units (leg lengths, radians).
        names: the M freedoms; `travelling` those whose place must not matter.
        fps: frames a second of the sequences.
        label: name of the motion, given to every state.
        weights: how much each sequence counts (mean 1), e.g. to balance subjects.
        infer: E-step.
        progress: called after each round with its number and value.

    Raises:
        ValueError: no sequences, too short ones, or gaps in them.
    """
    _check(ys, names)
    ys = [_from_origin(y, names, travelling) for y in ys]
    w = np.ones(len(ys)) if weights is None else weights / weights.mean()
    shape = form(tuple(names), tuple(travelling), options.order)
    prior = data_prior(ys, shape, options)
    first = kmeans(ys, options.states, shape, np.random.default_rng(options.seed))
    slds = _first_model(ys, first, shape, prior, w, tuple(names), tuple(travelling), label, fps)
    best, stopped = slds, f"reached {options.rounds} rounds"
    values: list[float] = []
    for i in range(options.rounds):
        posteriors = infer(slds, ys)
        value = float(sum(wn * p.log_evidence for wn, p in zip(w, posteriors, strict=True)))
        value += log_prior(slds, shape, prior)
        if not values or value > max(values):
            best = slds
        values.append(value)
        if progress is not None:
            progress(i, value)
        rise = value - values[-2] if i > 0 else np.inf
        if rise < 0:
            stopped = "fell; the best round is kept"
            break
        if rise < options.tolerance * abs(value):
            stopped = "rose by less than the tolerance"
            break
        slds = maximise(slds, ys, posteriors, shape, prior, w)
    return Fit(best, tuple(values), stopped)


def maximise(
    slds: SLDS,
    ys: Sequence[Array],
    posteriors: Sequence[Posterior],
    shape: Form,
    prior: Prior,
    weights: Array,
) -> SLDS:
    """The M-step: the parameters that maximise the expected log joint plus the log prior (C is fixed).

    A state that the posteriors never enter keeps what it had where the priors leave it nothing.
    """
    V, n = _step_statistics(posteriors, weights, len(slds.names))
    entered = n + prior.ridge.count > 0
    A, b, Q = slds.A.copy(), slds.b.copy(), slds.Q.copy()
    A[entered], b[entered], Q[entered] = solve(V[entered], n[entered], shape, prior.ridge)
    mean0, cov0 = _start(posteriors, weights, prior)
    counts = sum(w * p.pair.sum(0) for w, p in zip(weights, posteriors, strict=True))
    counts = counts + prior.alpha + prior.sticky * np.eye(slds.K)
    first = sum(w * p.prob[0] for w, p in zip(weights, posteriors, strict=True)) + prior.alpha
    unborn = first + prior.start_count <= 1e-9
    return replace(
        slds,
        A=A,
        b=b,
        Q=Q,
        Pi=_rows(counts, slds.Pi),
        pi0=_rows(first[None], slds.pi0[None])[0],
        mean0=np.where(unborn[:, None], slds.mean0, mean0),
        cov0=np.where(unborn[:, None, None], slds.cov0, cov0),
        R=_measurement_noise(slds, ys, posteriors, weights, prior),
    )


def anywhere(slds: SLDS, posteriors: Sequence[Posterior]) -> SLDS:
    """The same system whose first frame may fall anywhere in the motion.

    mean0 and cov0 become each state's moments over all frames, with travelling freedoms counted from where
    they are now. A tracker meets a figure in the middle of its stride, not where a capture was cut.
    """
    moves = np.array([name in slds.travelling for name in slds.names])
    mean0, cov0, share = slds.mean0.copy(), slds.cov0.copy(), np.zeros(slds.K)
    prob = np.concatenate([p.prob[1:] for p in posteriors])
    mean = np.concatenate([p.states.mean[1:] for p in posteriors]) @ slds.from_here.T
    for k in range(slds.K):
        share[k] = prob[:, k].sum()
        if share[k] > 1.0:
            w = prob[:, k] / share[k]
            mean0[k] = w @ mean
            cov0[k] = (w[:, None] * (mean - mean0[k])).T @ (mean - mean0[k])
    floor = 1e-6 * np.eye(mean.shape[1]) + np.diag(np.tile(moves * 1e-4, slds.order))
    return replace(slds, mean0=mean0, cov0=symmetric(cov0) + floor, pi0=share / share.sum())


def data_prior(ys: Sequence[Array], shape: Form, options: Options) -> Prior:
    """Priors scaled from the data's spread; all zero at strength 0."""
    d, N = shape.carry.shape
    if options.prior == 0.0:
        return Prior(maximum_likelihood(shape), np.zeros(d), 0.0, np.zeros(N), 0.0, 0.0, 0.0)
    y = np.concatenate(ys)
    spread = y.var(axis=0) + STILL
    change = _change(ys, shape)
    speed = np.concatenate([np.diff(y, axis=0) for y in ys])
    x = y if shape.order == 1 else np.concatenate([np.hstack([y[1:], y[:-1]]) for y in ys])
    size = np.append(((x @ shape.regard.T) ** 2).mean(axis=0), 1.0)
    size = np.where(size > 0, size, 1.0)
    strength = options.prior * RIDGE * size * len(y) / (4.0 * options.states)
    # A travelling freedom starts near its first place, however far it goes.
    places = np.where(shape.carry.any(axis=1), np.minimum(spread, (speed**2).mean(axis=0) + STILL), spread)
    return Prior(
        ridge=Ridge(strength, options.prior * 0.1 * change, options.prior * (d + 2.0)),
        R=options.prior * 0.03 * np.minimum(spread, change),
        R_count=options.prior * (d + 11.0),
        start=options.prior * 0.1 * np.tile(places, shape.order),
        start_count=options.prior * (N + 2.0),
        alpha=0.1 * options.prior,
        sticky=options.stickiness * options.prior,
    )


def log_prior(slds: SLDS, shape: Form, prior: Prior) -> float:
    """The log prior density up to a constant: what the M-step adds to the expected log joint."""
    d = len(shape.carry)
    total = 0.0
    if prior.ridge.count > 0:
        for A, b, Q in zip(slds.A, slds.b, slds.Q, strict=True):
            free = A[:d] - shape.carry
            B = np.hstack([free @ np.linalg.pinv(shape.regard), b[:d, None]]) - shape.steady
            scatter = (B * prior.ridge.strength) @ B.T + np.diag(prior.ridge.noise)
            count = prior.ridge.count + np.count_nonzero(prior.ridge.strength)
            total += _inverse_wishart(Q[:d, :d], scatter, count)
        for cov in slds.cov0:
            total += _inverse_wishart(cov, np.diag(prior.start), prior.start_count)
        total += _inverse_wishart(slds.R, np.diag(prior.R), prior.R_count)
        Pi, pi0 = np.maximum(slds.Pi, 1e-300), np.maximum(slds.pi0, 1e-300)
        total += float(((prior.alpha + prior.sticky * np.eye(slds.K)) * np.log(Pi)).sum())
        total += float((prior.alpha * np.log(pi0)).sum())
    return total


def _inverse_wishart(cov: Array, scatter: Array, count: float) -> float:
    return float(-0.5 * (count * np.linalg.slogdet(cov)[1] + np.trace(np.linalg.solve(cov, scatter))))


def _step_statistics(posteriors: Sequence[Posterior], weights: Array, d: int) -> tuple[Array, Array]:
    """sum_t E[v v' s_t(k)] with v = [pose_t; x_{t-1}; 1], and the expected counts (K,)."""
    K = posteriors[0].prob.shape[1]
    N = posteriors[0].states.mean.shape[1]
    V, n = np.zeros((K, d + N + 1, d + N + 1)), np.zeros(K)
    pick = np.r_[0:d, N : 2 * N]
    for w, posterior in zip(weights, posteriors, strict=True):
        prob = w * posterior.prob[1:]
        steps = posterior.step_moments()
        mean = np.broadcast_to(steps.mean[..., pick], (*prob.shape, d + N))
        v = np.concatenate([mean, np.ones((*prob.shape, 1))], axis=-1)
        V += np.einsum("tk,tki,tkj->kij", prob, v, v, optimize=True)
        cov = steps.cov[..., pick[:, None], pick]
        V[:, :-1, :-1] += np.einsum("tk,tkij->kij", prob, np.broadcast_to(cov, (*prob.shape, d + N, d + N)))
        n += prob.sum(0)
    return V, n


def _start(posteriors: Sequence[Posterior], weights: Array, prior: Prior) -> tuple[Array, Array]:
    K, N = posteriors[0].prob.shape[1], posteriors[0].states.mean.shape[1]
    n, total, square = np.zeros(K), np.zeros((K, N)), np.zeros((K, N, N))
    for w, posterior in zip(weights, posteriors, strict=True):
        prob, first = w * posterior.prob[0], posterior.start_moments()
        n += prob
        total += prob[:, None] * first.mean
        outer = first.mean[..., :, None] * first.mean[..., None, :]
        square += prob[:, None, None] * (first.cov + outer)
    # A state that no sequence starts in takes the mean of those that do, at the prior's covariance.
    born = n > 1e-9
    own, common = total / np.maximum(n, 1e-9)[:, None], total.sum(0) / max(n.sum(), 1e-9)
    mean = np.where(born[:, None], own, common)
    scatter = square - n[:, None, None] * mean[:, :, None] * mean[:, None, :]
    scatter = np.where(born[:, None, None], scatter, 0.0)
    count = np.maximum(n + prior.start_count, 1e-9)
    return mean, symmetric(scatter + np.diag(prior.start)) / count[:, None, None]


def _measurement_noise(
    slds: SLDS, ys: Sequence[Array], posteriors: Sequence[Posterior], weights: Array, prior: Prior
) -> Array:
    """R from the residuals of every frame."""
    scatter, n = np.diag(prior.R), prior.R_count
    for w, y, posterior in zip(weights, ys, posteriors, strict=True):
        e = y - posterior.states.mean @ slds.C.T
        scatter = scatter + w * (e.T @ e + (slds.C @ posterior.states.cov @ slds.C.T).sum(0))
        n += w * len(y)
    return symmetric(scatter / n)


def _rows(counts: Array, fallback: Array) -> Array:
    totals = counts.sum(-1, keepdims=True)
    return np.where(totals > 0, counts / np.where(totals > 0, totals, 1.0), fallback)


def _first_model(
    ys: Sequence[Array],
    posteriors: Sequence[Posterior],
    shape: Form,
    prior: Prior,
    weights: Array,
    names: tuple[str, ...],
    travelling: tuple[str, ...],
    label: str,
    fps: float,
) -> SLDS:
    """The model that the starting labels give; R starts at a tenth of the frame-to-frame change."""
    d, N = shape.carry.shape
    K = posteriors[0].prob.shape[1]
    R = np.diag(0.1 * _change(ys, shape))
    slds = SLDS(
        pi0=np.full(K, 1.0 / K),
        Pi=np.full((K, K), 1.0 / K),
        A=np.broadcast_to(np.eye(N), (K, N, N)),
        b=np.zeros((K, N)),
        Q=np.broadcast_to(np.eye(N), (K, N, N)),
        C=np.eye(d, N),
        R=R,
        mean0=np.zeros((K, N)),
        cov0=np.broadcast_to(np.eye(N), (K, N, N)),
        names=names,
        travelling=travelling,
        labels=(label,) * K,
        fps=fps,
    )
    blur = 1e-9 * np.eye(N)
    blurred = [replace(p, states=Gaussian(p.states.mean, p.states.cov + blur)) for p in posteriors]
    return replace(maximise(slds, ys, blurred, shape, prior, weights), R=R)


def _change(ys: Sequence[Array], shape: Form) -> Array:
    """(d,) variance of the change that the dynamics must explain: of velocity, or at first order of place."""
    differences = np.concatenate([np.diff(y, n=shape.order, axis=0) for y in ys])
    return np.asarray(differences.var(axis=0) + STILL)


def _from_origin(y: Array, names: Sequence[str], travelling: Sequence[str]) -> Array:
    """The sequence with its travelling freedoms counted from the first frame."""
    moves = np.array([name in travelling for name in names])
    return y - np.where(moves, y[0], 0.0)


def _check(ys: Sequence[Array], names: Sequence[str]) -> None:
    if not ys:
        raise ValueError("learning needs at least one sequence; got none")
    for n, y in enumerate(ys):
        if y.ndim != 2 or y.shape[1] != len(names) or len(y) < 3:
            raise ValueError(f"sequence {n} must be (T, {len(names)}) with T >= 3; got {y.shape}")
        if not np.isfinite(y).all():
            raise ValueError(f"sequence {n} has gaps; learn from sequences without missing entries")
