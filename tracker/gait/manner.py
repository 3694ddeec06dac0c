"""Whether a figure walks or runs, decided once for the clip and for both feet.

Three cues between -1 for a walk and 1 for a run are added up:

- how far the knees bend: no capture of a walk bends them by 81 degrees, none of a run by less than 90;
- whether the hip is high or low while the feet are apart: the correlation of its height, less the slow part,
  with the ankles' distance. Who walks vaults over the standing leg; who runs flies while they are apart;
- what the motion model says of each frame.
"""

import numpy as np

from dynamics.gaussian import Array
from kinematics.sides import SIDES
from kinematics.spm import joints
from tracker.run.track import Track

BENT, WITHIN = 85.0, 10.0  # degrees of a knee's flexion: between walks and runs, and what is certain
TOP = 98.0  # per cent of frames: what counts as the most that a knee bends
SLOW = 0.8  # seconds over which the hip's height is averaged
LABELS = {"walk": -1.0, "run": 1.0}


def runs(track: Track) -> bool:
    """Whether the clip shows a run; of the walking figure."""
    return _bend(track) + _bounce(track) + _label(track) > 0.0


def _bend(track: Track) -> float:
    knees = [track.figure.index(f"knee_{side}") for side in SIDES]
    seen = track.q[track.measured]
    most = np.degrees(np.percentile(seen[:, knees], TOP, axis=0)).mean() if len(seen) else BENT
    return float(np.clip((most - BENT) / WITHIN, -1.0, 1.0))


def _bounce(track: Track) -> float:
    places = joints(track.figure, track.q)
    near, far = (places[:, track.figure.joints.index(f"{side}_ankle"), 0] for side in SIDES)
    wide = round(SLOW / max(float(np.median(np.diff(track.times))), 1e-3)) if len(track) > 1 else 1
    height = track.q[:, 1] - _mean_around(track.q[:, 1], max(wide, 1))
    apart = np.abs(near - far)
    seen = track.measured
    if seen.sum() < 3 or not (height[seen].std() > 0.0 and apart[seen].std() > 0.0):
        return 0.0
    return float(np.corrcoef(height[seen], apart[seen])[0, 1])


def _label(track: Track) -> float:
    said = [LABELS[motion] for motion in track.motions if motion in LABELS]
    return float(np.mean(said)) if said else 0.0


def _mean_around(values: Array, wide: int) -> Array:
    counts = np.convolve(np.ones(len(values)), np.ones(wide), mode="same")
    return np.asarray(np.convolve(values, np.ones(wide), mode="same")[: len(values)] / counts[: len(values)])
