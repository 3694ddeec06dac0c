"""Joints in space, and the BVH files that hold them.

A joint stands at p = p_parent + R_parent o and turns its children by R = R_parent R_1 R_2 R_3, where o is its
OFFSET and R_i its rotation channels in the order of the CHANNELS line (Meredith and Maddock, 2001,
"Motion capture file formats explained"). A position channel replaces that entry of the OFFSET, at the root
and at any other joint; it does not add to it.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kinematics.text_file import ordinary, why

Array = NDArray[np.float64]
LARGEST = 1e9  # magnitude of any number in a file; sums with larger ones lose their digits


class MotionError(ValueError):
    """A motion capture file, or the table that lists it, is not what it should be."""


@dataclass(frozen=True)
class Capture:
    """Joints of a figure in space, frame by frame.

    names     : J joint names; an End Site has the name of its joint followed by "_end"
    positions : (T, J, 3) in the file's unit of length, y up
    fps       : frames per second
    """

    names: tuple[str, ...]
    positions: Array
    fps: float

    def __post_init__(self) -> None:
        positions = np.array(self.positions, dtype=np.float64)
        if positions.ndim != 3 or positions.shape[1:] != (len(self.names), 3):
            raise ValueError(f"positions must be (T, {len(self.names)}, 3); got {positions.shape}")
        positions.setflags(write=False)
        object.__setattr__(self, "positions", positions)

    def at(self, name: str) -> Array:
        """Positions (T, 3) of the joint `name`; ValueError when there is none."""
        return np.asarray(self.positions[:, self.names.index(name)])


@dataclass
class _Joint:
    name: str
    parent: int
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    channels: list[str] = field(default_factory=list)


def read_bvh(path: str | Path) -> Capture:
    """Read a BVH file and place its joints. MotionError: it cannot be read, or which line is malformed.

    CMU files in the cgspeed conversion lack the thorax bone: Neck, LeftShoulder and RightShoulder lie on
    Spine1. They are raised by the length of Spine1's own OFFSET, which is right to 0.01 leg lengths on
    subjects that exist with and without the bone.
    """
    lines = read_lines(path)
    start = next((n for n, line in enumerate(lines) if line.strip().upper() == "MOTION"), None)
    if start is None:
        raise MotionError(f"{path} has no MOTION line; give a BVH file that holds frames")
    joints = _read_hierarchy(path, lines[:start])
    width = sum(len(joint.channels) for joint in joints)
    fps, values = _read_frames(path, lines, start + 1, width)
    _raise_missing_thorax(joints)
    translations, rotations = _local_transforms(joints, values)
    positions = joint_positions([joint.parent for joint in joints], translations, rotations)
    return Capture(tuple(joint.name for joint in joints), positions, fps)


def read_lines(path: str | Path) -> list[str]:
    """The lines of a text file; MotionError when it cannot be read."""
    try:
        return ordinary(Path(path)).read_text(encoding="utf-8-sig", errors="replace").splitlines()
    except OSError as error:
        raise MotionError(f"cannot read {path} ({why(error)}); give one that can be read") from error


def read_numbers(path: str | Path, line: int, words: list[str], count: int) -> list[float]:
    """`count` finite numbers from the words of a line; MotionError names the line, counted from 1."""
    if len(words) != count:
        raise MotionError(f"{path}, line {line}: {count} values wanted, {len(words)} found; is it cut short?")
    values = list(map(_number, words))
    for word, value in zip(words, values, strict=True):
        if not abs(value) <= LARGEST:
            if math.isfinite(value):
                raise MotionError(f"{path}, line {line}: {word} is out of all range; mend or drop it")
            raise MotionError(f"{path}, line {line}: finite numbers wanted, {word!r} found; mend or drop it")
    return values


def rotation(axes: str, angles: Array) -> Array:
    """(..., 3, 3) product of turns about axes, letters of "XYZ", the first leftmost, by angles (..., n)."""
    product = np.broadcast_to(np.eye(3), (*angles.shape[:-1], 3, 3))
    for n, axis in enumerate(axes):
        i, j = {"X": (1, 2), "Y": (2, 0), "Z": (0, 1)}[axis]
        turn = np.zeros((*angles.shape[:-1], 3, 3)) + np.eye(3)
        turn[..., i, i] = turn[..., j, j] = np.cos(angles[..., n])
        turn[..., j, i] = np.sin(angles[..., n])
        turn[..., i, j] = -turn[..., j, i]
        product = product @ turn
    return product


def joint_positions(parents: list[int], translations: Array, rotations: Array) -> Array:
    """(T, J, 3) places of the joints of a tree.

    Args:
        parents: J indices, each smaller than its joint's own; -1 for a root.
        translations: (T, J, 3) from the parent, in the parent's axes.
        rotations: (T, J, 3, 3) from the joint's axes to its parent's.
    """
    positions, turned = translations.copy(), rotations.copy()
    for j, parent in enumerate(parents):
        if parent >= 0:
            positions[:, j] = positions[:, parent] + np.einsum(
                "tik,tk->ti", turned[:, parent], translations[:, j]
            )
            turned[:, j] = turned[:, parent] @ rotations[:, j]
    return positions


def _number(word: str) -> float:
    """The word as a number, NaN if it is none."""
    try:
        return float(word)
    except ValueError:
        return math.nan


def _read_hierarchy(path: str | Path, lines: list[str]) -> list[_Joint]:
    words = ((word, n) for n, line in enumerate(lines, start=1) for word in line.split())
    joints: list[_Joint] = []
    open_joints: list[int] = []
    line = 0
    try:
        for word, line in words:
            match word.upper():
                case "HIERARCHY" | "{":
                    pass
                case "ROOT" | "JOINT" | "END" as kind:
                    name, _ = next(words)
                    parent = open_joints[-1] if kind != "ROOT" else -1
                    open_joints.append(len(joints))
                    joints.append(_Joint(f"{joints[parent].name}_end" if kind == "END" else name, parent))
                case "OFFSET":
                    x, y, z = read_numbers(path, line, _take(words, 3), 3)
                    joints[open_joints[-1]].offset = (x, y, z)
                case "CHANNELS":
                    (count,) = read_numbers(path, line, _take(words, 1), 1)
                    channels = _take(words, int(count))
                    joints[open_joints[-1]].channels = [_channel(path, line, name) for name in channels]
                case "}":
                    open_joints.pop()
                case _:
                    raise MotionError(f"{path}, line {line}: a BVH keyword wanted, {word!r} found; mend it")
    except (IndexError, StopIteration) as error:
        raise MotionError(
            f"{path}, line {line}: braces do not match or words are missing; mend it"
        ) from error
    if open_joints or not joints:
        raise MotionError(f"{path}: the hierarchy is empty or a brace stays open; is it cut short?")
    return joints


def _take(words: Iterator[tuple[str, int]], count: int) -> list[str]:
    return [next(words)[0] for _ in range(count)]


def _channel(path: str | Path, line: int, name: str) -> str:
    channel = name.lower()
    if channel[:1] not in tuple("xyz") or channel[1:] not in ("position", "rotation"):
        raise MotionError(f"{path}, line {line}: no channel is called {name!r}; Xposition .. Zrotation are")
    return channel


def _read_frames(path: str | Path, lines: list[str], start: int, width: int) -> tuple[float, Array]:
    """Frames per second, and the channels' values (T, width), degrees and lengths as in the file."""
    head = [line.partition(":") for line in lines[start : start + 2]]
    if [word.strip().lower() for word, _, _ in head] != ["frames", "frame time"]:
        raise MotionError(
            f"{path}, line {start + 1}: 'Frames:' and 'Frame Time:' must follow MOTION; mend it"
        )
    (T,) = read_numbers(path, start + 1, head[0][2].split(), 1)
    (seconds,) = read_numbers(path, start + 2, head[1][2].split(), 1)
    if seconds <= 0:
        raise MotionError(f"{path}, line {start + 2}: Frame Time must be above 0, it is {seconds}; mend it")
    rows = [
        read_numbers(path, n, line.split(), width)
        for n, line in enumerate(lines[start + 2 :], start=start + 3)
        if line.strip()
    ]
    if len(rows) != T or not rows:
        raise MotionError(
            f"{path}, line {start + 1}: {T:.0f} frames announced, {len(rows)} found; cut short?"
        )
    return 1.0 / seconds, np.array(rows)


def _raise_missing_thorax(joints: list[_Joint]) -> None:
    chest = [joint for joint in joints if joint.name in ("Neck", "LeftShoulder", "RightShoulder")]
    bases = {joints[joint.parent].name for joint in chest}
    if len(chest) == 3 and bases == {"Spine1"} and all(joint.offset == (0.0, 0.0, 0.0) for joint in chest):
        length = math.hypot(*joints[chest[0].parent].offset)
        for joint in chest:
            joint.offset = (0.0, length, 0.0)


def _local_transforms(joints: list[_Joint], values: Array) -> tuple[Array, Array]:
    T, J = len(values), len(joints)
    translations = np.empty((T, J, 3))
    rotations = np.empty((T, J, 3, 3))
    column = 0
    for j, joint in enumerate(joints):
        translations[:, j] = joint.offset
        turns = []
        for n, channel in enumerate(joint.channels, start=column):
            if channel.endswith("position"):
                translations[:, j, "xyz".index(channel[0])] = values[:, n]
            else:
                turns.append(n)
        axes = "".join(joint.channels[n - column][0].upper() for n in turns)
        rotations[:, j] = rotation(axes, np.deg2rad(values[:, turns]))
        column += len(joint.channels)
    return translations, rotations
