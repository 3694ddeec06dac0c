"""A rival without weights: one CSRT correlation tracker a link, in an environment of its own (`make rivals`).

A joint lies where its box has it: displaced from the centre as in the start frame, scaled with the box. A
joint of several boxes is their mean.
"""

import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tests.benchmarks.rivals.body import Array, Body, Image

ROOT = Path(__file__).parents[3]
CONTRIB = ROOT / ".venv-rivals" / "bin" / "python"
WORKER = Path(__file__).with_name("csrt.py")
LEAST_SIDE = 8.0  # of a box, px: CSRT knows no smaller ones


@dataclass(frozen=True)
class Options:
    """What was chosen on the open clips.

    around : what a box has around its link's outline on every side, leg lengths
    """

    around: float = 0.15


def kind() -> str:
    """The tracker at hand: CSRT, or MIL where only plain OpenCV is installed."""
    return _worker()


def follow(images: Sequence[Image], body: Body, options: Options | None = None) -> Array:
    """The joints (T, J, 2) in all images, the first of which is the marked one; pixels.

    Raises:
        RuntimeError: the trackers failed; with the last line they said.
    """
    boxes = _boxes(body, images[0].shape[:2], (options or Options()).around * body.leg)
    with TemporaryDirectory() as folder:
        names = [str(Path(folder) / f"{name}.npy") for name in ("images", "boxes", "found")]
        np.save(names[0], np.stack(images))
        np.save(names[1], boxes)
        _worker(*names)
        found = np.load(names[2])
    return np.stack([body.at_joints(_carried(body, boxes, now)) for now in found])


def _worker(*arguments: str) -> str:
    python = CONTRIB if CONTRIB.exists() else sys.executable
    done = subprocess.run([python, WORKER, *arguments], capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"the box trackers failed: {(done.stderr.strip().splitlines() or ['?'])[-1]}")
    return done.stdout.strip()


def _boxes(body: Body, shape: tuple[int, int], around: float) -> Array:
    """(L, 4) left, top, width and height of every link in the picture."""
    corners = body.outlines(body.joints)
    low = np.maximum(corners.min(1) - around, 0.0)
    high = np.minimum(corners.max(1) + around, np.array(shape[::-1]) - 1.0)
    middle = np.clip(0.5 * (low + high), 0.5 * LEAST_SIDE, np.array(shape[::-1]) - 0.5 * LEAST_SIDE)
    size = np.maximum(high - low, LEAST_SIDE)
    return np.concatenate([middle - 0.5 * size, size], 1)


def _carried(body: Body, before: Array, now: Array) -> Array:
    """(L, 2, 2) where boxes (L, 4) have the joints at both ends of their links."""
    centres, middles = before[:, :2] + 0.5 * before[:, 2:], now[:, :2] + 0.5 * now[:, 2:]
    offsets = body.joints[body.ends] - centres[:, None]
    return middles[:, None] + offsets * (now[:, 2:] / before[:, 2:])[:, None]
