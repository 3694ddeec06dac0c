"""When a foot strikes and leaves the ground, to a fraction of a frame.

A strike is near the frame in which the ankle is furthest ahead of the hip, a leaving near the one in which
the foot's tip is furthest behind it (Zeni, Richards and Higginson, 2008). How far from there the foot meets
the ground depends on the person and the pace, and the ways of ankle and toe tell it. With P the frames of a
stride and x those ways at the times t + P WINDOW, less their means over them,

    moment = t + P (b + w . x).

b and w are ridge regressions, for walks and runs by themselves, on captures of people whose feet are known in
space; `tests.benchmarks.gait.learn` makes those that ship. A track without toes has ones of ankles alone.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from importlib import resources

import numpy as np
from numpy.typing import NDArray

from dynamics.gaussian import Array, transpose
from kinematics.sides import Side
from kinematics.spm import joint_jacobian, joints
from tracker.run.track import Track, blocks

REACH = 0.2  # leg lengths that the ankle swings at least; less is no stride
PROMINENCE = 0.4  # of that swing, by which an extreme stands out
SMOOTH = 0.03  # seconds, of the Gaussian under which extremes are looked for
WINDOW = np.linspace(-0.1, 0.1, 5)  # of a stride
STRIKE, OFF = "strike", "off"


@dataclass(frozen=True)
class Event:
    """A moment in frames with a fraction, and its standard errors.

    error  : its own, of the pose's covariance and of what strides differ by
    shared : what all of the clip's moments of this kind are early or late by
    """

    at: float
    error: float
    shared: float


@dataclass(frozen=True)
class Weights:
    """Where one kind of moment is, of walks or runs, all in shares of a stride.

    base   : b, how late it is at the mean
    w      : (C, W) of the ways by channel and time
    error  : standard deviation of what is left, within a capture
    shared : that of captures' means
    """

    base: float
    w: Array
    error: float
    shared: float


@dataclass(frozen=True)
class Way:
    """The ankle and, where the figure has one, the toe of a leg, from the hip.

    places : (T, C) leg lengths: ankle ahead and up, toe ahead and up
    covs   : (T, C, C)
    """

    places: Array
    covs: Array

    @classmethod
    def of(cls, track: Track, side: Side) -> "Way":
        names = [f"{side}_{joint}" for joint in ("ankle", "toe") if f"{side}_{joint}" in track.figure.joints]
        chosen = [track.figure.joints.index(name) for name in names]
        places, C = joints(track.figure, track.q), 2 * len(chosen)
        covs = np.empty((len(track), C, C))
        for some in blocks(len(track)):
            J = joint_jacobian(track.figure, track.q[some])
            J = (J[:, chosen] - J[:, :1]).reshape(len(J), C, -1)
            covs[some] = J @ track.cov[some] @ transpose(J)
        return cls((places[:, chosen] - places[:, :1]).reshape(len(track), C), covs)

    @property
    def back(self) -> "Way":
        """With time running backwards: who walks backwards then walks forwards."""
        return Way(self.places[::-1], self.covs[::-1])

    @property
    def toes(self) -> bool:
        return bool(self.places.shape[1] > 2)

    def turns(self, fps: float) -> dict[str, NDArray[np.intp]]:
        """Frames near which the foot strikes and leaves the ground."""
        ankle, tip = (_smoothed(self.places[:, c], SMOOTH * fps) for c in (0, self.places.shape[1] - 2))
        if len(ankle) < 3 or np.ptp(np.percentile(ankle, (5, 95))) < REACH:
            return {name: np.zeros(0, np.intp) for name in (STRIKE, OFF)}
        return {
            name: _peaks(x, PROMINENCE * float(np.ptp(np.percentile(x, (5, 95)))))
            for name, x in ((STRIKE, ankle), (OFF, -tip))
        }

    def around(self, t: int, period: float) -> Array | None:
        """x at a frame, (C, W); None where the clip does not reach so far."""
        sampled = _sampling(t, period, len(self.places))
        return None if sampled is None else (sampled[1] @ self.places[sampled[0]]).T

    def moments(self, turns: NDArray[np.intp], period: float, weights: Weights) -> Iterator[Event]:
        """The moments near some frames, where the clip reaches far enough around them."""
        for t in turns:
            sampled = _sampling(int(t), period, len(self.places))
            if sampled is not None:
                rows, mix = sampled
                by_row = weights.w @ mix
                late = weights.base + float((by_row * self.places[rows].T).sum())
                noise = np.einsum("cr,rcd,dr->", by_row, self.covs[rows], by_row)
                error = period * float(np.sqrt(weights.error**2 + noise))
                yield Event(float(t + period * late), error, period * weights.shared)


def read_weights() -> dict[str, Weights]:
    """The weights that ship, by the names that `named` gives."""
    source = resources.files("tracker.gait") / "moments.npz"
    with resources.as_file(source) as file, np.load(file) as stored:
        return {name: _unpacked(row) for name, row in stored.items()}


def _unpacked(row: Array) -> Weights:
    base, error, shared = row[:3].tolist()
    return Weights(base, row[3:].reshape(-1, len(WINDOW)), error, shared)


def named(kind: str, runs: bool, toes: bool) -> str:
    """What the weights of a kind of moment are called."""
    return f"{'run' if runs else 'walk'}_{kind}_{'toe' if toes else 'ankle'}"


def _sampling(t: int, period: float, T: int) -> tuple[slice, Array] | None:
    """Rows around a frame, and (W, R) that interpolates values in them at WINDOW, less their mean."""
    at = t + period * WINDOW
    rows = slice(int(np.floor(at[0])), int(np.ceil(at[-1])) + 1)
    if rows.start < 0 or rows.stop > T:
        return None
    mix = np.clip(1.0 - np.abs(at[:, None] - np.arange(rows.start, rows.stop)), 0.0, 1.0)
    return rows, mix - mix.mean(axis=0)


def _smoothed(values: Array, sigma: float) -> Array:
    reach = max(round(3.0 * sigma), 1)
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / max(sigma, 1e-6)) ** 2)
    return np.convolve(np.pad(values, reach, mode="edge"), kernel / kernel.sum(), mode="valid")


def _peaks(values: Array, prominence: float) -> NDArray[np.intp]:
    """Rows at which values (T,) turn down, the middle one where several are alike, that stand out.

    By the prominence they fall on either side, at least, before they are higher than the peak.
    """
    first = np.flatnonzero(np.diff(values, prepend=np.nan) != 0.0)
    last = np.append(first[1:], len(values)) - 1
    level = values[first]
    turns = np.flatnonzero((level[1:-1] > level[:-2]) & (level[1:-1] > level[2:])) + 1
    return np.array([t for t in ((first + last) // 2)[turns] if _stands_out(values, t, prominence)], np.intp)


def _stands_out(values: Array, t: int, prominence: float) -> bool:
    higher = np.flatnonzero(values > values[t])
    i = np.searchsorted(higher, t)
    start = higher[i - 1] if i > 0 else 0
    end = higher[i] + 1 if i < len(higher) else len(values)
    return bool(values[t] - max(values[start:t].min(), values[t:end].min()) >= prominence)
