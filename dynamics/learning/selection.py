"""How many switching states, of which order: by the likelihood of groups held out.

Maximum likelihood's own value rises with every state added, so it cannot choose. Here the groups (subjects)
are dealt out to folds; every candidate learns from all folds but one and is scored on that one, in log
likelihood of the best paths per measured frame. Groups count alike, in learning by weights and in scoring by
a mean over them.

Of the candidates that are not clearly worse than the best one the simplest is taken: those whose groups fall
short of the best candidate's by no more than one standard error of that difference, group by group
(Breiman et al. 1984, section 3.4.3, with paired differences, since some subjects are harder for everyone).
"""

from collections.abc import Sequence

import numpy as np

from dynamics.gaussian import Array
from dynamics.layout import Layout
from dynamics.learning.em import from_origin, learn
from dynamics.learning.options import Options
from dynamics.posterior import Infer
from dynamics.viterbi import best_log_p_all, viterbi_all


def choose(
    sequences: Sequence[Array],
    groups: Sequence[str],
    candidates: Sequence[Options],
    *,
    names: Sequence[str],
    travelling: Sequence[str],
    fps: float,
    folds: int = 5,
    infer: Infer = viterbi_all,
) -> tuple[Options, Array]:
    """Learn every candidate on all folds but one, score it on that one, and choose.

    Args:
        sequences, names, travelling, fps, infer: as for `learn`.
        groups: the group of each sequence; a group is never split between folds.
        folds: in how many parts to deal the groups; more than there are groups leaves out one at a time.

    Returns:
        The candidate to take, and (candidates, groups) nats a measured frame of each group held out, by name.

    Raises:
        ValueError: fewer than two groups, no candidates, or sequences that cannot be learned from.
    """
    held = sorted(set(groups))
    if len(groups) != len(sequences):
        raise ValueError(f"every sequence needs a group; got {len(groups)} for {len(sequences)} sequences")
    if len(held) < 2 or folds < 2:
        raise ValueError(f"choosing needs two folds and two groups at least; got {folds} and {len(held)}")
    if not candidates:
        raise ValueError("choosing needs at least one candidate; got none")
    ys = [from_origin(y, names, travelling) for y in sequences]
    fold = {group: n % folds for n, group in enumerate(held)}
    of = np.array([fold[group] for group in groups])
    frames = _per_group([float((~np.isnan(y)).any(1).sum()) for y in ys], groups, held)
    if not frames.all():
        raise ValueError(f"group {held[int(frames.argmin())]!r} measured nothing; leave it out")
    weights = np.array([1.0 / frames[held.index(group)] for group in groups])
    values = np.empty((len(candidates), len(held)))
    for row, options in zip(values, candidates, strict=True):
        scores = np.zeros(len(ys))
        for n in range(max(fold.values()) + 1):
            kept, out = np.flatnonzero(of != n), np.flatnonzero(of == n)
            fit = learn(
                [ys[i] for i in kept],
                names=names,
                travelling=travelling,
                fps=fps,
                label="candidate",
                options=options,
                weights=weights[kept],
                infer=infer,
            )
            scores[out] = best_log_p_all(fit.slds, [ys[i] for i in out])
        row[:] = _per_group(scores, groups, held) / frames
    layouts = [Layout(tuple(names), tuple(travelling), options.order) for options in candidates]
    sizes = [_parameters(*each) for each in zip(candidates, layouts, strict=True)]
    return candidates[_simplest(values, sizes)], values


def _simplest(values: Array, sizes: Sequence[int]) -> int:
    """Which of the candidates, of values (candidates, groups), is the one to take."""
    means = values.mean(1)
    behind = values[means.argmax()] - values
    error = behind.std(1, ddof=1) / np.sqrt(values.shape[1])
    return min(np.flatnonzero(behind.mean(1) <= error).tolist(), key=lambda n: (sizes[n], -means[n]))


def _per_group(values: Sequence[float] | Array, groups: Sequence[str], held: Sequence[str]) -> Array:
    """(len(held),) sum of the values of each group."""
    return np.array([sum(v for v, g in zip(values, groups, strict=True) if g == group) for group in held])


def _parameters(options: Options, layout: Layout) -> int:
    """How many numbers the switching dynamics have free: coefficients, offsets, noise and transitions."""
    K = options.states
    d, regressors = layout.steady.shape
    return int(K * (d * regressors + d * (d + 1) // 2 + K - 1))
