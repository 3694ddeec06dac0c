"""The choice of number of switching states and order, by the likelihood of groups held out.

The likelihood of the training data rises with every state added, so it cannot choose. Here the groups
(subjects) are split into folds; every candidate learns from all folds but one and is scored on that one, by
the log likelihood of the best paths per measured frame. Groups count equally, by weights in learning and by a
mean over them in scoring.

Of the candidates that are not clearly worse than the best one the simplest is taken: those whose groups fall
short of the best candidate's by no more than one standard error of that difference, group by group
(Breiman et al. 1984, section 3.4.3, with paired differences, since some subjects are harder for everyone).
"""

from collections.abc import Callable, Sequence

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
    begin: Callable[[], Infer] = lambda: viterbi_all,
) -> tuple[Options, Array]:
    """Learn every candidate on all folds but one, score it on that one, and choose.

    Args:
        sequences, names, travelling, fps, begin: as for `learn`.
        groups: the group of each sequence; a group is never split between folds.
        folds: number of folds; more than there are groups means leaving out one group at a time.

    Returns:
        The chosen candidate, and (candidates, groups) log likelihood in nats a measured frame of each group
        when held out, groups sorted by name.

    Raises:
        ValueError: fewer than two groups, or sequences that cannot be learned from.
    """
    held, group = np.unique(groups, return_inverse=True)
    if len(held) < 2 or folds < 2:
        raise ValueError(f"choosing needs two folds and two groups at least; got {folds} and {len(held)}")
    ys = [from_origin(y, names, travelling) for y in sequences]
    frames = np.bincount(group, [(~np.isnan(y)).any(1).sum() for y in ys])
    if not frames.all():
        raise ValueError(f"group {str(held[frames.argmin()])!r} measured nothing; leave it out")
    weights = 1.0 / frames[group]
    values = np.empty((len(candidates), len(held)))
    for row, options in zip(values, candidates, strict=True):
        scores = np.zeros(len(ys))
        for n in range(min(folds, len(held))):
            kept, out = np.flatnonzero(group % folds != n), np.flatnonzero(group % folds == n)
            fit = learn(
                [ys[i] for i in kept],
                names=names,
                travelling=travelling,
                fps=fps,
                label="candidate",
                options=options,
                weights=weights[kept],
                begin=begin,
            )
            scores[out] = best_log_p_all(fit.slds, [ys[i] for i in out])
        row[:] = np.bincount(group, scores) / frames
    sizes = [_parameters(o, Layout(tuple(names), tuple(travelling), o.order)) for o in candidates]
    return candidates[_simplest(values, sizes)], values


def _simplest(values: Array, sizes: Sequence[int]) -> int:
    """Position of the candidate to choose, from values (candidates, groups)."""
    means = values.mean(1)
    behind = values[means.argmax()] - values
    error = behind.std(1, ddof=1) / np.sqrt(values.shape[1])
    return min(np.flatnonzero(behind.mean(1) <= error).tolist(), key=lambda n: (sizes[n], -means[n]))


def _parameters(options: Options, layout: Layout) -> int:
    """Number of free parameters of the switching dynamics: coefficients, offsets, noise and transitions."""
    K = options.states
    d, regressors = layout.steady.shape
    return int(K * (d * regressors + d * (d + 1) // 2 + K - 1))
