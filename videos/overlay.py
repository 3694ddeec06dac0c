"""A tracked figure drawn onto a copy of a frame: limbs, uncertainty, a caption.

Everything here is given in the frame's own pixels, x right, y down, (0, 0) the centre of the top-left
pixel.
"""

import unicodedata
from collections.abc import Sequence
from itertools import groupby
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from videos.upright import Image

Array = NDArray[np.float64]
Color = tuple[int, int, int]

# Orange and blue differ for every kind of colour vision, and from skin, grass, asphalt and sky.
NEAR: Color = (255, 140, 0)
FAR: Color = (40, 130, 255)
TRUNK: Color = (255, 244, 190)
INK: Color = (20, 20, 20)

FONT = cv2.FONT_HERSHEY_SIMPLEX
FONT_HEIGHT = 22.0  # pixels from baseline to the top of a capital, at font scale 1
SIGMAS = 2.0
SHIFT = 4  # OpenCV draws at fractions of 1 / 2**SHIFT pixel
# A lost figure may be anywhere; OpenCV's fixed point overflows beyond this many pixels.
FARTHEST = 1e6


class Segment(NamedTuple):
    """A straight line with round ends.

    start, end : (2,) pixels
    color      : RGB, 0..255
    width      : pixels
    """

    start: Array
    end: Array
    color: Color
    width: float = 3.0


class Ellipse(NamedTuple):
    """The uncertainty of a point, drawn at two standard deviations.

    center : (2,) pixels
    cov    : (2, 2) covariance, px^2, positive semi-definite
    color  : RGB, 0..255
    """

    center: Array
    cov: Array
    color: Color


def draw(
    image: Image, segments: Sequence[Segment] = (), ellipses: Sequence[Ellipse] = (), caption: str = ""
) -> Image:
    """A copy of a frame, (H, W, 3) uint8 RGB, drawn on: later segments over earlier ones, ellipses over all
    of them, and the caption, one line, in the top left corner.

    Neighbours in `segments` of one colour share a dark outline, so that a leg is one shape, set off from the
    leg that it crosses.
    """
    canvas = image.copy()
    rim = max(1, round(len(image) / 400))
    for limb in limbs([segment.color for segment in segments]):
        for i in limb:
            _line(canvas, segments[i], INK, 2 * rim)
        for i in limb:
            _line(canvas, segments[i], segments[i].color, 0)
    for ellipse in ellipses:
        _outline(canvas, ellipse, INK, 1 + 3 * rim)
        _outline(canvas, ellipse, ellipse.color, 1 + rim)
    if caption:
        _caption(canvas, caption)
    return canvas


def limbs(colors: Sequence[Color]) -> list[list[int]]:
    """Groups of neighbouring positions of one colour, which share an outline."""
    return [list(limb) for _, limb in groupby(range(len(colors)), key=colors.__getitem__)]


def ellipse_axes(cov: Array) -> tuple[Array, Array]:
    """Radii (..., 2) of ellipses of two standard deviations, pixels, the longer one first, and the degrees
    (...) by which that one is turned clockwise on screen from x, of covariances (..., 2, 2), px^2."""
    variances, axes = np.linalg.eigh(cov)  # sorted upwards
    radii = SIGMAS * np.sqrt(np.maximum(variances[..., ::-1], 0.0))
    return radii, np.degrees(np.arctan2(axes[..., 1, 1], axes[..., 0, 1]))


def as_hex(color: Color) -> str:
    """A colour as #rrggbb, for pages and matplotlib."""
    return "#{:02x}{:02x}{:02x}".format(*color)


def put_text(canvas: Image, text: str, left: float, base: float, height: float, color: Color) -> None:
    """Write one line onto the canvas, in place, from `left` on the baseline `base`, with capital letters of
    this height, pixels."""
    at = (round(left), round(base))
    cv2.putText(canvas, _plain(text), at, FONT, height / FONT_HEIGHT, color, _pen(height), cv2.LINE_AA)


def _line(canvas: Image, segment: Segment, color: Color, extra: int) -> None:
    thickness = max(1, round(segment.width)) + extra
    cv2.line(canvas, _fixed(segment.start), _fixed(segment.end), color, thickness, cv2.LINE_AA, SHIFT)


def _outline(canvas: Image, ellipse: Ellipse, color: Color, thickness: int) -> None:
    radii, angle = ellipse_axes(ellipse.cov)
    center, axes = _fixed(ellipse.center), _fixed(radii)
    cv2.ellipse(canvas, center, axes, float(angle), 0.0, 360.0, color, thickness, cv2.LINE_AA, SHIFT)


def _caption(canvas: Image, caption: str) -> None:
    """One line, smaller where the canvas is too narrow for it."""
    height, width = canvas.shape[:2]
    margin, size = max(4, round(height / 60)), max(9.0, height / 32)
    size *= min(1.0, (width - 2 * margin) / max(_text_width(caption, size), 1))
    bottom = min(height, round(2 * margin + size) + 1)
    right = min(width, _text_width(caption, size) + 2 * margin)
    canvas[:bottom, :right] = (0.35 * canvas[:bottom, :right]).astype(np.uint8)
    put_text(canvas, caption, margin, margin + size, size, (255, 255, 255))


def _text_width(text: str, height: float) -> int:
    (width, _), _ = cv2.getTextSize(_plain(text), FONT, height / FONT_HEIGHT, _pen(height))
    return int(width)


def _fixed(values: Array) -> tuple[int, int]:
    x, y = np.rint(np.clip(values, -FARTHEST, FARTHEST) * 2**SHIFT).astype(int)
    return int(x), int(y)


def _pen(height: float) -> int:
    return max(1, round(height / 11))


def _plain(text: str) -> str:
    """The text in ASCII, all that OpenCV draws: accents are dropped, other letters become question marks."""
    letters = unicodedata.normalize("NFKD", text)
    return "".join(c for c in letters if not unicodedata.combining(c)).encode("ascii", "replace").decode()
