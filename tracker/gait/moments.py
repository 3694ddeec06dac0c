"""The moments at which a foot strikes and leaves the ground, to a fraction of a frame.

A strike is near the frame in which the ankle is furthest ahead of the hip, a leaving near the one in which
the foot's tip is furthest behind it (Zeni, Richards and Higginson, 2008). The offset of the contact from that
frame depends on the person and the pace, and is predicted from the paths of ankle and toe. With P the frames
of a stride and x those paths at the times t + P WINDOW, less their means over them,

    moment = t + P (b + w . x).

b and w are from ridge regressions, separate for walks and runs, on captures with known foot contacts;
`tests.benchmarks.gait.learn` makes the shipped ones. Tracks without toes have separate weights of ankles
only.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from importlib import resources

import numpy as np

from dynamics.gaussian import Array, Ints, transpose
from kinematics.sides import Side
from kinematics.spm import joint_jacobian, joints
from tracker.run.track import Track, blocks

REACH = 0.2  # least swing of the ankle in a stride, leg lengths
PROMINENCE = 0.4  # least prominence of an extreme as a share of that swing
SMOOTH = 0.03  # standard deviation of the smoothing before the search for extremes, seconds
WINDOW = np.linspace(-0.15, 0.15, 7)  # times of x, shares of a stride
STRIKE, OFF = "strike", "off"


@dataclass(frozen=True)
class Event:
    """A moment in fractional frames, and its standard errors.

    error  : independent error, from the pose's covariance and the variation of strides
    shared : error common to all of the clip's moments of this kind
    """

    at: float
    error: float
    shared: float


@dataclass(frozen=True)
class Weights:
    """The regression of one kind of moment, for walks or runs, in shares of a stride.

    base   : b, the mean delay
    w      : (C, W) weights of the paths by channel and time
    error  : standard deviation of the residual within a capture
    shared : standard deviation of the captures' mean residuals
    """

    base: float
    w: Array
    error: float
    shared: float


@dataclass(frozen=True)
class Way:
    """The path of the ankle and, if the figure has one, the toe of a leg, relative to the hip.

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
        """The path with time reversed, in which backward walking becomes forward walking."""
        return Way(self.places[::-1], self.covs[::-1])

    @property
    def toes(self) -> bool:
        return bool(self.places.shape[1] > 2)

    def turns(self, fps: float) -> dict[str, Ints]:
        """Frames near the strikes and leavings of the foot."""
        ankle, tip = (_smoothed(self.places[:, c], SMOOTH * fps) for c in (0, self.places.shape[1] - 2))
        if len(ankle) < 3 or np.ptp(np.percentile(ankle, (5, 95))) < REACH:
            return {name: np.zeros(0, np.intp) for name in (STRIKE, OFF)}
        return {
            name: _peaks(x, PROMINENCE * float(np.ptp(np.percentile(x, (5, 95)))))
            for name, x in ((STRIKE, ankle), (OFF, -tip))
        }

    def moments(self, turns: Ints, period: float, weights: Weights) -> Iterator[Event]:
        """The moments near these frames, if the clip contains the whole window."""
        for t in turns:
            sampled = sampling(int(t), period, len(self.places))
            if sampled is not None:
                rows, mix = sampled
                by_row = weights.w @ mix
                late = weights.base + float((by_row * self.places[rows].T).sum())
                noise = np.einsum("cr,rcd,dr->", by_row, self.covs[rows], by_row)
                error = period * float(np.sqrt(weights.error**2 + noise))
                yield Event(float(t + period * late), error, period * weights.shared)


def read_weights() -> dict[str, Weights]:
    """The shipped weights, by the names from `named`."""
    source = resources.files("tracker.gait") / "moments.npz"
    with resources.as_file(source) as file, np.load(file) as stored:
        rows = {name: np.split(row, [1, 2, 3]) for name, row in stored.items()}
    return {
        name: Weights(base.item(), w.reshape(-1, len(WINDOW)), error.item(), shared.item())
        for name, (base, error, shared, w) in rows.items()
    }


def named(kind: str, runs: bool, toes: bool) -> str:
    """The name of the weights for a kind of moment."""
    return f"{'run' if runs else 'walk'}_{kind}_{'toe' if toes else 'ankle'}"


def sampling(t: int, period: float, T: int) -> tuple[slice, Array] | None:
    """Rows around a frame, and (W, R) that interpolates values in them at WINDOW, less their mean; None if
    some of the rows lie beyond the T of the clip."""
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


def _peaks(values: Array, prominence: float) -> Ints:
    """Rows of prominent peaks of values (T,); the middle row of a plateau.

    On both sides of a peak values fall by at least the prominence before they exceed it.
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
