"""Gaps filled by the harmonic stride.

The model is fitted to a window of measurements around each gap. Every motion, and every start of the search
that ends elsewhere, above all with another number of strides in the gap, is a hypothesis weighted by its
evidence; the result has the moments of their mixture. Long runs that lack single freedoms are cut.

The search for phase, phase speed and bend begins at the peaks of a grid, scored with the mean stride: each
frame counts as the share SHARE of an independent one, and differences between people count as noise.

Whether a gap belongs to a gait is decided by the evidence of frames SPACING seconds apart. A model must
bridge the time between them as in a short gap; successive frames of any smooth motion are too easy.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dynamics.gaussian import Array, Gaussian, Ints, collapse
from dynamics.periodic.fit import Fit, Stretch
from dynamics.stride import Stride, harmonics

CONTEXT = 2.0  # seconds of measured frames used on either side; of fewer frames a second twice as long
SPACING = 0.2  # seconds between the frames whose evidence is compared
OFTEN = 30.0  # frames a second of the context that are used: memory grows with their square
PIECE = 2.0  # seconds of frames partly measured that are filled at once
STARTS = 6  # starts of the search for each motion
ROUGH = 2  # steps from each start, after which
BEHIND = 25.0  # nats behind the best end a search
MOST = 1800  # frames in a gap: time grows with their cube
APART = 0.5  # least difference in phase between two distinct fits, radians
NOISES = (0.02, 0.04, 0.07, 0.12, 0.2)  # standard deviations tried on top of the learned noise, radians
PLACE_NOISE = 0.3  # noise of a freedom that travels relative to that of an angle, leg lengths a radian
DOUBT = 0.3  # power of the evidence in weights: people not learned from differ from the population
FAINT = 1e-3  # hypotheses with a smaller share are left out
# Of the grid that the search begins on:
SPEEDS, PHASES = 24, 24
REACH = 2.8  # standard deviations of the phase speed either way
BENDS = (-1.5, -0.75, 0.0, 0.75, 1.5)  # standard deviations of the bend
SHARE = 0.15
TABLE = 120  # phases at which the mean stride is tabulated
SLOWEST = 2.0  # least phase speed, radians a second


@dataclass(frozen=True)
class Filling:
    """The frames of one gap.

    rows         : (m,) frames of the sequence
    poses        : mean (m, M), cov (m, M, M) without measurement noise, given the measurements around it
    log_evidence : of frames around it SPACING seconds apart, under the most probable hypothesis and noise,
                   nats; all motions equally probable beforehand
    """

    rows: Ints
    poses: Gaussian
    log_evidence: float


def gaps(stride: Stride, y: Array, fps: float) -> Iterator[Ints]:
    """The frames of each gap: runs of frames that lack a freedom, cut into pieces where most is measured.

    NaN entries of y (T, M) were not measured; a travelling freedom that was never measured makes no gap.
    """
    wanted = ~stride.travels | np.isfinite(y).any(0)
    lacking = np.flatnonzero(np.isnan(y[:, wanted]).any(1))
    for run in np.split(lacking, np.flatnonzero(np.diff(lacking) > 1) + 1):
        if len(run):
            measured = np.cumsum(np.isfinite(y[run]).any(1))
            yield from np.split(run, np.flatnonzero(np.diff(measured // max(1, round(PIECE * fps)))) + 1)


def fill(stride: Stride, y: Array, rows: Ints, fps: float) -> Filling:
    """Fill one gap, the successive frames `rows`, with the noise that makes its neighbours most likely.

    ValueError: no angle was measured near it, or it has more than MOST frames.
    """
    if len(rows) > MOST:
        raise ValueError(
            f"a gap has {len(rows)} frames, of which a stride fills {MOST} at most; "
            "give the frames after it a seq of their own"
        )
    window = around(y, rows, fps)
    t = (np.arange(window.start, window.stop) - rows.mean()) / fps
    shown = _thinned(y[window], rows - window.start, fps)
    angles = ~stride.travels
    found = hypotheses(stride, t, np.where(angles, shown, np.nan))
    log_p = np.array([h.log_evidence for h in found])
    share = np.exp(DOUBT * (log_p - log_p.max()))
    kept = np.flatnonzero(share >= FAINT * share.sum())
    # Now the freedoms that travel are used too.
    heard = [found[i].given(shown, found[i].stretch.noise) for i in kept]
    each = [h.predict(rows - window.start) for h in heard]
    together = Gaussian(np.stack([g.mean for g in each], 1), np.stack([g.cov for g in each], 1))
    poses = collapse(np.tile(share[kept] / share[kept].sum(), (len(rows), 1)), together)
    apart = found[0].given(spaced(np.where(angles, y[window], np.nan), fps))
    return Filling(rows, poses, _evidence(apart))


def around(y: Array, rows: Ints, fps: float) -> slice:
    """The gap with CONTEXT seconds of measured frames on either side, or the fewer ones within twice that."""
    measured = np.flatnonzero(np.isfinite(y).any(1))
    near = max(1, round(CONTEXT * fps))
    before, after = measured[measured < rows[0]][-near:], measured[measured > rows[-1]][:near]
    before, after = before[before >= before[-1:] - 2 * near], after[after <= after[:1] + 2 * near]
    return slice(int(min([rows[0], *before])), int(max([rows[-1], *after])) + 1)


def spaced(y: Array, fps: float) -> Array:
    """Measured frames of y (T, M) about SPACING seconds apart, with NaN in the others."""
    return _only(y, _apart(np.flatnonzero(np.isfinite(y).any(1)), SPACING * fps))


def hypotheses(stride: Stride, t: Array, y: Array) -> list[Fit]:
    """Fits of the phase to a window (t, y as in `Stretch`), the most probable first; ValueError if no freedom
    that stays was measured in it."""
    if np.isnan(y[:, ~stride.travels]).all():
        raise ValueError(
            "no angle was measured near a gap, of which a stride then tells nothing; give a switching model"
        )
    rough = []
    for k in range(len(stride.labels)):
        stretch = Stretch(stride, k, t, y)
        rough += [stretch.fit(*start, ROUGH) for start in starts(stride, k, t, y)]
    best = max(h.log_evidence for h in rough)
    climbed = [h.climbed() for h in rough if h.log_evidence > best - BEHIND]
    noise = _likeliest_noise(max(climbed, key=lambda h: h.log_evidence))
    return _distinct([_at_noise(h, noise) for h in climbed] if noise > 0.0 else climbed)


def starts(stride: Stride, k: int, t: Array, y: Array) -> list[tuple[float, float, float]]:
    """Phase at the origin (radians), phase speed and its bend of the STARTS best peaks of the grid for motion
    k, the best first.

    At times t (T,) seconds from the origin; NaN entries of y (T, M) were not measured, what travels not used.
    """
    at = len(stride.names) * stride.basis
    centre, deviation = stride.mean[k, at], np.linalg.norm(stride.root[k, at])
    speeds = np.linspace(centre - REACH * deviation, centre + REACH * deviation, SPEEDS)
    speeds = speeds[speeds > SLOWEST]
    phases = 2.0 * np.pi * np.arange(PHASES) / PHASES
    bends = np.array(BENDS)
    rows = np.flatnonzero(np.isfinite(y[:, ~stride.travels]).any(1))
    d = t[rows]
    phase = phases[:, None] + speeds[:, None, None, None] * d + (bends * stride.bend[k])[:, None, None] * d**2
    score = SHARE * _fits(stride, k, phase, y[rows])
    score -= 0.5 * (((speeds - centre) / deviation) ** 2)[:, None, None] + 0.5 * bends[:, None] ** 2
    best = score.max(1)
    peaks = sorted(_peaks(best), key=lambda peak: -best[peak])[:STARTS]
    return [(phases[j], speeds[i], bends[score[i, :, j].argmax()] * stride.bend[k]) for i, j in peaks]


def _thinned(y: Array, rows: Ints, fps: float) -> Array:
    """y (T, M) with NaN in measured frames that are not needed around a gap: the nearest on either side and
    OFTEN a second farther out remain, and all within it."""
    measured = np.flatnonzero(np.isfinite(y).any(1))
    before, after = measured[measured < rows[0]], measured[measured > rows[-1]]
    return _only(y, np.concatenate([_apart(before[::-1], fps / OFTEN), rows, _apart(after, fps / OFTEN)]))


def _apart(rows: Ints, frames: float) -> Ints:
    """Every n-th of the rows, so that neighbours are mostly about so many frames apart, or farther."""
    usual = np.median(np.abs(np.diff(rows))) if len(rows) > 1 else 1.0
    return rows[:: max(1, round(frames / float(usual)))]


def _only(y: Array, rows: Ints) -> Array:
    """y (T, M) with NaN in all other rows."""
    out = np.full_like(y, np.nan)
    out[rows] = y[rows]
    return out


def _evidence(apart: Fit) -> float:
    likeliest = _at_noise(apart, _likeliest_noise(apart))
    return likeliest.log_evidence - float(np.log(len(apart.stretch.stride.labels)))


def _likeliest_noise(h: Fit) -> float:
    """The added standard deviation that makes a window most probable: NOISES are tried until one is worse."""
    best, log_evidence = 0.0, h.log_evidence
    for noise in NOISES:
        h = _at_noise(h, noise)
        if h.log_evidence <= log_evidence:
            break
        best, log_evidence = noise, h.log_evidence
    return best


def _at_noise(h: Fit, noise: float) -> Fit:
    """The fit with measurement noise of this standard deviation in radians added."""
    return h.given(h.stretch.y, np.where(h.stretch.stride.travels, PLACE_NOISE * noise, noise) ** 2)


def _distinct(found: list[Fit]) -> list[Fit]:
    """The distinct fits, the most probable first."""
    kept: list[Fit] = []
    for h in sorted(found, key=lambda h: -h.log_evidence):
        if not any(h.stretch.k == other.stretch.k and _same(h.phase, other.phase) for other in kept):
            kept.append(h)
    return kept


def _same(one: Array, other: Array) -> bool:
    """Whether two phases over time differ only by a whole number of strides."""
    apart = one - other
    turns = 2.0 * np.pi * np.round(apart.mean() / (2.0 * np.pi))
    return bool(np.abs(apart - turns).max() < APART)


def _fits(stride: Stride, k: int, phase: Array, y: Array) -> Array:
    """(...) log density of poses (T, M) at phases (..., T), as if frames and freedoms were independent."""
    size = stride.basis
    table = harmonics(2.0 * np.pi * np.arange(TABLE) / TABLE, size)
    at = np.round(phase * (TABLE / (2.0 * np.pi))).astype(np.intp) % TABLE
    spread = np.diagonal(stride.quick[k] + stride.slow[k] + stride.R[k])
    total = np.zeros(phase.shape[:-1])
    for m in np.flatnonzero(~stride.travels):
        own = slice(m * size, (m + 1) * size)
        manner = ((table @ stride.root[k, own]) ** 2).sum(1).mean()
        apart = y[:, m] - (table @ stride.mean[k, own])[at]
        total -= 0.5 * np.nansum(apart**2, axis=-1) / (manner + spread[m])
    return total


def _peaks(score: Array) -> list[tuple[int, int]]:
    """Entries (speed, phase) that none of their eight neighbours exceeds; phases are a circle."""
    from scipy.ndimage import maximum_filter  # slow to import

    highest = maximum_filter(score, size=3, mode=("nearest", "wrap"))
    return [(int(i), int(j)) for i, j in np.argwhere(score == highest)]
