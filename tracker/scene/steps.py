"""A walk in body units: joint angles from Fourier series, the hip's path from contact with the floor.

Every angle is a Fourier series over one stride, phase 0 at the near heel strike:

    angle(phase) = mean + sum_h  c_h cos(2 pi h phase) + s_h sin(2 pi h phase)

The coefficients below are our own: curves as in textbooks of gait for healthy adults (Perry and Burnfield,
*Gait Analysis*; Winter, *The Biomechanics and Motor Control of Human Gait*), written from memory at a dozen
phases, expanded, and adjusted by a degree or two until the hip travels evenly over a planted foot. No
recording was used.

The floor determines the rest. With h_leg the height that a leg's hip would have over its flat foot, the hip
is at the height

    y = log(sum over legs exp(k h_leg)) / k

which is that of the longer leg, smoothed where the weight changes legs. The derivative of y by h_leg is the
leg's share of the weight; the hip moves forward by that share of each foot's backward motion, so that a foot
that bears the weight stays in place. The foot tips as far as the height of its ankle allows: on the heel at
the strike, flat, on the toe at push-off.

Lengths are in legs (thigh + shank), proportions after Drillis and Contini as in Winter, table 4.1.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

Array = NDArray[np.float64]
Series = tuple[float, tuple[tuple[float, float], ...]]

STEPS = 12  # moments of the walk's time grid in a frame

# Degrees: mean, then (c_h, s_h). Thigh: 25 ahead of the vertical at the strike, -17 at push-off, 31 in swing.
HIP: Series = (8.6, ((22.0, -5.0), (-5.4, -3.6), (-1.0, 0.5)))
# Flexion: 5 at the strike, a wave of 18 under load, 7 again before push-off, 63 in swing.
KNEE: Series = (23.0, ((-2.9, -19.9), (-15.6, 5.4), (0.2, 3.2), (0.5, -0.3)))
# Pitch of the foot without a floor, toe up positive: 18 at the strike, far down through push-off.
FOOT: Series = (-19.3, ((35.1, 15.5), (0.8, -16.9), (-4.6, -2.5)))
# Lean, with two periods a stride: furthest forward just after each strike.
TORSO: Series = (4.0, ((0.0, 0.0), (1.0, 1.1)))
NECK: Series = (9.0, ((0.0, 0.0), (-0.9, -0.6)))
# The near arm, in phase with the far leg: upper arm from the vertical, elbow flexion.
ARM: Series = (-6.0, ((-19.0, 3.0), (1.0, 0.5)))
ELBOW: Series = (24.0, ((-9.0, 2.0), (1.0, 0.0)))

WEIGHT_SHARPNESS = 80.0  # k of the equation above, per leg length


@dataclass(frozen=True)
class Build:
    """One person's lengths, in legs (thigh + shank = 1).

    ankle: height of the ankle over the sole; heel and toe: extent of the sole behind and ahead of it
    toe_height: height of the toe's mark over the sole
    """

    thigh: float
    shank: float
    torso: float
    neck: float
    upper_arm: float
    forearm: float
    ankle: float
    heel: float
    toe: float
    toe_height: float = 0.05


@dataclass(frozen=True)
class Gait:
    """A walk at S moments in time, body units: x forward, y up from the floor, angles in radians.

    pose : (S, 8) root_x, root_y, torso, neck, hip_near, knee_near, hip_far, knee_far; root_x starts at 0
    foot  : (S, 2) pitch of the near and the far foot, toe up positive
    arms  : (S, 4) near upper arm from the vertical and elbow flexion, then the far arm's
    phase : (S,) strides walked by the near leg
    """

    pose: Array
    foot: Array
    arms: Array
    phase: Array

    def at(self, moments: NDArray[np.intp]) -> "Gait":
        return Gait(self.pose[moments], self.foot[moments], self.arms[moments], self.phase[moments])


def random_build(rng: np.random.Generator) -> Build:
    """An adult's lengths: textbook proportions, each a few per cent longer or shorter."""
    thigh = 0.5 + rng.uniform(-0.012, 0.012)
    usual = np.array([0.63, 0.31, 0.37, 0.31, 0.1, 0.235])
    torso, neck, upper_arm, forearm, ankle, toe = (usual * (1.0 + rng.uniform(-0.04, 0.04, 6))).tolist()
    return Build(thigh, 1.0 - thigh, torso, neck, upper_arm, forearm, ankle, 0.075, toe)


def walk(build: Build, steps: int, stride: float, rng: np.random.Generator) -> Gait:
    """One person's walk of `steps` moments, STEPS a frame, from a random phase of the stride on; `stride` is
    the mean period in moments.

    People differ in amplitude and mean of every angle and between their legs; successive cycles differ a
    little in time and amplitude.
    """
    phase = rng.uniform() + np.arange(steps) / stride + 0.012 * _wander(steps, stride, rng)
    far_phase = phase + 0.5 + rng.normal(0.0, 0.006)

    def angle(series: Series, phases: Array, spread: float) -> Array:
        size = 1.0 + np.clip(rng.normal(0.0, 0.05), -0.1, 0.1) + 0.02 * _wander(steps, stride, rng)
        offset = np.radians(spread) * np.clip(rng.normal(), -2.0, 2.0)
        return np.asarray(_series(series, phases, size) + offset)

    hip_near, hip_far = angle(HIP, phase, 0.5), angle(HIP, far_phase, 0.5)
    knee_near, knee_far = (np.maximum(angle(KNEE, p, 0.5), 0.0) for p in (phase, far_phase))
    torso, neck = angle(TORSO, phase, 1.2), angle(NECK, phase, 3.0)
    arms = [angle(series, p, 2.0) for p in (phase, far_phase) for series in (ARM, ELBOW)]

    thighs = np.array([hip_near, hip_far])
    shanks = thighs - [knee_near, knee_far]
    ankle_x = build.thigh * np.sin(thighs) + build.shank * np.sin(shanks)
    drop = build.thigh * np.cos(thighs) + build.shank * np.cos(shanks)
    height = drop + build.ankle  # (2, S) height of the hip over the floor if this leg's foot were flat on it
    root_y = np.logaddexp(*(WEIGHT_SHARPNESS * height)) / WEIGHT_SHARPNESS
    share = np.exp(WEIGHT_SHARPNESS * (height - root_y))
    foot = _foot_pitch(build, root_y - drop, np.array([phase, far_phase]))
    on_heel = np.diff(ankle_x + _ahead(-build.heel, build, foot))
    on_toe = np.diff(ankle_x + _ahead(build.toe, build, foot))
    advance = -(share[:, 1:] * np.where(foot[:, 1:] > 0.0, on_heel, on_toe)).sum(axis=0)
    # A landing foot takes the weight within two thirds of a frame, so that the body does not jerk.
    root_x = np.concatenate([[0.0], np.cumsum(gaussian_filter1d(advance, STEPS / 1.5, mode="nearest"))])

    pose = np.stack([root_x, root_y, torso, neck, hip_near, knee_near, hip_far, knee_far], axis=1)
    return Gait(pose=pose, foot=foot.T, arms=np.stack(arms, axis=1), phase=phase)


def joint_places(build: Build, gait: Gait) -> dict[str, Array]:
    """Every joint of the walk, (S, 2) each, body units, x forward and y up from the floor.

    The nine keypoints of the walking figure, and shoulder, elbows and wrists for the painter.
    """

    def beyond(start: Array, length: float, angle: Array) -> Array:
        """A place at a length from start, at an angle from the downward vertical, forward positive."""
        return start + length * np.stack([np.sin(angle), -np.cos(angle)], axis=1)

    _, _, torso, neck, *legs = gait.pose.T
    hip = gait.pose[:, :2]
    places = {"hip": hip, "neck": beyond(hip, build.torso, np.pi - torso)}
    places["head_top"] = beyond(places["neck"], build.neck, np.pi - torso - neck)
    places["shoulder"] = beyond(places["neck"], 0.1, -torso)
    ankle_to_toe = float(np.hypot(build.toe, build.ankle - build.toe_height))
    toe_angle = np.arctan2(build.toe, build.ankle - build.toe_height)
    for side, name in enumerate(("near", "far")):
        thigh, knee = legs[2 * side : 2 * side + 2]
        places[f"{name}_knee"] = beyond(hip, build.thigh, thigh)
        places[f"{name}_ankle"] = beyond(places[f"{name}_knee"], build.shank, thigh - knee)
        places[f"{name}_toe"] = beyond(places[f"{name}_ankle"], ankle_to_toe, toe_angle + gait.foot[:, side])
        arm, elbow = gait.arms.T[2 * side : 2 * side + 2]
        places[f"{name}_elbow"] = beyond(places["shoulder"], build.upper_arm, arm)
        places[f"{name}_wrist"] = beyond(places[f"{name}_elbow"], build.forearm, arm + elbow)
    return places


def _series(series: Series, phase: Array, size: Array) -> Array:
    mean, terms = series
    swing = sum(
        c * np.cos(2.0 * np.pi * h * phase) + s * np.sin(2.0 * np.pi * h * phase)
        for h, (c, s) in enumerate(terms, start=1)
    )
    return np.asarray(np.radians(mean + size * swing))


def _wander(steps: int, stride: float, rng: np.random.Generator) -> Array:
    """Noise of unit variance that changes from stride to stride rather than within one."""
    sigma = 0.4 * stride
    noise = gaussian_filter1d(rng.standard_normal(steps), sigma, mode="wrap")
    weights = gaussian_filter1d(np.eye(1, steps)[0], sigma, mode="wrap")
    return np.asarray(noise / np.sqrt((weights**2).sum()))


def _ahead(sole: float, build: Build, pitch: Array) -> Array:
    """Distance ahead of the ankle of a place on the sole of a foot with this pitch."""
    return np.asarray(sole * np.cos(pitch) + build.ankle * np.sin(pitch))


def _foot_pitch(build: Build, ankle_height: Array, phase: Array) -> Array:
    """The foot's pitch without a floor, limited so that neither toe nor heel is below the floor."""
    wanted = _series(FOOT, phase, np.ones_like(phase))
    to_toe = np.hypot(build.toe, build.ankle)
    to_heel = np.hypot(build.heel, build.ankle)
    lowest = np.arctan2(build.ankle, build.toe) - np.arcsin(np.clip(ankle_height / to_toe, -1.0, 1.0))
    highest = np.arcsin(np.clip(ankle_height / to_heel, -1.0, 1.0)) - np.arctan2(build.ankle, build.heel)
    return np.asarray(np.clip(wanted, np.minimum(lowest, 0.0), np.maximum(highest, 0.0)))
