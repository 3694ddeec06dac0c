"""Structured variational inference: poses and switching states, each given the average over the other.

Pavlović et al. (2000), q(X, S) = q(X) q(S) closest to the posterior. It maximises the bound
E_q log p(X, S, Y) + H[q] <= log p(Y) by turns: q(X) for the switching states' probabilities is a Gaussian
chain (`dynamics.averaged`); q(S) for q(X) is a discrete chain with pi0, Pi and frame log likelihoods

    log q_0(i) = <log N(x_0; mean0_i, cov0_i)>,  log q_t(i) = <log N(x_t; A_i x_{t-1} + b_i, Q_i)>

(equation 3, with the factor 1/2 it lacks; plus the frame's hints). Right after it the bound is exactly
log Z of that chain + E log p(Y | X) + H[q(X)], since E log p(S) + H[q(S)] + sum_t <log q_t> = log Z.

The final bound depends on the start. From the approximate Viterbi path it was higher than from equally
probable states, by thousands of nats on 50 frames of 8 freedoms.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from operator import itemgetter

import numpy as np

from dynamics.averaged import Data, Poses, System, averaged, beside, whitened
from dynamics.chain import batches, forward_backward, in_order, side_by_side
from dynamics.gaussian import Array, Gaussian
from dynamics.posterior import Posterior
from dynamics.slds import SLDS
from dynamics.viterbi import viterbi_all

ROUNDS = 50
TOLERANCE = 1e-3  # nats; the bound then ended at most 1e-3 below its limit, mostly after 2 to 5 rounds


def variational_all(
    slds: SLDS,
    ys: Sequence[Array],
    hints: Sequence[Array] | None = None,
    *,
    start: Sequence[Posterior] | None = None,
    rounds: int = ROUNDS,
    tolerance: float = TOLERANCE,
) -> list[Posterior]:
    """The closest posterior of each sequence in which poses and switching states are independent.

    Args:
        ys: sequences (T, M), T >= 1; NaN entries were not measured.
        hints: for each (T, K) further log likelihood of every switching state.
        start: for each the posterior whose `prob` and mean states to start from; None: approximate Viterbi.
        rounds: how often poses, then switching states, are found anew at most; at least 1.
        tolerance: a sequence is done when a round raises its bound, its `log_evidence`, by less, nats.

    Raises:
        numpy.linalg.LinAlgError: R, cov0 or the pose's block of Q is not positive definite.
        ValueError: the state holds more than poses, or no path can have made a sequence.
    """
    system = whitened(slds)
    begin = viterbi_all(slds, ys, hints) if start is None else start

    def infer(chosen: Sequence[int]) -> list[Posterior]:
        data = beside(slds, [ys[n] for n in chosen], None if hints is None else [hints[n] for n in chosen])
        found = _settled(slds, system, data, [begin[n] for n in chosen], rounds, tolerance)
        return [posterior for _, posterior in sorted(found, key=itemgetter(0))]

    chosen = variational_batches(slds, ys)
    return in_order(chosen, map(infer, chosen))


def variational_batches(slds: SLDS, ys: Sequence[Array]) -> list[list[int]]:
    """Groups of sequences to process together, longest first; rounding depends on the grouping."""
    return batches(ys, slds.A[:, : len(slds.names)].size)


@dataclass
class Variational:
    """An E-step for `em.learn` that starts from its own last result for sequences of the same lengths.

    The bound plus the log prior then never falls from one round of learning to the next, however few rounds
    are made within. Use a new one for every run of learning: another model's result is a poor start.
    """

    rounds: int = ROUNDS
    last: list[Posterior] = field(default_factory=list, repr=False)

    def __call__(self, slds: SLDS, ys: Sequence[Array]) -> list[Posterior]:
        same = [p.prob.shape for p in self.last] == [(len(y), slds.K) for y in ys]
        start = self.last if same else None
        self.last = variational_all(slds, ys, start=start, rounds=self.rounds)
        return self.last


def _settled(
    slds: SLDS, system: System, data: Data, start: Sequence[Posterior], rounds: int, tolerance: float
) -> Iterator[tuple[int, Posterior]]:
    """Position and posterior of each sequence as soon as its bound has settled; the others continue."""
    prob, mean = _beginning(start, len(slds.names))
    going, before = np.arange(len(start)), np.full(len(start), -np.inf)
    for i in range(rounds):
        poses, lengths = averaged(system, data, prob, mean), data.within.sum(0)
        prob, pair, log_Z = forward_backward(slds.log_pi0, slds.log_Pi, poses.told + data.hints, lengths)
        bound = log_Z + poses.value
        done = (bound - before < tolerance) | (i == rounds - 1)
        for n in np.flatnonzero(done):
            yield int(going[n]), _posterior(poses, prob, pair, bound, int(n), int(lengths[n]))
        rest = np.flatnonzero(~done)
        if not len(rest):
            return
        if done.any():
            data = data.of(rest)
        prob, mean = prob[:, rest], poses.mean[:, rest]
        going, before = going[rest], bound[rest]


def _posterior(poses: Poses, prob: Array, pair: Array, bound: Array, n: int, T: int) -> Posterior:
    """The posterior of sequence n, which has T frames."""
    return Posterior(
        prob=prob[:T, n].copy(),
        pair=pair[: T - 1, n].copy(),
        states=Gaussian(poses.mean[:T, n].copy(), poses.cov[:T, n].copy()),
        lag=poses.lag[: T - 1, n].copy(),
        log_evidence=float(bound[n]),
        path=prob[:T, n].argmax(1),
    )


def _beginning(start: Sequence[Posterior], d: int) -> tuple[Array, Array]:
    """prob (T,B,K) and mean (T,B,N) to start from; every state repeats the pose of the one before exactly."""
    prob, _ = side_by_side([p.prob for p in start], 0.0)
    mean, _ = side_by_side([p.states.mean for p in start], 0.0)
    mean[1:, :, d:] = mean[:-1, :, : mean.shape[-1] - d]
    return prob, mean
