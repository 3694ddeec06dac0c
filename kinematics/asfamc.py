"""Acclaim captures: an ASF skeleton and the AMC frames that move it.

A bone's dofs turn it about its own axes C, which the ASF gives at rest in the world's: L = C M C', with
M = R_z R_y R_x for the dofs rx ry rz, the first one listed applied first, and C built from the bone's `axis`
line in the same way. The bone ends at p = p_parent + R direction length, R = R_parent L (Lander, 1998,
"Working with motion capture file formats").
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from kinematics.bvh import Array, Capture, MotionError, joint_positions, read_lines, read_numbers, rotation

ROOT = "root"


@dataclass(frozen=True)
class _Bone:
    """At rest: offset = direction times length, and the axes C (3, 3); `dofs` as the AMC orders them."""

    offset: Array
    axes: Array
    dofs: tuple[str, ...]


def read_amc(path: str | Path, *, fps: float = 120.0) -> Capture:
    """Read an AMC file and place the ends of the bones of its skeleton (`find_skeleton`).

    The format does not say the frames a second. Joints are named after the bone that ENDS there ("ltibia" is
    the left ankle), and "root". MotionError names the line of a malformed file.
    """
    lines = read_lines(path)
    bones, parents = _read_skeleton(find_skeleton(path))
    values = _read_frames(path, lines, bones)
    T = len(values[ROOT])
    translations, rotations = [], []
    for name, bone in bones.items():
        turns = [n for n, dof in enumerate(bone.dofs) if dof[0] == "r"]
        axes = "".join(bone.dofs[n][1].upper() for n in turns)
        # Listed first means applied first, which is the rightmost factor.
        motion = rotation(axes[::-1], values[name][:, turns[::-1]])
        rotations.append(bone.axes @ motion @ bone.axes.T)
        translations.append(np.broadcast_to(bone.offset, (T, 3)))
    translations[0] = values[ROOT][:, [bones[ROOT].dofs.index(f"t{axis}") for axis in "xyz"]]
    turned = np.stack(rotations, axis=1)
    # A bone turns before it reaches its end, so each end is placed by its own bone's rotation.
    offsets = np.einsum("tjik,tjk->tji", turned, np.stack(translations, axis=1))
    offsets[:, 0] = translations[0]
    return Capture(tuple(bones), joint_positions(parents, offsets, turned), fps)


def find_skeleton(path: str | Path) -> Path:
    """The ASF file with the longest name that the AMC's name begins with, followed by no letter or digit
    (1.asf is not that of 14_09.amc); MotionError if there is none."""
    path = Path(path)
    begun = [asf for asf in path.parent.glob("*.asf") if path.stem.startswith(asf.stem)]
    candidates = [asf for asf in begun if not path.stem[len(asf.stem) :][:1].isalnum()]
    if not candidates:
        raise MotionError(f"{path} has no skeleton; put the .asf beside it, its name beginning the .amc's")
    return max(candidates, key=lambda asf: len(asf.stem))


def _read_skeleton(path: str | Path) -> tuple[dict[str, _Bone], list[int]]:
    """Bones by name, parents before children; and the position of each bone's parent, -1 for the root."""
    sections: dict[str, list[tuple[int, list[str]]]] = {}
    section = ""
    for n, line in enumerate(read_lines(path), start=1):
        words = line.split("#")[0].split()
        if words and words[0].startswith(":"):
            section = words[0][1:].lower()
            sections[section] = []
        elif words and section:
            sections[section].append((n, words))
    for wanted in (ROOT, "bonedata", "hierarchy"):
        if wanted not in sections:
            raise MotionError(f"{path} has no :{wanted} section; give an ASF skeleton")
    in_degrees = ["angle", "rad"] not in [words for _, words in sections.get("units", [])]
    bones = {ROOT: _read_root(path, sections[ROOT])} | _read_bones(path, sections["bonedata"], in_degrees)
    parent_of = _read_parents(path, sections["hierarchy"], bones)
    ordered = {name: bones[name] for name in [ROOT, *parent_of]}
    names = list(ordered)
    return ordered, [-1, *(names.index(parent_of[name]) for name in names[1:])]


def _read_root(path: str | Path, rows: list[tuple[int, list[str]]]) -> _Bone:
    dofs: tuple[str, ...] = ()
    for n, (word, *rest) in rows:
        if word.lower() == "order":
            dofs = tuple(dof.lower() for dof in rest)
        elif word.lower() in ("position", "orientation") and any(read_numbers(path, n, rest, 3)):
            raise MotionError(
                f"{path}, line {n}: a root that starts at 0 0 0 wanted, {rest} found; move it there"
            )
    if sorted(dofs) != ["rx", "ry", "rz", "tx", "ty", "tz"]:
        raise MotionError(f"{path}: the root's order must hold TX TY TZ RX RY RZ; it holds {dofs}")
    return _Bone(np.zeros(3), np.eye(3), dofs)


def _read_bones(path: str | Path, rows: list[tuple[int, list[str]]], in_degrees: bool) -> dict[str, _Bone]:
    bones: dict[str, _Bone] = {}
    name, direction, length, axes, dofs = "", np.zeros(3), 0.0, np.eye(3), tuple[str, ...]()
    for n, (word, *rest) in rows:
        match word.lower():
            case "begin":
                name, direction, length, axes, dofs = "", np.zeros(3), 0.0, np.eye(3), ()
            case "name":
                name = " ".join(rest)
            case "direction":
                direction = np.array(read_numbers(path, n, rest, 3))
            case "length":
                (length,) = read_numbers(path, n, rest, 1)
            case "axis":
                angles = np.array(read_numbers(path, n, rest[:3], 3))
                order = (rest[3] if len(rest) > 3 else "XYZ").upper()
                if sorted(order) != ["X", "Y", "Z"]:
                    raise MotionError(
                        f"{path}, line {n}: an axis order such as XYZ wanted, {order} found; mend it"
                    )
                axes = rotation(order[::-1], (np.deg2rad(angles) if in_degrees else angles)[::-1])
            case "dof":
                dofs = tuple(dof.lower() for dof in rest)
                if not set(dofs) <= {"rx", "ry", "rz"}:
                    raise MotionError(f"{path}, line {n}: dofs rx, ry, rz can be read, {rest} found; mend it")
            case "end":
                bones[name] = _Bone(direction * length, axes, dofs)
    return bones


def _read_parents(
    path: str | Path, rows: list[tuple[int, list[str]]], bones: dict[str, _Bone]
) -> dict[str, str]:
    parent_of: dict[str, str] = {}
    for n, (parent, *children) in rows:
        if parent in ("begin", "end"):
            continue
        for name in (parent, *children):
            if name not in bones:
                raise MotionError(f"{path}, line {n}: no bone is called {name!r}; list it under :bonedata")
        if parent != ROOT and parent not in parent_of:
            raise MotionError(f"{path}, line {n}: bone {parent!r} has no parent yet; list parents first")
        for child in children:
            if child == ROOT or child in parent_of:
                raise MotionError(f"{path}, line {n}: bone {child!r} has a parent already; list it once")
        parent_of |= dict.fromkeys(children, parent)
    return parent_of


def _read_frames(path: str | Path, lines: list[str], bones: dict[str, _Bone]) -> dict[str, Array]:
    """Each bone's values (T, dofs) by name: radians, and the root's lengths."""
    rows: dict[str, list[list[float]]] = {name: [] for name in bones}
    T, in_degrees = 0, True
    for n, line in enumerate(lines, start=1):
        words = line.split("#")[0].split()
        if not words:
            continue
        if words[0].startswith(":"):
            in_degrees = in_degrees and words[0].upper() != ":RADIANS"
        elif len(words) == 1 and words[0].isdigit():
            T += 1
        elif words[0] not in bones:
            raise MotionError(
                f"{path}, line {n}: the skeleton has no bone {words[0]!r}; give the ASF made for it"
            )
        else:
            rows[words[0]].append(read_numbers(path, n, words[1:], len(bones[words[0]].dofs)))
    for name, bone in bones.items():
        if bone.dofs and (len(rows[name]) != T or T == 0):
            raise MotionError(
                f"{path}: {T} frames, but bone {name!r} moves in {len(rows[name])}; is it cut short?"
            )
    turn = np.pi / 180.0 if in_degrees else 1.0
    units = {name: [turn if dof[0] == "r" else 1.0 for dof in bone.dofs] for name, bone in bones.items()}
    return {name: np.array(rows[name] or [[]] * T) * np.array(units[name]) for name in bones}
