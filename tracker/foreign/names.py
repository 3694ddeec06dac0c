"""Our names for other programs' points, in any spelling, and which leg is near.

Points are matched by the words of their names (`RKnee`, `right_knee`, `knee_r`, `rightknee`) in `PARTS` and
`SIDES`. A figure's own names are used unchanged. The near leg is the right one of a person who faces right.
Missing joints are derived: hip and neck midway between both hips and both shoulders, and the head's top above
the ears (else the nose), which is an estimate.
"""

import re
from collections.abc import Mapping

from kinematics.figure import Figure
from kinematics.recover import facing_of
from tracker.foreign.people import Person, Sighting
from tracker.foreign.points import near_far

PARTS = {
    **dict.fromkeys(("headtop", "topofhead", "head", "vertex", "crown"), "head_top"),
    **dict.fromkeys(("neck", "c7"), "neck"),
    **dict.fromkeys(("hip", "hips", "midhip", "pelvis"), "hip"),
    **dict.fromkeys(("toe", "toes", "bigtoe", "toetip", "foottip", "footindex"), "toe"),
    **{part: part for part in ("knee", "ankle", "shoulder", "elbow", "wrist", "ear", "nose")},
}
SIDES = {"right": "right", "r": "right", "left": "left", "l": "left", "near": "near", "far": "far"}
WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")
SIDE = re.compile("(left|right)", re.IGNORECASE)  # words of their own, also in names without a gap

CROWN = 1.5  # distance of the head's top from the neck as a multiple of that of the ears

Parts = Mapping[tuple[str, str], Sighting]  # by side ("" for none) and part


def parts_of(person: Person, figure: Figure) -> Parts:
    """The points of a person whose names match one of ours, or one from which ours are derived."""
    out: dict[tuple[str, str], Sighting] = {}
    for name, point in person.items():
        if name in figure.marks:
            out["", name] = point
            continue
        words = [word.lower() for word in WORD.findall(SIDE.sub(r" \1 ", name))]
        if len(words) == 1 and words[0] not in PARTS and words[0][0] in "rl":
            words = [words[0][0], words[0][1:]]
        side = next((SIDES[word] for word in words if word in SIDES), "")
        part = PARTS.get("".join(word for word in words if word not in SIDES))
        if part is not None:
            out[side, part] = point
    return out


def joints_of(parts: Parts, facing: int, figure: Figure) -> tuple[dict[str, Sighting], list[str]]:
    """The joints of a figure that faces right (+1) or left (-1), in its order, and the names of derived
    ones."""
    seen: dict[str, Sighting] = {}
    for (side, part), point in parts.items():
        own = not side and part in figure.marks
        name = part if own else near_far(f"{side}_{part}" if side else part, facing)
        if name in figure.marks:
            seen[name] = point
    every = _derived(parts, seen) | seen
    joints = {name: every[name] for name in figure.marks if name in every}
    return joints, [name for name in joints if name not in seen]


def facing_seen(parts: Parts, figure: Figure) -> int:
    """Which way a figure faces: by its toes, else by its nose, else by `facing_of`."""
    head, nose = _middle(parts, "ear"), parts.get(("", "nose"))
    toes = any(part.endswith("toe") for _, part in parts)
    if not toes and head is not None and nose is not None and nose.x != head.x:
        return 1 if nose.x > head.x else -1
    joints, _ = joints_of(parts, 1, figure)
    return facing_of({name: (point.x, point.y) for name, point in joints.items()}, None, figure)


def _derived(parts: Parts, seen: Mapping[str, Sighting]) -> dict[str, Sighting]:
    middles = {"hip": _middle(parts, "hip"), "neck": _middle(parts, "shoulder")}
    out = {name: point for name, point in middles.items() if point is not None}
    neck, head = seen.get("neck") or out.get("neck"), _middle(parts, "ear") or parts.get(("", "nose"))
    if neck is not None and head is not None:
        x, y = (a + CROWN * (b - a) for a, b in ((neck.x, head.x), (neck.y, head.y)))
        out["head_top"] = Sighting(x, y, min(neck.confidence, head.confidence), visible=False)
    return out


def _middle(parts: Parts, part: str) -> Sighting | None:
    """The middle of a part's right and left point with the lower confidence, or the only one of them."""
    pair = [point for (side, other), point in parts.items() if side and other == part]
    if not pair:
        return None
    x, y = (sum(values) / len(pair) for values in zip(*((p.x, p.y) for p in pair), strict=True))
    return Sighting(x, y, min(p.confidence for p in pair), all(p.visible for p in pair))
