"""Made-up bodies whose poses are known, as a capture would hold them."""

import numpy as np

from kinematics.sagittal import Body

# Joints of both legs from the hip down, the neck and the head, as CMU's captures name them.
CMU = ("RightUpLeg", "RightLeg", "RightFoot", "RightToeBase")
CMU += ("LeftUpLeg", "LeftLeg", "LeftFoot", "LeftToeBase", "Neck", "Head_end")


def walker(
    T,
    *,
    facing=0.0,
    step=0.1,
    torso=0.0,
    neck=0.0,
    right=(0.0, 0.0),
    left=(0.0, 0.0),
    arm=(0.0, 0.0),
    other_arm=(0.0, 0.0),
):
    """A body of leg length 2 in one pose, gliding `step` a frame the way it faces, `facing` from +z to +x."""
    forward = np.array([np.sin(facing), 0.0, np.cos(facing)])
    across = np.array([np.cos(facing), 0.0, -np.sin(facing)])
    up = np.array([0.0, 1.0, 0.0])

    def hang(angle):
        return np.sin(angle) * forward - np.cos(angle) * up

    hips = 2.0 * up + np.arange(T)[:, None] * step * forward
    legs = []
    for side, (hip, knee) in ((-0.2, right), (0.2, left)):
        joints = [hips + side * across]
        joints.append(joints[-1] + hang(hip))
        joints.append(joints[-1] + hang(hip - knee))
        joints.append(joints[-1] + 0.3 * forward)
        legs.append(np.stack(joints, axis=1))
    base = hips + hang(np.pi - torso)
    arms = []
    for side, (shoulder, elbow) in ((-0.3, arm), (0.3, other_arm)):
        joints = [base + side * across]
        joints.append(joints[-1] + 0.7 * hang(shoulder - torso))
        joints.append(joints[-1] + 0.5 * hang(shoulder - torso + elbow))
        arms.append(np.stack(joints, axis=1))
    head = base + 0.5 * hang(np.pi - torso - neck)
    return Body(legs[0], legs[1], base, head, np.stack(arms))


def stepping_body(tilt):
    """Feet that stand half a stride and swing the other half, on a floor that rises by `tilt`."""
    t = np.arange(160)
    hips_z = 0.05 * t
    legs = []
    for side, phase in ((-0.2, 0), (0.2, 20)):
        cycle, part = np.divmod(t + phase, 40)
        swing = np.clip(part - 20, 0, 20) / 20.0
        z = 2.0 * (cycle + swing) - 0.05 * phase
        lift = 0.3 * np.sin(np.pi * swing)
        ball = np.stack([np.full(160, side), lift + tilt * z, z], axis=1)
        hip = np.stack([np.full(160, side), 2.0 + tilt * hips_z, hips_z], axis=1)
        knee, ankle = hip - [0.0, 1.0, 0.0], hip - [0.0, 2.0, 0.0]
        legs.append(np.stack([hip, knee, ankle, ball], axis=1))
    middle = (legs[0][:, 0] + legs[1][:, 0]) / 2.0
    up = np.array([0.0, 1.0, 0.0])
    return Body(legs[0], legs[1], middle + up, middle + 1.5 * up)
