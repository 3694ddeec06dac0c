"""The two sides of a figure: near to the camera and far from it.

The name of a joint, link or freedom says its side by one of its words: near_knee, thigh_far, knee_near.
"""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Side = Literal["near", "far"]
SIDES: tuple[Side, ...] = ("near", "far")
OTHER: dict[str, Side] = {"near": "far", "far": "near"}


def on_side(name: str, side: str) -> bool:
    """Whether the name has this side as one of its words."""
    return side in name.split("_")


def side_of(name: str) -> tuple[str, str]:
    """The side in a name, "" if it has none, and the name without it."""
    words = name.split("_")
    side = next((word for word in words if word in OTHER), "")
    return side, "_".join(word for word in words if word != side)


def other_side(name: str) -> str:
    """The name with near and far exchanged; a name without a side unchanged."""
    return "_".join(OTHER.get(word, word) for word in name.split("_"))


def exchanged(names: Sequence[str]) -> NDArray[np.intp]:
    """(n,) position of each name's twin on the other side; its own where there is none."""
    position = {name: i for i, name in enumerate(names)}
    return np.array([position.get(other_side(name), i) for i, name in enumerate(names)], dtype=np.intp)
