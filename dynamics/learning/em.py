"""Learning an SLDS from pose sequences by expectation-maximisation with any of the inferences.

E-steps (`infer`) and M-steps (`dynamics.learning.mstep`) alternate. The value of a round is the weighted sum
of the inference's log evidence plus the log prior. With an exact or variational E-step it never falls. With
the best path or GPB2 it may, so the best round is kept; learning continues after one fall by less than the
tolerance, and ends with another.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dynamics.gaussian import Array, Gaussian, measured_first, symmetric
from dynamics.layout import Layout, among
from dynamics.learning.initialise import first_guess
from dynamics.learning.mstep import maximise
from dynamics.learning.options import DEFAULTS, Options
from dynamics.learning.prior import Prior, changes, data_prior, log_prior
from dynamics.learning.regression import companion
from dynamics.posterior import Infer, Posterior
from dynamics.slds import SLDS
from dynamics.viterbi import viterbi_all


@dataclass(frozen=True)
class Fit:
    """A learned system, from the best round.

    values : log evidence (or bound, or path value) plus log prior at every round
    """

    slds: SLDS
    values: tuple[float, ...]


def learn(
    ys: Sequence[Array],
    *,
    names: Sequence[str],
    travelling: Sequence[str],
    fps: float,
    label: str,
    options: Options = DEFAULTS,
    weights: Array | None = None,
    infer: Infer = viterbi_all,
) -> Fit:
    """Learn one motion's switching dynamics.

    Args:
        ys: sequences (T, M), T >= 2, one of them longer than the order, in body units (leg lengths, radians).
        names: the M freedoms; `travelling` those that enter the dynamics by their change only.
        weights: how much each sequence counts (only their ratios matter), e.g. to balance subjects.
        infer: the E-step, called once a round, with the sequences always in one order.

    Raises:
        ValueError: no sequences, unusable ones, or too little data for maximum likelihood.
    """
    w = np.ones(len(ys)) if weights is None else np.asarray(weights, dtype=float)
    ys, w = _in_order([from_origin(y, names, travelling) for y in ys], w / w.mean())
    layout = Layout(tuple(names), tuple(travelling), options.order)
    prior = data_prior(ys, layout, options)
    blank = _blank(ys, layout, options, label, fps)
    (seed,) = np.random.SeedSequence(options.seed).spawn(1)
    guess = first_guess(ys, options.states, layout, np.random.default_rng(seed))
    try:
        # Noise that maximum likelihood fits to zero is raised a little.
        blur = 1e-5 * np.diag(np.tile(changes(ys, layout.order), layout.order))
        blurred = [replace(p, states=Gaussian(p.states.mean, p.states.cov + blur)) for p in guess]
        slds = replace(maximise(blank, ys, blurred, prior, w), R=blank.R)
        return _climb(slds, ys, prior, w, options, infer)
    except np.linalg.LinAlgError as error:
        raise ValueError(
            f"a covariance of {options.states} states collapsed ({error}); "
            "learn fewer states, from more data, or with a prior above 0"
        ) from error


def anywhere(slds: SLDS, posteriors: Sequence[Posterior]) -> SLDS:
    """The same system whose first frame may fall anywhere in the motion.

    mean0 and cov0 become the moments of each state's expected x over all frames alike, but each sequence's
    first, before which no pose was measured; travelling freedoms are relative to their present place. A
    tracker starts in the middle of a stride, not where a capture was cut.
    """
    mean0, cov0, share = slds.mean0.copy(), slds.cov0.copy(), np.zeros(slds.K)
    prob = np.concatenate([p.prob[1:] for p in posteriors])
    mean = np.concatenate([p.states.mean[1:] for p in posteriors]) @ slds.layout.from_here.T
    for k in range(slds.K):
        share[k] = prob[:, k].sum()
        if share[k] > 1.0:
            w = prob[:, k] / share[k]
            mean0[k] = w @ mean
            cov0[k] = (w[:, None] * (mean - mean0[k])).T @ (mean - mean0[k])
    floor = 1e-6 * np.eye(mean.shape[1]) + np.diag(np.tile(slds.layout.travels * 1e-4, slds.order))
    return replace(slds, mean0=mean0, cov0=symmetric(cov0) + floor, pi0=share / share.sum())


def from_origin(y: Array, names: Sequence[str], travelling: Sequence[str]) -> Array:
    """The sequence with its travelling freedoms relative to their first measured value, if they have one."""
    return y - np.where(among(names, travelling), measured_first(y), 0.0)


def _climb(
    slds: SLDS, ys: Sequence[Array], prior: Prior, weights: Array, options: Options, infer: Infer
) -> Fit:
    best, falls = slds, 0
    values: list[float] = []
    while True:
        posteriors = infer(slds, ys)
        evidence = sum(w * p.log_evidence for w, p in zip(weights, posteriors, strict=True))
        value = float(evidence) + log_prior(slds, prior)
        if not np.isfinite(value):
            raise np.linalg.LinAlgError(f"the value of round {len(values)} is {value}")
        rise = value - values[-1] if values else np.inf
        if value > max(values, default=-np.inf):
            best = slds
        values.append(value)
        least = options.tolerance * abs(value)
        falls += rise < 0
        fell = rise < 0 and (falls > 1 or -rise > least)
        if fell or 0 <= rise < least or len(values) >= options.rounds:
            return Fit(best, tuple(values))
        slds = maximise(slds, ys, posteriors, prior, weights)


def _blank(ys: Sequence[Array], layout: Layout, options: Options, label: str, fps: float) -> SLDS:
    """Constant velocity in every state; R is a tenth of the frame-to-frame change."""
    N, K = layout.N, options.states
    change, spread = changes(ys, layout.order), changes(ys, 0)
    A, b, Q = companion(layout, np.stack([layout.steady] * K), np.stack([np.diag(change)] * K))
    return SLDS(
        pi0=np.full(K, 1.0 / K),
        Pi=np.full((K, K), 1.0 / K),
        A=A,
        b=b,
        Q=Q,
        C=layout.pose,
        R=np.diag(0.1 * change),
        mean0=np.zeros((K, N)),
        cov0=np.stack([np.diag(np.tile(spread, layout.order))] * K),
        names=layout.names,
        travelling=layout.travelling,
        labels=(label,) * K,
        fps=fps,
    )


def _in_order(ys: Sequence[Array], weights: Array) -> tuple[list[Array], Array]:
    """Sequences and weights sorted by content, so that the start does not depend on their given order."""
    keys = [(len(y), y.ravel().tolist(), w) for y, w in zip(ys, weights, strict=True)]
    order = sorted(range(len(ys)), key=lambda n: keys[n])
    return [ys[n] for n in order], weights[order]
