"""The sagittal plane of a captured body: its joints among a capture's, and the pose rows seen from its side.

With v seen in the plane spanned by forward f and up u, a segment leans by atan2(v.f, v.u) from the vertical
and swings by atan2(v.f, -v.u) from hanging; a knee's flexion is the thigh's swing less the shank's. Forward
is the way the figure faces, so root_x decreases in backward walking. Up is the floor's normal: a floor that
rises along the way shows that the capture's axes are tilted.
"""

from dataclasses import dataclass

import numpy as np

from kinematics.bvh import Array, Capture, MotionError

_UP = np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True)
class Body:
    """The figure's joints in space.

    right, left : (T, 4, 3) hip, knee, ankle and ball of the foot
    neck, head  : (T, 3) base of the neck, top of the head
    arms        : (2, T, 3, 3) right and left: shoulder, elbow, wrist; None where they were not captured
    """

    right: Array
    left: Array
    neck: Array
    head: Array
    arms: Array | None = None

    @property
    def leg_length(self) -> float:
        """Thigh and shank, the mean of both sides, in the capture's unit."""
        bones = np.linalg.norm(np.diff(np.stack([self.right, self.left])[:, :, :3], axis=2), axis=-1)
        return float(np.median(bones.sum(axis=-1), axis=1).mean())

    def between(self, first: int, end: int) -> "Body":
        """The body in frames first .. end - 1 alone."""
        part = slice(first, end)
        arms = None if self.arms is None else self.arms[:, part]
        return Body(self.right[part], self.left[part], self.neck[part], self.head[part], arms)


_ARM = "*Arm *ForeArm *Hand"
# Names of the joints of a leg and an arm, the two sides, neck and head in families of files; several neck
# joints are averaged.
_DIALECTS = (
    ("*UpLeg *Leg *Foot *ToeBase", _ARM, ("Right", "Left"), ("Neck",), "Head_end"),
    ("UpperLeg_* LowerLeg_* Foot_* Toes_*", "UpperArm_* LowerArm_* Hand_*", ("R", "L"), ("Neck",), "Head"),
    ("*UpLeg *Leg *Foot *Toes", _ARM, ("Right", "Left"), ("LeftArm", "RightArm"), "HEad_end"),
    ("*hipjoint *femur *tibia *foot", "*clavicle *humerus *radius", ("r", "l"), ("thorax",), "head"),
)


def find_body(capture: Capture) -> Body:
    """The figure's joints among a capture's; MotionError if its joint names are of no known dialect."""
    known = set(capture.names)
    found = []
    for leg, arm, sides, neck, head in _DIALECTS:
        legs, arms = ([part.replace("*", side).split() for side in sides] for part in (leg, arm))
        found.append(({*legs[0], *legs[1], *neck, head} - known, legs, arms, neck, head))
    missing, legs, arms, neck, head = min(found, key=lambda dialect: len(dialect[0]))
    if missing:
        raise MotionError(
            f"no joint is called {', '.join(sorted(missing))} among {', '.join(capture.names)}; "
            "rename the joints as the CMU, Bandai-Namco or SNU files do"
        )

    def places(limbs: list[list[str]]) -> Array:
        return np.stack([np.stack([capture.at(name) for name in limb], axis=1) for limb in limbs])

    right, left = places(legs)
    centre = np.mean([capture.at(name) for name in neck], axis=0)
    moved = places(arms) if known >= {*arms[0], *arms[1]} else None
    return Body(right, left, centre, capture.at(head), moved)


def project(body: Body, *, curve: bool = False, arms: bool = False) -> Array:
    """See a body, one straight segment of T frames, from its right side, in the plane of its travel.

    Args:
        curve: the path bends, so each frame is projected square to where its hips face.
        arms: whether to include the arms.

    Returns:
        (T, 8) pose rows, POSE_COLUMNS, or (T, 12) with ARM_COLUMNS behind; root_x starts at 0, near is the
        right side. The floor is the line, tilted along the way, on which the balls of the feet stand.
    """
    hips = (body.right[:, 0] + body.left[:, 0]) / 2.0
    level = _facing(body) if curve else _heading(hips, body)
    slope, ground = _floor(body, hips, level, tilted=not curve)
    forward, up = _unit(level + slope * _UP), _unit(_UP - slope * level)

    def lean(v: Array) -> Array:
        return np.asarray(np.arctan2(_dot(v, forward), _dot(v, up)))

    steps = _dot(np.diff(hips, axis=0), (forward[1:] + forward[:-1]) / 2.0)
    root = np.stack([np.concatenate([[0.0], np.cumsum(steps)]), _dot(hips - ground, up)]) / body.leg_length
    torso = lean(body.neck - hips)
    neck = _wrap(lean(body.head - body.neck) - torso)
    leg_angles = []
    for leg in (body.right, body.left):
        # A thigh that leans back from knee to hip swings forward from hip to knee.
        thigh, shank = -lean(leg[:, 0] - leg[:, 1]), -lean(leg[:, 1] - leg[:, 2])
        leg_angles += [thigh, _wrap(thigh - shank)]
    arm_angles = []
    for arm in body.arms if arms and body.arms is not None else ():
        upper, fore = -lean(arm[:, 0] - arm[:, 1]), -lean(arm[:, 1] - arm[:, 2])
        arm_angles += [_wrap(upper + torso), _wrap(fore - upper)]
    return np.stack([*root, torso, neck, *leg_angles, *arm_angles], axis=1)


def _dot(v: Array, w: Array) -> Array:
    return np.asarray((v * w).sum(axis=-1))


def _unit(v: Array) -> Array:
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))


def _wrap(angle: Array) -> Array:
    return np.asarray((angle + np.pi) % (2.0 * np.pi) - np.pi)


def _facing(body: Body) -> Array:
    """(T, 3) unit vector, level, in the direction that the hips face."""
    return _unit(np.cross(body.left[:, 0] - body.right[:, 0], _UP))


def _heading(hips: Array, body: Body) -> Array:
    """The line of travel, (T, 3), pointing where the body faces on the whole."""
    facing = _facing(body).mean(axis=0)
    travel = (hips[-1] - hips[0]) * (1.0 - _UP)
    # A body that stays on the spot has no line of travel.
    if np.linalg.norm(travel) < 0.5 * body.leg_length:
        return np.broadcast_to(_unit(facing), hips.shape)
    return np.broadcast_to(_unit(travel * np.copysign(1.0, travel @ facing)), hips.shape)


def _floor(body: Body, hips: Array, forward: Array, *, tilted: bool) -> tuple[float, Array]:
    """Slope of the floor along the way, and its point (3,) under the hips of the first frame.

    A ball of the foot stands while it moves at less than a tenth of its speed in swing. Points above the
    fitted line, of a foot already lifting or a frozen frame, are left out of the next fit.
    """
    balls = np.stack([body.right[:, 3], body.left[:, 3]], axis=1)
    speed = np.linalg.norm(np.gradient(balls, axis=0), axis=-1)
    stands = speed <= 0.1 * np.quantile(speed, 0.95)
    if not stands.any():
        return 0.0, np.array([hips[0, 0], balls[..., 1].min(), hips[0, 2]])
    place = _dot(balls - hips[0], forward[:, None])[stands]
    height = balls[..., 1][stands]
    slope, base = 0.0, float(np.median(height))
    for _ in range(3):
        low = height <= base + slope * place + 0.03 * body.leg_length
        # Steps on one spot do not show the tilt.
        if tilted and np.ptp(place[low]) > body.leg_length:
            slope, base = (float(c) for c in np.polyfit(place[low], height[low], 1))
        else:
            slope, base = 0.0, float(height[low].mean())
    return slope, np.array([hips[0, 0], base, hips[0, 2]])
