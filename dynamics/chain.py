"""The discrete chain alone: how probable each switching state is at each frame, and the best path.

Rabiner (1989), section III, with messages in logs and, backwards, in the form that smooths the filter's own
answer (as Rauch-Tung-Striebel does), so that no message is ever divided by one that has underflowed:

    a_t(j)    = log Pr(s_t = j | frames up to t) = log l_t(j) + log sum_i exp a_{t-1}(i) Pi[i, j] + const
    W_t[i, j] = Pr(s_t = i | s_{t+1} = j, frames up to t) = softmax over i of a_t(i) + log Pi[i, j]
    Pr(s_t = i, s_{t+1} = j | all frames) = W_t[i, j] Pr(s_{t+1} = j | all frames)

Only sums of probabilities run backwards, and W is found for all frames at once. Sequences of different
lengths run side by side, frames first, and each ends at its own last frame.
"""

from collections.abc import Iterable, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from dynamics.gaussian import Array, Ints

Scalar = TypeVar("Scalar", bound=np.generic)
Result = TypeVar("Result")

CROSSING = 1e-3  # probability a frame of a change from one motion to another
BATCH = 64  # sequences side by side; fewer where an array would exceed
LARGEST = 2**25  # numbers


def forward_backward(
    log_pi0: Array, log_Pi: Array, log_lik: Array, lengths: Ints
) -> tuple[Array, Array, Array]:
    """The posterior of the states of B sequences side by side; ValueError: every path of one is impossible.

    Args:
        log_pi0, log_Pi: (K,) of the first frame's state, (K, K) of state j after i; -inf where it cannot be.
        log_lik: (T, B, K) log likelihood of every state at every frame. Beyond a sequence's end the values
            must be finite; results there are meaningless.
        lengths: (B,) frames of each sequence, 1 or more.

    Returns:
        prob (T, B, K) Pr(s_t), pair (T-1, B, K, K) Pr(s_t = i, s_{t+1} = j), and (B,) log of all paths'
        sum, nats.
    """
    T, B, _ = log_lik.shape
    filtered, log_norm = np.empty_like(log_lik), np.empty((T, B))
    joint = log_pi0 + log_lik[0]
    for t in range(T):
        if t > 0:
            joint = np.logaddexp.reduce(filtered[t - 1][:, :, None] + log_Pi, 1) + log_lik[t]
        log_norm[t] = np.logaddexp.reduce(joint, 1)
        filtered[t] = joint - np.where(np.isfinite(log_norm[t]), log_norm[t], 0.0)[:, None]
    within = np.arange(T)[:, None] < lengths
    log_evidence = np.where(within, log_norm, 0.0).sum(0)
    _check_possible(log_evidence)
    come_from = filtered[:-1, :, :, None] + log_Pi
    sums = np.logaddexp.reduce(come_from, 2)
    # A state that cannot be reached has no predecessors, and no probability to pass back to any.
    come_from = np.exp(come_from - np.where(np.isfinite(sums), sums, 0.0)[:, :, None])
    prob = np.exp(filtered)
    for t in range(T - 2, -1, -1):
        goes_on = t + 1 < lengths
        handed = (come_from[t] @ prob[t + 1][:, :, None])[..., 0]
        prob[t] = np.where(goes_on[:, None], handed, prob[t])
    return prob, come_from * prob[1:, :, None], log_evidence


def best_paths(log_pi0: Array, log_Pi: Array, log_lik: Array, lengths: Ints) -> Ints:
    """The most probable path of each sequence, (T, B); arguments and errors as in `forward_backward`.

    Among equally good paths the choice is arbitrary.
    """
    T, B, _ = log_lik.shape
    rows = np.arange(B)
    values = np.empty_like(log_lik)
    back = np.zeros(log_lik.shape, dtype=np.intp)
    values[0] = log_pi0 + log_lik[0]
    for t in range(1, T):
        total = values[t - 1][:, :, None] + log_Pi
        back[t] = total.argmax(1)
        values[t] = total.max(1) + log_lik[t]
    _check_possible(values[lengths - 1, rows].max(-1))
    path: Ints = values.argmax(-1)
    for t in range(T - 2, -1, -1):
        path[t] = np.where(t + 1 < lengths, back[t + 1, rows, path[t + 1]], path[t])
    return path


def side_by_side(ys: Sequence[Array], fill: float) -> tuple[Array, Ints]:
    """Sequences (T, ...) of any lengths as one array (longest T, B, ...), filled up, and the lengths."""
    lengths = np.array([len(y) for y in ys], dtype=np.intp)
    padded = np.full((lengths.max(), len(ys), *np.shape(ys[0])[1:]), fill)
    for n, y in enumerate(ys):
        padded[: len(y), n] = y
    return padded, lengths


def batches(ys: Sequence[Array], numbers: int = 0, most: int = BATCH) -> list[list[int]]:
    """Groups of `most` sequences to process together, with so many `numbers` a frame, longest first."""
    order = np.argsort([-len(y) for y in ys], kind="stable").tolist()
    found = []
    while order:
        size = min(max(LARGEST // max(len(ys[order[0]]) * numbers, 1), 1), most)
        found.append(order[:size])
        order = order[size:]
    return found


def in_order(chosen: Iterable[Iterable[int]], found: Iterable[Iterable[Result]]) -> list[Result]:
    """The results found for the sequences of each of the chosen groups, in the order of the sequences."""
    by_number = dict[int, Result]()
    for numbers, results in zip(chosen, found, strict=True):
        by_number |= zip(numbers, results, strict=True)
    return [by_number[n] for n in range(len(by_number))]


def split_as(rows: NDArray[Scalar], ys: Sequence[Array]) -> list[NDArray[Scalar]]:
    """The concatenated rows of all sequences, split into one array for each sequence again."""
    return np.split(rows, np.cumsum([len(y) for y in ys])[:-1])


def check_chain(pi0: Array, Pi: Array, labels: Sequence[str], fps: float) -> None:
    """ValueError unless pi0 (K,) and rows of Pi (K, K) are probabilities, labels are K texts and fps > 0."""
    if len(labels) != len(pi0):
        raise ValueError(f"every state needs a label; got {len(labels)} for {len(pi0)} states")
    if not fps > 0:
        raise ValueError(f"fps must be positive; got {fps}")
    for name, rows in (("pi0", pi0[None]), ("Pi", Pi)):
        wrong = (rows < 0).any(1) | (np.abs(rows.sum(1) - 1.0) > 1e-6)
        for i in np.flatnonzero(wrong):
            raise ValueError(
                f"{name} rows must be probabilities that sum to 1; row {i} sums to {rows[i].sum():.6f}"
            )


def joined(models: Sequence[Any], names: Sequence[str]) -> dict[str, Any]:
    """The arrays of these names, and `labels`, of several models, concatenated along the first axis."""
    arrays = {name: np.concatenate([getattr(model, name) for model in models]) for name in names}
    return arrays | {"labels": tuple(label for model in models for label in model.labels)}


def blocks(Pis: Sequence[Array], crossing: float) -> Array:
    """The transition matrix of several chains as one.

    A state leaves its own chain with probability `crossing` a frame, with equal odds to any state of others.
    """
    if len(Pis) == 1:
        return np.array(Pis[0])
    K, at = sum(len(Pi) for Pi in Pis), 0
    together = np.zeros((K, K))
    for Pi in Pis:
        block = slice(at, at + len(Pi))
        together[block] = crossing / (K - len(Pi))
        together[block, block] = (1.0 - crossing) * Pi
        at += len(Pi)
    return together


def _check_possible(log_evidence: Array) -> None:
    impossible = np.flatnonzero(~np.isfinite(log_evidence))
    if len(impossible):
        raise ValueError(
            f"no path can have made sequence {impossible[0]}: its log evidence is "
            f"{log_evidence[impossible[0]]}; let more transitions or states be possible"
        )
