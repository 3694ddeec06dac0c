"""Filling gaps by sampled switch paths.

The papers' best path stops the gait inside a gap: only Pi counts there, and staying in a state costs least.
Here the path is sampled, and the switch may depend on the pose (`dynamics.region`):

    x  starts as the smoothed states of a model with one switching state a motion, given both sides of the gap
    s  is drawn given x, by filtering backwards and sampling forwards:
       log Pr(s_t = j | s_{t-1} = i, x_{t-1}) + log N(pose_t; A_j x_{t-1} + b_j, Q_j)
    x  is smoothed along s, from all that was measured; and again

for several paths at once. The result has the moments of their mixture. A long sequence is filled in pieces,
so that memory is bounded; each piece includes some frames beyond its ends.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from dynamics.gaussian import Array, Gaussian, Ints, apply, collapse, log_density, measured_first, unknown
from dynamics.learning.em import from_origin
from dynamics.motion.rate import by_motion
from dynamics.region import log_switch, regions
from dynamics.slds import SLDS
from dynamics.viterbi import viterbi, viterbi_all

PATHS = 20
ROUNDS = 2
PIECE = 1000  # frames that are filled together
BEYOND = 120  # measured frames that are included on either side of them
ANYWHERE = 100.0  # variance of the place in a first frame that was not measured, leg lengths squared


def interpolate(
    slds: SLDS,
    y: Array,
    rng: np.random.Generator,
    *,
    recurrent: bool = True,
    constants: Mapping[str, float] | None = None,
) -> Gaussian:
    """Every frame's pose given all measurements: mean (T, M) and cov (T, M, M), without measurement noise.

    NaN entries of y (T, M), whole rows too, were not measured, but not all of them. If `recurrent` the switch
    depends on the pose; False is the papers' switch. `constants` are as in `SLDS.with_constants`.
    """
    poses = unknown(*y.shape)
    for rows, window in _pieces(y):
        found = _filled(slds, y[window], rng, recurrent, constants or {})
        poses[rows] = found[rows.start - window.start : rows.stop - window.start]
    return poses


def _pieces(y: Array) -> Iterator[tuple[slice, slice]]:
    """Pieces to fill together, all but the first from a measured frame on; and what is around each."""
    seen = np.isfinite(y)
    measured, first = np.flatnonzero(seen.any(1)), 0
    while first < len(y):
        later = measured[measured >= first + PIECE]
        end = int(later[0]) if len(later) else len(y)
        before, after = measured[measured < first][-BEYOND:], measured[measured >= end][:BEYOND]
        low, high = min([first, *before]), max([end - 1, *after])
        for column in seen.T:  # else the place is lost in pieces whose root is not measured
            own = np.flatnonzero(column)
            if len(own) and not column[low : high + 1].any():
                nearest = own[np.abs(own - first).argmin()]
                low, high = min(low, nearest - BEYOND), max(high, nearest + BEYOND)
        yield slice(first, end), slice(max(int(low), 0), int(high) + 1)
        first = end


def _filled(
    slds: SLDS, y: Array, rng: np.random.Generator, recurrent: bool, constants: Mapping[str, float]
) -> Gaussian:
    """The poses of one piece and of the frames around it."""
    placed = _placed(slds)
    placed, by_one = (model.with_constants(constants) for model in (placed, by_motion(placed)))
    slds = slds.with_constants(constants)
    local = from_origin(y, slds.names, slds.travelling)
    x = np.repeat(viterbi(by_one, local).states.mean[None], PATHS, 0)
    for _ in range(ROUNDS):
        paths = _sample_paths(slds, x, rng, recurrent)
        on_path = [np.where(np.arange(slds.K) == path[:, None], 0.0, -np.inf) for path in paths]
        smoothed = [p.states for p in viterbi_all(placed, [local] * PATHS, on_path)]
        x = np.stack([states.mean for states in smoothed])
    covs = np.stack([states.cov for states in smoothed], axis=1)
    states = collapse(np.full((len(y), PATHS), 1.0 / PATHS), Gaussian(np.swapaxes(x, 0, 1), covs))
    return states.through(slds.C, measured_first(y - local))


def _placed(slds: SLDS) -> SLDS:
    """The system with an unknown start: a first frame that was not measured need not be at the origin."""
    places = slds.shift[:, slds.travels]
    return replace(slds, cov0=slds.cov0 + ANYWHERE * places @ places.T)


def _sample_paths(slds: SLDS, x: Array, rng: np.random.Generator, recurrent: bool) -> Ints:
    """(P, T) switch paths given the states x (P, T, N)."""
    P, T, _ = x.shape
    d, rows = len(slds.names), np.arange(P)
    ahead = apply(slds.A, x[:, :-1, None]) + slds.b
    steps = Gaussian(ahead[..., :d], slds.Q[:, :d, :d])
    log_step = log_density(steps, x[:, 1:, None, :d])
    reach = regions(slds)
    first = slds.log_pi0 + reach.log_density(x[:, 0, None])
    switch = log_switch(slds, reach, x[:, :-1, None]) if recurrent else slds.log_Pi
    log_step = switch + log_step[:, :, None]
    later = np.zeros((P, T, slds.K))
    for t in range(T - 2, -1, -1):
        later[:, t] = np.logaddexp.reduce(log_step[:, t] + later[:, t + 1, None], axis=-1)
    paths = np.empty((P, T), dtype=np.intp)
    paths[:, 0] = _draw(first + later[:, 0], rng)
    for t in range(1, T):
        paths[:, t] = _draw(log_step[rows, t - 1, paths[:, t - 1]] + later[:, t], rng)
    return paths


def _draw(log_p: Array, rng: np.random.Generator) -> Ints:
    """(P,) one index from each row of unnormalised log probabilities (P, K)."""
    heap = np.exp(log_p - log_p.max(-1, keepdims=True)).cumsum(-1)
    drawn: Ints = (heap <= rng.random((len(heap), 1)) * heap[:, -1:]).sum(-1)
    return drawn
