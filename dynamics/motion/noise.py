"""Adapting a model to noisier measurements, and to people and motions that it was not learned from."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from dynamics.gaussian import Array, Flags
from dynamics.slds import SLDS
from dynamics.viterbi import best_log_p_all

LEAST, MOST = 1e-3, 0.5  # range of standard deviations searched, radians or leg lengths
FACTORS = 0.25, 16.0  # range of factors on Q searched
STEP = 0.05  # tolerance of the search in the logarithm of a deviation or factor
FRAMES = 1500  # frames that suffice to estimate the noise
STRANGER = float(np.radians(10.0))  # standard deviation by which people not learned from differ
SEARCHES = 5  # searches for the noise: both kinds together, then each in turn, twice


def at_noise(slds: SLDS, ys: Sequence[Array], tick: Callable[[], None] = lambda: None) -> SLDS:
    """The model with R raised to the noise that makes sequences (T, M), NaN where not measured, most likely.

    One variance is added to the freedoms that stay, another to those that travel; a model that was learned at
    more noise keeps its own R. Both are searched together first, then in turn, so that neither absorbs the
    other's share. `tick` is called SEARCHES times.
    """
    if not len(ys):
        return slds
    some = _some(ys)
    travels = slds.travels
    measured = np.asarray(np.isfinite(np.concatenate(some)).any(0))
    kinds = [kind for kind in (~travels & measured, travels & measured) if kind.any()]
    searches = [measured, *kinds, *kinds] if len(kinds) > 1 else kinds
    deviation = np.zeros(len(slds.names))
    for n in range(SEARCHES):
        if n < len(searches):
            noisy = partial(_noisy, slds, deviation, searches[n])
            deviation = np.where(searches[n], _likeliest(noisy, some, 0.0, LEAST, MOST), deviation)
        tick()
    return replace(slds, R=slds.R + np.diag(deviation**2)) if deviation.any() else slds


def among_strangers(slds: SLDS) -> SLDS:
    """The model with R raised for people it was not learned from, in all freedoms that stay.

    How a person differs from those learned from is no white noise: a filter follows it, so it hardly shows in
    forecasts and `at_noise` does not find it. But it makes every motion's likelihood too peaked, most of all
    for motions learned from few people. STRANGER was chosen for classification, leaving people out
    (docs/motion.md): 5 to 15 degrees do about equally well, 0 has two to four times as many wrong frames.
    """
    return replace(slds, R=slds.R + np.diag(np.where(slds.travels, 0.0, STRANGER**2)))


def wider(slds: SLDS) -> SLDS:
    """The model with mean postures uncertain by STRANGER, for people it was not learned from.

    cov0, and with it every state's region, grows by the variance of a common shift of all poses in a state,
    in the freedoms that stay.
    """
    apart = slds.shift * np.where(slds.travels, 0.0, STRANGER)
    return replace(slds, cov0=slds.cov0 + apart @ apart.T)


def at_process_noise(slds: SLDS, ys: Sequence[Array], tick: Callable[[], None] = lambda: None) -> SLDS:
    """The model with Q times the factor that makes sequences (T, M), NaN where not measured, most likely.

    Some people, and motions faster than those learned from, follow the dynamics less closely.
    `tick` is called once.
    """

    def changed(factor: float) -> SLDS:
        return replace(slds, Q=slds.Q * factor)

    factor = _likeliest(changed, _some(ys), 1.0, *FACTORS)
    tick()
    return slds if factor == 1.0 else changed(factor)


def _noisy(slds: SLDS, deviation: Array, freedoms: Flags, common: float) -> SLDS:
    """The model with deviations (M,) added to R, of the chosen freedoms (M,) a common one."""
    return replace(slds, R=slds.R + np.diag(np.where(freedoms, common, deviation) ** 2))


def _likeliest(
    changed: Callable[[float], SLDS], ys: Sequence[Array], none: float, low: float, high: float
) -> float:
    """The number from `low` to `high` by which the changed model makes sequences most likely, or `none`."""
    from scipy.optimize import minimize_scalar  # slow to import; labels of tracked motion do not need it

    def cost(number: float) -> float:
        return -sum(best_log_p_all(changed(number), ys))

    bounds = (np.log(low), np.log(high))
    found = minimize_scalar(
        lambda x: cost(np.exp(x)), bounds=bounds, method="bounded", options={"xatol": STEP}
    )
    return float(np.exp(found.x)) if found.fun < cost(none) else none


def _some(ys: Sequence[Array]) -> list[Array]:
    """About FRAMES frames: whole sequences, spread evenly over the list; the first frames of a long one."""
    some = [y[:FRAMES] for y in ys]
    share = FRAMES / max(FRAMES, sum(map(len, some)))
    owed, taken = 0.0, []
    for y in some:
        owed += share * len(y)
        if owed >= 0.5 * len(y):
            owed -= len(y)
            taken.append(y)
    return taken
