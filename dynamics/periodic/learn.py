"""Learning a harmonic stride from gait by expectation-maximisation.

Each sequence is cut into pieces. The E-step fits a piece (`dynamics.periodic.fit`) and linearises it there,
y = f + J (z - z0) + residual + noise; the M-step is that of this linear Gaussian model, people counted alike:

    mean, cov   moments of z over pieces and their mirror images, with an inverse Wishart prior on cov
    S           S + S W S / T,  W = sum over t, u of K[t, u] (a_t a_u' - (C^-1)_tu),  a = C^-1 (y - E y),

for the covariance S of each process whose correlation over time is K (the identity for the noise), where C
is the covariance of all that was measured. At the same linearisation the evidence never falls. The mirror
image of a piece equals it half a stride later with twin freedoms exchanged, so each is fitted only once.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_triangular

from dynamics.gaussian import Array, Ints, symmetric
from dynamics.layout import among
from dynamics.periodic.fit import Fit, Stretch
from dynamics.stride import Stride, harmonics, orders

HARMONICS = 5
LONGEST, LEAST = 3.2, 0.6  # largest and least duration of a piece, seconds
SLOWEST, QUICKEST, TRIED = 0.45, 1.9, 120  # grid of stride frequencies for the first phase, strides a second
PEOPLE = 2.0  # number of people that the prior of the covariance counts for
MANNER = float(np.radians(2.0))  # its standard deviation of a first harmonic; MANNER / h for the h-th
WAYS = 0.05  # the same for a freedom that travels, body units
HURRY = 0.3  # its standard deviation of the phase speed, radians a second
TRAVEL = 0.1  # its standard deviation of the travel, body units a second
FIRST_ANGLES = tuple(float(np.radians(sd)) for sd in (1.3, 2.0, 1.0))  # quick, slow, noise
FIRST_PLACES = (0.01, 0.02, 0.005)
FIRST_BEND, FIRST_DRIFT = 0.5, 0.2
SETTLED = 2  # rounds after which the residual is learned too
FLOOR = 1e-8  # least variance of a covariance


@dataclass(frozen=True)
class Piece:
    """Frames of one person: times t (T,) from their middle, seconds; poses y (T, M); and their weight."""

    person: str
    t: Array
    y: Array
    weight: float = 0.0


@dataclass(frozen=True)
class Moments:
    """Expected moments of one piece for the M-step.

    z, cov   : (Z,) and (Z, Z) of the numbers in `Stride`
    bend     : E u^2
    drift    : expected sum of the drift's squared components, and their number
    residual : (3, M, M) W of quick, slow and noise; None if these are not learned yet
    """

    z: Array
    cov: Array
    bend: float
    drift: tuple[float, int]
    residual: Array | None = None


def learn(
    walks: Sequence[tuple[str, Array]],
    *,
    names: Sequence[str],
    travelling: Sequence[str],
    twins: Ints,
    fps: float,
    label: str,
    rounds: int,
    tick: Callable[[], None] = lambda: None,
) -> Stride:
    """Learn the harmonic stride of one motion.

    Args:
        walks: person and sequence (T, M) in body units (leg lengths, radians), all measured; people count
            equally.
        names: the M freedoms; `travelling` those whose place is arbitrary.
        twins: (M,) each one's twin on the other side; the first that has one gives the first phase.
        tick: called after each of the rounds of EM.

    Raises:
        ValueError: no sequence of LEAST seconds, or no freedom with a twin.
    """
    if (twins == np.arange(len(names))).all():
        raise ValueError(
            "a stride needs angles of two sides, and no angle here has a twin; learn switching states"
        )
    pieces = _pieces(walks, fps)
    if not pieces:
        raise ValueError(f"no sequence of {label!r} lasts {LEAST} seconds; a stride needs longer ones")
    stride, begun = _first(pieces, tuple(names), tuple(travelling), twins, fps, label)
    for n in range(rounds):
        found = []
        for i, piece in enumerate(pieces):
            fit = Stretch(stride, 0, piece.t, piece.y).fit(*begun[i])
            begun[i] = _end(fit)
            found.append(moments(fit, residual=n >= SETTLED))
        stride = maximise(stride, pieces, found, twins)
        tick()
    return stride


def moments(fit: Fit, *, residual: bool = True) -> Moments:
    """The E-step of a piece linearised at a fit; with `residual` also its moments, which take longest."""
    Z, bend = fit.stretch.Z, fit.stretch.shift + 1
    spread, z = fit.cov, fit.z
    drifts = slice(bend + 1, None)
    squares = z[drifts] ** 2 + np.diag(spread)[drifts]
    return Moments(
        z[:Z],
        spread[:Z, :Z],
        float(z[bend] ** 2 + spread[bend, bend]),
        (float(squares.sum()), len(squares)),
        _residual_moments(fit) if residual else None,
    )


def maximise(stride: Stride, pieces: Sequence[Piece], found: Sequence[Moments], twins: Ints) -> Stride:
    """The M-step: the likeliest parameters given the moments of the pieces."""
    people = len({p.person for p in pieces})
    F = mirror_matrix(stride, twins)
    w = np.array([p.weight for p in pieces])
    both = np.concatenate([w, w]) / 2.0
    z = np.stack([m.z for m in found])
    z = np.concatenate([z, z @ F.T])
    spread = np.tensordot(w, np.stack([m.cov for m in found]), 1)
    mean = both @ z
    away = z - mean
    cov = 0.5 * (spread + F @ spread @ F.T) + away.T @ (both[:, None] * away)
    cov = (people * cov + PEOPLE * _manner(stride)) / (people + PEOPLE)
    drifted, components = w @ [m.drift for m in found]
    changed = replace(
        stride,
        mean=mean[None],
        root=np.asarray(np.linalg.cholesky(symmetric(cov))[None], dtype=float),
        bend=stride.bend * np.sqrt(w @ [m.bend for m in found]),
        drift=stride.drift * np.sqrt(drifted / components),
    )
    residuals = [m.residual for m in found if m.residual is not None]
    if not residuals:
        return changed
    W = np.tensordot(w, np.stack(residuals), 1) / (w @ [len(p.t) for p in pieces])
    W = 0.5 * (W + W[:, twins][:, :, twins])
    S = np.stack([stride.quick[0], stride.slow[0], stride.R[0]])
    S = symmetric(S + S @ W @ S) + FLOOR * np.eye(S.shape[-1])
    return replace(changed, quick=S[:1], slow=S[1:2], R=S[2:])


def mirror_matrix(stride: Stride, twins: Ints) -> Array:
    """(Z, Z) matrix from a stretch's numbers to those of its mirror image."""
    M, size, Z = len(stride.names), stride.basis, stride.mean.shape[1]
    F = np.eye(Z)
    # Half a stride on odd harmonics change sign.
    F[: M * size, : M * size] = np.kron(np.eye(M)[twins], np.diag((-1.0) ** orders(size)))
    return F


def _residual_moments(fit: Fit) -> Array:
    """(3, M, M) W of the module's equation for quick, slow and noise; all entries must be measured."""
    stretch = fit.stretch
    T, M = stretch.y.shape
    inverse = solve_triangular(stretch.L, np.eye(T * M), lower=True, check_finite=False)
    a = inverse.T @ fit.white
    known = solve_triangular(fit.factor[0], fit.slope.T, lower=True) @ inverse
    C = inverse.T @ inverse - known.T @ known
    pairs = (np.outer(a, a) - C).reshape(T, M, T, M)
    return np.asarray(np.tensordot(stretch.correlations, pairs.transpose(0, 2, 1, 3), 2))


def _end(fit: Fit) -> tuple[float, float, float]:
    """Phase, speed and bend at which a search ended, the start of the next."""
    speed, shift, bend = fit.stretch.speed, fit.stretch.shift, fit.stretch.stride.bend[0]
    return float(fit.start + fit.z[shift]), float(fit.z[speed]), float(fit.z[shift + 1] * bend)


def _pieces(walks: Sequence[tuple[str, Array]], fps: float) -> list[Piece]:
    found = []
    for person, y in walks:
        for part in np.array_split(y, max(1, int(np.ceil(len(y) / (LONGEST * fps))))):
            if len(part) >= LEAST * fps:
                t = np.arange(len(part)) / fps
                found.append(Piece(person, t - t.mean(), part))
    frames: dict[str, int] = {}
    for p in found:
        frames[p.person] = frames.get(p.person, 0) + len(p.t)
    return [replace(p, weight=len(p.t) / frames[p.person] / len(frames)) for p in found]


def _first(
    pieces: Sequence[Piece],
    names: tuple[str, ...],
    travelling: tuple[str, ...],
    twins: Ints,
    fps: float,
    label: str,
) -> tuple[Stride, list[tuple[float, float, float]]]:
    """A first model, by phases of the first difference between twins; and the start of each piece."""
    M, size, travels = len(names), 2 * HARMONICS + 1, among(names, travelling)
    pair = int(np.flatnonzero(twins != np.arange(M))[0])
    begun, z = [], []
    for p in pieces:
        phase, speed = _sinusoid(p.t, p.y[:, pair] - p.y[:, twins[pair]])
        begun.append((phase, speed, 0.0))
        B = harmonics(phase + speed * p.t, size)
        ridge = np.diag(0.1 * np.maximum(orders(size), 1) ** 2)
        travel = np.polyfit(p.t, p.y[:, travels], 1)
        flat = p.y.copy()
        flat[:, travels] -= p.t[:, None] * travel[0] + travel[1]
        c = np.linalg.solve(B.T @ B + ridge, B.T @ flat)
        z.append(np.concatenate([c.T.ravel(), [speed], travel[0]]))
    firsts = zip(FIRST_ANGLES, FIRST_PLACES, strict=True)
    quick, slow, R = (np.diag(np.where(travels, place, angle) ** 2)[None] for angle, place in firsts)
    Z = len(z[0])
    blank = Stride(
        mean=np.zeros((1, Z)), root=np.eye(Z)[None], quick=quick, slow=slow, R=R,
        bend=np.array([FIRST_BEND]), drift=np.array([FIRST_DRIFT]),
        names=names, travelling=travelling, labels=(label,), fps=fps,
    )  # fmt: skip
    found = [Moments(one, _manner(blank), 1.0, (1.0, 1)) for one in z]
    return maximise(blank, pieces, found, twins), begun


def _sinusoid(t: Array, x: Array) -> tuple[float, float]:
    """Phase at t = 0 and phase speed (radians a second) of the best fitting sinusoid."""
    best = (np.inf, 0.0, 0.0)
    for speed in 2.0 * np.pi * np.linspace(SLOWEST, QUICKEST, TRIED):
        B = harmonics(speed * t, 3)
        b = np.linalg.lstsq(B, x, rcond=None)[0]
        best = min(best, (float(((x - B @ b) ** 2).sum()), float(np.arctan2(-b[2], b[1])), float(speed)))
    return best[1], best[2]


def _manner(stride: Stride) -> Array:
    """(Z, Z) covariance of the prior."""
    each = np.where(stride.travels, WAYS, MANNER)[:, None] / np.maximum(orders(stride.basis), 1)
    return np.diag(np.concatenate([each.ravel(), [HURRY], np.full(len(stride.travelling), TRAVEL)]) ** 2)
