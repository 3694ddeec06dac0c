"""A figure followed through a clip."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dynamics.gaussian import Array, transpose
from kinematics.figure import ROOT, Figure
from kinematics.spm import View, angle_gradients, joint_jacobian, joints
from tracker.loop.outcome import Outcome
from tracker.progress import tally

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

SPACE = ("x", "y")
ALL, BLOCK = slice(None), 512  # all rows; rows in a block
WITHIN = 0.1  # radius in the definition of `likelihood`, leg lengths
FREE = "free"  # label of the switching state for motion that no learned state predicts


def blocks(T: int) -> Iterator[slice]:
    """T rows in blocks, so that derivatives by the pose are in memory for one block at a time."""
    for t in range(0, T, BLOCK):
        yield slice(t, t + BLOCK)


@dataclass(frozen=True, repr=False)
class Track:
    """A figure followed through the frames first .. first + T - 1 of a clip.

    figure, view : with this person's lengths; the view at the start, in which the scene is at rest
    model   : name of the motion model; `labels` (K,) of its switching states
    first   : frame of the first row
    times   : (T,) seconds
    q, cov  : (T, D) and (T, D, D) belief over the pose; covariances in single precision
    s       : (T,) most probable switching state
    motions : (T,) motion of each frame: a label of the model, or "free" if none fits
    outcome : (T,) of each frame
    moved   : (T, 3) how a moving camera has moved the scene since the start, see `View.moved`
    mark    : standard deviation of a marked joint's place on its links, leg lengths; no frame measures it
    misnamed: probability that the legs are named the wrong way round throughout; not included in `cov`
    before  : (first,) seconds of the frames before the first row; () if they are spaced evenly
    """

    figure: Figure
    view: View
    model: str
    labels: tuple[str, ...]
    first: int
    times: Array
    q: Array
    cov: Array
    s: NDArray[np.intp]
    motions: tuple[str, ...]
    outcome: tuple[Outcome, ...]
    moved: Array
    mark: float
    misnamed: float = 0.0
    before: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "outcome", tuple(map(Outcome, self.outcome)))

    def __len__(self) -> int:
        return len(self.q)

    def __repr__(self) -> str:
        last = self.first + len(self) - 1
        return f"<Track with {self.model}: frames {self.first} to {last}, {tally(self.outcome)}>"

    @cached_property
    def measured(self) -> NDArray[np.bool_]:
        """(T,) whether the picture measured the pose; read-only."""
        measured = np.array([outcome.measured for outcome in self.outcome], dtype=bool)
        measured.setflags(write=False)
        return measured

    def view_at(self, t: int) -> View:
        return self.view.moved(self.moved[t])

    def joints(self, rows: slice = ALL) -> Array:
        """(T, J, 2) pixels of some rows, in the order of `figure.joints`."""
        return self.in_frames(joints(self.figure, self.q[rows]), rows)

    def in_frames(self, points: Array, rows: slice = ALL) -> Array:
        """(T, P, 2) body coordinates in some rows to pixels."""
        away, zoom = self.moved[rows, None, :2], self.moved[rows, None, 2:]
        return self.view.origin + away + zoom * points * self.view.axes

    def joint_covs(self, rows: slice = ALL) -> Array:
        """(T, J, 2, 2) covariance of each joint in some rows, px^2: from the pose and its mark's error.

        If the legs may be misnamed, with the probability p, it is the second moment about the place x of the
        mixture with the joint's twin, N(x', P'): (1 - p) P + p (P' + (x' - x) (x' - x)').
        """
        q, cov, axes = self.q[rows], self.cov[rows], self.moved[rows, 2:] * self.view.axes
        out = np.empty((len(q), len(self.figure.joints), 2, 2))
        for some in blocks(len(q)):
            J = joint_jacobian(self.figure, q[some]) * axes[some, None, :, None]
            marked = (self.mark * np.eye(2) * axes[some, None, None]) ** 2
            out[some] = J @ cov[some, None] @ transpose(J) + marked
        if self.misnamed:
            twin, places = self.figure.joint_twins, self.joints(rows)
            apart = (places[:, twin] - places)[..., None]
            out = (1.0 - self.misnamed) * out + self.misnamed * (out[:, twin] + apart * transpose(apart))
        return out

    def sigma(self, k: int) -> Array:
        """(T,) standard deviation of an angle of the pose between marked joints, radians: from the pose and,
        as for `joint_covs`, from the error of their marks; with its mixture if the legs may be misnamed."""
        own, other = (self.cov[:, i, i] + self._marked_angles[:, i] for i in (k, self.figure.exchanged[k]))
        apart = self.q[:, self.figure.exchanged[k]] - self.q[:, k]
        return np.asarray(np.sqrt((1.0 - self.misnamed) * own + self.misnamed * (other + apart**2)))

    @cached_property
    def _marked_angles(self) -> Array:
        """(T, D) variance of the angles by the error of marks, radians squared; 0 for other freedoms."""
        found, layout = np.zeros(self.q.shape), self.figure.layout
        for some in blocks(len(found)):
            squares = np.square(self.mark * angle_gradients(self.figure, self.q[some])).sum((-2, -1))
            found[some, layout.angle[layout.turns]] = squares[:, layout.turns]
        return found

    def to_dataframe(self) -> "pd.DataFrame":
        """A row a frame: time_s, motion, outcome, the pose, and joints as NAME_x and NAME_y, pixels.

        Angles are in degrees, the root in leg lengths. ImportError: pandas is not installed.
        """
        try:
            import pandas as pd
        except ImportError as error:
            raise ImportError(
                'a table wants pandas; pip install ".[data]" in the clone, or pandas'
            ) from error
        columns: dict[str, object] = {
            "time_s": self.times,
            "motion": self.motions,
            "outcome": [str(outcome) for outcome in self.outcome],
        }
        for k, name in enumerate(self.figure.pose_freedoms):
            columns[name] = self.q[:, k] if name in ROOT else np.degrees(self.q[:, k])
        for name, places in zip(self.figure.joints, np.moveaxis(self.joints(), 1, 0), strict=True):
            columns |= {f"{name}_{axis}": places[:, a] for a, axis in enumerate(SPACE)}
        frames = pd.RangeIndex(self.first, self.first + len(self), name="frame")
        return pd.DataFrame(columns, index=frames)

    def to_xarray(self) -> "xr.Dataset":
        """Positions in pixels, and their likelihood as `confidence`, in the layout of `movement` 0.15.

        ImportError: xarray is not installed.
        """
        try:
            import xarray as xr
        except ImportError as error:
            raise ImportError(
                'a dataset wants xarray; pip install ".[data]" in the clone, or xarray'
            ) from error
        position = np.moveaxis(self.joints(), 2, 1)[..., None]
        sure = likelihood(self.joint_covs(), self.view.unit, self.measured)[..., None]
        step = float(np.diff(self.times).mean()) if len(self) > 1 else float("nan")
        return xr.Dataset(
            {
                "position": (("time", "space", "keypoints", "individuals"), position),
                "confidence": (("time", "keypoints", "individuals"), sure),
            },
            {
                "time": self.times,
                "space": list(SPACE),
                "keypoints": list(self.figure.joints),
                "individuals": [self.figure.name],
            },
            {"source_software": "figtrack", "ds_type": "poses", "fps": 1.0 / step, "time_unit": "seconds"},
        )


def likelihood(covs: Array, leg: float, measured: NDArray[np.bool_]) -> Array:
    """(T, J) likelihood of an error of each joint below r = 0.1 leg lengths: 1 - exp(-r^2 / tr S).

    For a round covariance S, (T, J, 2, 2) px^2, that is the probability; it is 0 in frames that are not
    `measured`. `leg` is a leg length in pixels.
    """
    far = (WITHIN * leg) ** 2 / np.maximum(np.trace(covs, axis1=2, axis2=3), 1e-9)
    return np.where(measured[:, None] & np.isfinite(far), -np.expm1(-far), 0.0)
