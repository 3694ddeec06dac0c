"""The GPB2 filter: one Gaussian a switching state, collapsed over the state before.

Pavlović et al. (2000), section 3.3 (generalised pseudo-Bayes of second order), read with these corrections:
the first frame is updated like any other, the collapse over predecessors comes after all of them are known,
and it counts the spread of their means. Here j is the state before, i the state now.

For every pair l_ij = log N(e_ij; 0, S_ij) + log Pi[j, i] + log Pr(s_{t-1} = j | past), and the weights
W_ij = Pr(s_{t-1} = j | s_t = i, y_0..t) are the softmax of l_ij over j, never a ratio of probabilities that
may have underflowed. The collapse needs few N x N products. With G_i = C A_i,

    C P_ij = (G_i P_j) A_i' + C Q_i,    S_ij = (G_i P_j) G_i' + C Q_i C' + R = L L',
    Z_ij = L^-1 C P_ij,    x_ij|t = x_ij + Z_ij' L^-1 e_ij,    P_ij|t = P_ij - Z_ij' Z_ij.

Summed like this, P_ij|t cancels to nothing where R is small beside P. Joseph's form holds for any gain g:
P_ij|t = (I - gC) P_ij (I - gC)' + g R g' - (g - g_ij) S_ij (g - g_ij)', where g_ij = Z_ij' L^-1. So, with
P_i = sum_j W_ij P_ij = A_i (sum_j W_ij P_j) A_i' + Q_i, S_i = sum_j W_ij S_ij and g = P_i C' S_i^-1,

    sum_j W_ij P_ij|t = (I - gC) P_i (I - gC)' + g R g' - sum_j W_ij D_ij' D_ij,    D_ij = L' g' - Z_ij,

which subtracts only the difference between the gains: this g makes it least, and one state makes it zero.
All of this is computed in `dynamics.pairs`.
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from dynamics.frames import Frames, in_batches
from dynamics.gaussian import LOG_2PI, Array, Gaussian
from dynamics.kalman import update
from dynamics.slds import SLDS

ROWS = 64  # processed at a time

Switch = Callable[[Array], Array]  # (n, K, N) states given each s_{t-1} to (n, K, K) log Pr(s_t | s_{t-1})


class Step(NamedTuple):
    """The filter's result for n rows of `dynamics.frames.Frames`: some or all frames of the sequences.

    log_prob     : (n, K) log Pr(s_t | y_0..t)
    mean, cov    : (n, K, N), (n, K, N, N) of x_t given each s_t
    log_shares   : (n, K, K) log W_ij, W_ij = Pr(s_{t-1} = j | s_t = i, y_0..t); 0 at the first frame
    log_evidence : (n,) log p(y_t | y_0..t-1)
    """

    rows: slice
    log_prob: Array
    mean: Array
    cov: Array
    log_shares: Array
    log_evidence: Array

    @property
    def states(self) -> Gaussian:
        return Gaussian(self.mean, self.cov)


def gpb2_filter(slds: SLDS, y: Array) -> Step:
    """The filter without smoothing over one sequence (T, M); errors as `gpb2_all`."""
    return in_batches(slds, [y], None, lambda frames: [run_filter(slds, frames)])[0]


def run_filter(slds: SLDS, frames: Frames) -> Step:
    """The filter's result for all rows; ValueError where no switching state is possible."""
    n, (K, N) = len(frames.y), slds.b.shape
    shapes = (n, K), (n, K, N), (n, K, N, N), (n, K, K), (n,)
    whole = Step(slice(0, n), *map(np.empty, shapes))
    for step in filter_steps(slds, frames):
        for kept, part in zip(whole[1:], step[1:], strict=True):
            kept[step.rows] = part
    return whole


def filter_steps(slds: SLDS, frames: Frames, switch: Switch | None = None) -> Iterator[Step]:
    """The filter, some frames a step if the switch is Pi, one frame a step if it depends on the state before.

    ValueError where no switching state is possible."""
    from dynamics.pairs import constants, gpb2_rows  # slow to import

    measured = np.asarray(np.isfinite(frames.y).any(0))  # the other entries would only cost time
    measured[0] |= not measured.any()
    y, C, R = np.compress(measured, frames.y, axis=1), slds.C[measured], slds.R[np.ix_(measured, measured)]
    extra = frames.hints - 0.5 * LOG_2PI * (~np.isnan(y)).sum(-1)[:, None]
    system, log_switch = constants(slds, C, R), slds.log_Pi[None]
    step = _first(slds, C, R, y[frames.at(0)], frames.hints[frames.at(0)])
    yield _possible(step, frames)
    for before, start, stop in _spans(frames.first.tolist(), ROWS if switch is None else 1):
        n, rows = start - before, slice(before, stop)
        known = (np.concatenate([part[-n:], np.empty((stop - start, *part.shape[1:]))]) for part in step[1:])
        found = tuple(known)
        if switch is not None:
            log_switch = switch(found[1][:n])
        gpb2_rows(system, log_switch, y[rows], extra[rows], frames.before[rows] - before, found)
        step = Step(slice(start, stop), *(part[n:] for part in found))
        yield _possible(step, frames)


def _spans(first: list[int], most: int) -> Iterator[tuple[int, int, int]]:
    """Groups of at most `most` rows, or a frame: first row of the frame before, first of the group, end."""
    start, T = 1, len(first) - 1
    while start < T:
        stop = start + 1
        while stop < T and first[stop + 1] - first[start] <= most:
            stop += 1
        yield first[start - 1], first[start], first[stop]
        start = stop


def _first(slds: SLDS, C: Array, R: Array, y: Array, hints: Array) -> Step:
    """The belief after the first frame, from the model's prior."""
    states, log_lik = update(slds.start, y[:, None], C, R)
    log_evidence, log_prob = normalised(slds.log_pi0 + log_lik + hints, axis=-1)
    # A copy, as compiled code takes no broadcast array.
    cov = np.broadcast_to(states.cov, (*states.mean.shape, slds.A.shape[-1])).copy()
    log_shares = np.zeros((*log_prob.shape, slds.K))
    return Step(slice(0, len(y)), log_prob, states.mean, cov, log_shares, log_evidence[:, 0])


def _possible(step: Step, frames: Frames) -> Step:
    impossible = np.flatnonzero(~(step.log_evidence > -np.inf))
    if len(impossible):
        t = np.searchsorted(frames.first, step.rows.start + impossible[0], "right") - 1
        raise ValueError(f"no switching state is possible at frame {t}; see pi0, Pi, y and hints")
    return step


def normalised(logs: Array, axis: int) -> tuple[Array, Array]:
    """The log sum along an axis, which is kept, and the log shares of it: equal where all are impossible."""
    total = np.logaddexp.reduce(logs, axis=axis, keepdims=True)
    if total.min() > -np.inf:
        return total, logs - total
    never = np.isneginf(total)
    equal = -np.log(logs.shape[axis])
    return total, np.where(never, equal, logs - np.where(never, 0.0, total))
