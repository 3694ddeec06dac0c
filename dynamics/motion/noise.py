"""Measurements noisier than those a model was learned from."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from dynamics.gaussian import Array
from dynamics.slds import SLDS
from dynamics.viterbi import best_log_p_all

LEAST, MOST = 1e-3, 0.5  # standard deviations that are tried, radians or leg lengths
STEP = 0.05  # of the logarithm of a deviation: what the search stops within
FRAMES = 1500  # as many tell the noise well enough
STRANGER = float(np.radians(10.0))  # by which people who were not learned from differ, as measured noise
SEARCHES = 5  # of the noise at most: both kinds together, then each in turn, twice


def at_noise(slds: SLDS, ys: Sequence[Array], tick: Callable[[], None] = lambda: None) -> SLDS:
    """The model with R raised to the noise of sequences (T, M), NaN where not measured: what makes them most
    likely.

    One variance is added to the freedoms that stay, another to those that travel; a model that was learned at
    more noise than it meets keeps its own R. Both are sought together first, then each in turn, lest one take
    what is the other's. `tick` is called SEARCHES times.
    """
    if not len(ys):
        return slds
    some = _some(ys)
    travels = slds.travels
    measured = np.asarray(np.isfinite(np.concatenate(some)).any(0))
    kinds = [kind for kind in (~travels & measured, travels & measured) if kind.any()]
    searches = [measured, *kinds, *kinds] if len(kinds) > 1 else kinds
    variance = np.zeros(len(slds.names))
    for n in range(SEARCHES):
        if n < len(searches):
            variance = _likeliest(slds, some, variance, searches[n])
        tick()
    return replace(slds, R=slds.R + np.diag(variance)) if variance.any() else slds


def among_strangers(slds: SLDS, deviation: float = STRANGER) -> SLDS:
    """The model with R raised for people it was not learned from, in all freedoms that stay.

    How somebody differs from those learned from is no white noise: a filter follows it, so forecasts hide it
    and `at_noise` does not find it. But it makes every motion's dynamics too sure of themselves, those most
    that know least of such people. The deviation was chosen for classification, leaving people out
    (docs/motion.md): 5 to 15 degrees do about alike, none has two to four times as many frames wrong.
    """
    return replace(slds, R=slds.R + np.diag(np.where(slds.travels, 0.0, deviation**2)))


def _likeliest(slds: SLDS, ys: Sequence[Array], variance: Array, freedoms: NDArray[np.bool_]) -> Array:
    """The added variance (M,) with that of these freedoms (M,) replaced by the most likely one."""

    def changed(log_deviation: float) -> Array:
        return np.where(freedoms, np.exp(2.0 * log_deviation), variance)

    def cost(added: Array) -> float:
        noisy = replace(slds, R=slds.R + np.diag(added))
        return -sum(best_log_p_all(noisy, ys))

    bounds = (float(np.log(LEAST)), float(np.log(MOST)))
    found = minimize_scalar(
        lambda x: cost(changed(x)), bounds=bounds, method="bounded", options={"xatol": STEP}
    )
    none = np.where(freedoms, 0.0, variance)
    return changed(float(found.x)) if found.fun < cost(none) else none


def _some(ys: Sequence[Array]) -> list[Array]:
    """Whole sequences, spread over all, of about FRAMES frames; of a long one its first."""
    every = max(1, sum(len(y) for y in ys) // FRAMES)
    return [y[:FRAMES] for y in ys[::every]]
