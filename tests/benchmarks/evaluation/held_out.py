"""Settings chosen by their mean error over clips: over all of them, and for each clip over the others."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tests.benchmarks.evaluation.cases import Outcome
from tests.benchmarks.evaluation.ways import Values


@dataclass(frozen=True)
class Tuned:
    """What was chosen.

    best     : values with the least mean error over all clips
    tuned    : outcomes of all clips with these
    chosen   : for each clip, the values that are best on the others
    held_out : outcome of each clip with these
    """

    best: Values
    tuned: list[Outcome]
    chosen: list[Values]
    held_out: list[Outcome]

    @property
    def ratio(self) -> float:
        """Mean error held out against tuned; 1 where tuning fits nothing that the clips do not share."""
        return mean_error(self.held_out) / mean_error(self.tuned)


def tune(results: Mapping[Values, Sequence[Outcome]]) -> Tuned:
    """Choose among the outcomes (clips) of each combination of values."""
    clips = len(next(iter(results.values())))
    best = _best(results, range(clips))
    chosen = [_best(results, [other for other in range(clips) if other != clip]) for clip in range(clips)]
    held_out = [results[values][clip] for clip, values in enumerate(chosen)]
    return Tuned(best, list(results[best]), chosen, held_out)


def mean_error(outcomes: Sequence[Outcome]) -> float:
    """Mean over clips of the mean error, leg lengths."""
    return float(np.mean([found.score.mean_error_leg for found in outcomes]))


def _best(results: Mapping[Values, Sequence[Outcome]], clips: Sequence[int]) -> Values:
    return min(results, key=lambda values: mean_error([results[values][clip] for clip in clips]))
