"""Captures of a stick figure that walks, and tables of them."""

import numpy as np

COLUMNS = "file,subject,trial,activity,fps,segments,tags,licence"
JOINTS = ("RightUpLeg", "RightLeg", "RightFoot", "RightToeBase", "LeftUpLeg", "LeftLeg", "LeftFoot")
JOINTS += ("LeftToeBase", "Neck", "Head")
T, FPS = 60, 30.0


def write_walk(path, stride, seed, size=1.0):
    """A capture of a stick figure that walks along z, each joint placed by its own position channels.

    With a size of 0 it stands, and the angles vary by noise alone.
    """
    rng = np.random.default_rng(seed)
    phase = 2.0 * np.pi * np.arange(T) / stride
    hips = np.stack(
        [0.0 * phase, 2.0 + 0.03 * size * np.cos(2.0 * phase), 1.2 * size * phase / np.pi], axis=1
    )

    def hang(angle):
        return np.stack([0.0 * angle, -np.cos(angle), np.sin(angle)], axis=1)

    joints = []
    for side, turn in ((-0.2, 0.0), (0.2, np.pi)):
        thigh = 0.4 * size * np.sin(phase + turn) + 0.01 * rng.normal(size=T)
        shank = thigh - 0.4 * size * (1.0 + np.cos(phase + turn)) + 0.01 * rng.normal(size=T)
        at = [hips + np.array([side, 0.0, 0.0])]
        at += [at[0] + hang(thigh), at[0] + hang(thigh) + hang(shank)]
        joints += [*at, at[2] + np.array([0.0, -0.05, 0.3])]
    joints += [hips + np.array(above) for above in ([0.0, 1.0, 0.05], [0.0, 1.5, 0.08])]
    parts = [f"ROOT {n}\n{{\nOFFSET 0 0 0\nCHANNELS 3 Xposition Yposition Zposition\n" for n in JOINTS]
    hierarchy = "}\n".join(parts) + "End Site\n{\nOFFSET 0 0 0\n}\n}\n"
    rows = "\n".join(" ".join(f"{v:.6f}" for v in frame.ravel()) for frame in np.stack(joints, axis=1))
    head = f"MOTION\nFrames: {T}\nFrame Time: {1.0 / FPS}\n"
    path.write_text(f"HIERARCHY\n{hierarchy}{head}{rows}\n")


def write_trials(folder, rows):
    """Captures in a folder, and their table: a subject, an activity and the frames of a stride for each."""
    lines = [COLUMNS]
    for i, (subject, activity, stride) in enumerate(rows):
        write_walk(folder / f"c{i}.bvh", stride, i)
        lines.append(f"c{i}.bvh,{subject},t,{activity},{FPS:g},0-{T},,free")
    (folder / "trials.csv").write_text("\n".join(lines) + "\n")
    return folder / "trials.csv"
