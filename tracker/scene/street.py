"""The street behind a rendered walk, and the changing light on it.

House fronts, hedges and a pavement in rough perspective, drawn once per scene at twice its size. Some of the
objects at leg height have the trousers' colour, so that an outline alone does not find a leg.
"""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.scene.cloth import Image, value_noise

WALL_FOOT = 0.69  # row where the houses meet the pavement, share of the picture's height
FLOOR = 0.865  # row of the walker's soles
FINE = 2  # factor by which the street is drawn larger before it is averaged down

SHRUB_WIDTH = (0.12, 0.16)  # shares of the picture's height; the walker's leg is about 0.26
SHRUB_HEIGHT = (0.28, 0.34)

WALLS = ((168, 104, 84), (190, 178, 156), (150, 150, 148), (206, 190, 150), (122, 96, 84), (168, 182, 184))
DOORS = ((64, 92, 78), (110, 44, 40), (46, 58, 84), (92, 72, 52))


def street(size: tuple[int, int], echo: Image, rng: np.random.Generator) -> Image:
    """(H, W, 3), 0..255: a street of this width and height without people; some objects have the walker's
    colour `echo` (3,)."""
    width, height = size[0] * FINE, size[1] * FINE
    foot = round(WALL_FOOT * height)
    canvas = np.zeros((height, width, 3), np.float32)
    x = -int(rng.integers(0, height // 4))
    while x < width - 8:
        span = int(rng.uniform(0.45, 0.8) * height)
        _house(canvas, x, x + span, foot, rng)
        x += span
    _pavement(canvas, foot, rng)
    for _ in range(5):
        _clutter(canvas, foot, echo, rng)
    _hedge(canvas, foot, rng)
    _lamp_post(canvas, foot, rng)
    small = cv2.resize(canvas, size, interpolation=cv2.INTER_AREA)
    grain = value_noise(rng, size[::-1], (1.5, 4.0, 12.0))
    return np.asarray(np.clip(small * (1.0 + 0.035 * grain[..., None]), 0.0, 255.0), np.float32)


def foreground(size: tuple[int, int], centres: Sequence[float], rng: np.random.Generator) -> Image:
    """The foreground in front of the walker: a shrub in a planter about each of the centres, x in pixels.

    (H, W, 4): colour 0..255 times cover, and cover 0..1.
    """
    width, height = size[0] * FINE, size[1] * FINE
    layer = np.zeros((height, width, 4), np.float32)
    for centre in centres:
        _shrub(layer, FINE * centre, rng)
    return np.asarray(cv2.resize(layer, size, interpolation=cv2.INTER_AREA), np.float32)


def light_fields(size: tuple[int, int], frames: int, rng: np.random.Generator) -> NDArray[np.float32]:
    """(T, h, w) brightness of each place in each frame, around 1, on a coarse grid over the picture.

    Three components change: overall brightness (clouds, the camera's exposure), the difference between left
    and right, and a slanted band of shadow that moves across.
    """
    columns, rows = max(2, size[0] // 8), max(2, size[1] // 8)
    x, y = np.meshgrid(np.linspace(-1.0, 1.0, columns), np.linspace(-1.0, 1.0, rows))
    time = np.arange(frames)[:, None, None] / 90.0  # three seconds at 30 frames a second
    turn = rng.uniform(0.0, 2.0 * np.pi, 2)
    gain = 1.14 + 0.11 * np.sin(2.0 * np.pi * rng.uniform(0.7, 1.3) * time + turn[0])
    slope = 0.1 * np.sin(2.0 * np.pi * rng.uniform(0.3, 0.7) * time + turn[1]) * x
    travel = rng.choice([-1.0, 1.0]) * rng.uniform(0.9, 1.5)
    place = x + rng.uniform(0.2, 0.5) * y - travel * (time - 0.5) - rng.uniform(-0.2, 0.2)
    edge = 0.07
    inside = 1.0 / (1.0 + np.exp(np.clip((np.abs(place) - 0.28) / edge, -30.0, 30.0)))
    return np.asarray(gain * (1.0 + slope) * (1.0 - rng.uniform(0.22, 0.32) * inside), np.float32)


def _house(canvas: Image, x0: int, x1: int, foot: int, rng: np.random.Generator) -> None:
    left, right = max(x0, 0), min(x1, canvas.shape[1])
    wall = np.array(WALLS[rng.integers(len(WALLS))]) * rng.uniform(0.75, 1.0) + rng.normal(0.0, 6.0, 3)
    stained = value_noise(rng, (foot, right - left), (6.0, 40.0, 120.0))
    canvas[:foot, left:right] = wall * (1.0 + 0.06 * stained[..., None])
    if rng.uniform() < 0.55:
        _bricks(canvas[:foot, left:right], rng)
    _box(canvas, left, foot - 26, x1, foot, wall * 0.62)
    _box(canvas, left, 0, left + 3, foot, wall * 0.55)
    span, unit = x1 - x0, canvas.shape[0]
    door_at = rng.integers(3)
    sill = foot - int(0.13 * unit)
    for i in range(3):
        middle = x0 + int((i + 0.5) * span / 3)
        half = int(rng.uniform(0.075, 0.095) * unit * min(1.0, span / (0.6 * unit)))
        if i == door_at:
            _door(canvas, middle - half, middle + half, foot - int(0.36 * unit), foot, rng)
        else:
            _window(canvas, middle - half, middle + half, sill - int(0.23 * unit), sill, rng)
        top = foot - int(0.66 * unit)
        _window(canvas, middle - half, middle + half, top, top + int(0.19 * unit), rng)


def _bricks(wall: Image, rng: np.random.Generator) -> None:
    high, long = 9, 24
    rows, columns = np.indices(wall.shape[:2])
    course = rows // high
    shifted = columns + (course % 2) * (long // 2)
    tint = 1.0 + 0.11 * rng.standard_normal((wall.shape[0] // high + 1, wall.shape[1] // long + 2))
    wall *= tint[course, shifted // long][..., None]
    wall[(rows % high < 2) | (shifted % long < 2)] *= 1.14


def _window(canvas: Image, x0: int, x1: int, y0: int, y1: int, rng: np.random.Generator) -> None:
    frame = np.full(3, rng.uniform(150.0, 215.0))
    _box(canvas, x0 - 6, y0 - 6, x1 + 6, y1 + 6, frame)
    _box(canvas, x0 - 10, y1 + 6, x1 + 10, y1 + 14, frame * 0.8)
    glass = rng.uniform(40.0, 90.0) * np.array([0.9, 1.0, 1.1])
    _box(canvas, x0, y0, x1, y1, glass)
    tilt = int(0.5 * (y1 - y0))
    start = int(rng.integers(x0 - tilt, max(x1, x0 - tilt + 1)))
    pane = canvas[max(y0, 0) : max(y1, 0), max(x0, 0) : max(x1, 0)]
    rows, columns = np.indices(pane.shape[:2])
    slanted = columns + 0.5 * rows - (start - max(x0, 0))
    pane[(slanted > 0) & (slanted < rng.uniform(20.0, 50.0))] += rng.uniform(20.0, 50.0)
    if rng.uniform() < 0.5:
        _box(canvas, x0, y0, x0 + (x1 - x0) // 4, y1, rng.uniform(120.0, 210.0) + rng.normal(0.0, 14.0, 3))
    _box(canvas, (x0 + x1) // 2 - 2, y0, (x0 + x1) // 2 + 2, y1, frame)
    _box(canvas, x0, (2 * y0 + y1) // 3 - 2, x1, (2 * y0 + y1) // 3 + 2, frame)


def _door(canvas: Image, x0: int, x1: int, y0: int, y1: int, rng: np.random.Generator) -> None:
    paint = np.array(DOORS[rng.integers(len(DOORS))]) * rng.uniform(0.9, 1.3)
    _box(canvas, x0 - 8, y0 - 8, x1 + 8, y1, np.full(3, rng.uniform(120.0, 190.0)))
    _box(canvas, x0, y0, x1, y1, paint)
    inset, height = (x1 - x0) // 7, y1 - y0
    for top, bottom in ((0.08, 0.42), (0.5, 0.9)):
        panel = int(y0 + top * height), x1 - inset, int(y0 + bottom * height)
        _box(canvas, x0 + inset, *panel, paint * 0.78)
    cv2.circle(canvas, (x1 - inset // 2 - 2, (y0 + y1) // 2), 4, (190.0, 170.0, 90.0), -1)
    _box(canvas, x0 - 14, y1 - 12, x1 + 14, y1, np.full(3, 140.0))


def _pavement(canvas: Image, foot: int, rng: np.random.Generator) -> None:
    height, width = canvas.shape[:2]
    y, x = np.mgrid[foot:height, 0:width].astype(np.float32)
    horizon = 0.5 * height
    depth = (height - horizon) / (y - horizon)  # 1 at the picture's lower edge
    across, along = (x - 0.45 * width) * depth / (0.2 * height), 5.5 * depth  # slabs
    stone = np.array([156.0, 150.0, 142.0]) * rng.uniform(0.85, 1.05)
    noise = value_noise(rng, (height - foot, width), (2.0, 7.0, 60.0))
    row, column = (np.floor(each).astype(int) % 64 for each in (along, across))
    tint = 1.0 + 0.06 * rng.standard_normal((64, 64))
    ground = stone * (tint[row, column] * (1.0 + 0.05 * noise))[..., None]
    off_row, off_column = (np.abs(each - np.round(each)) for each in (along, across))
    ground[(off_row < 0.03 * depth) | (off_column < 0.012 * depth)] *= 0.72
    ground[: int(0.012 * height)] *= 0.6
    canvas[foot:] = ground
    for _ in range(45):  # leaves, gum, stains
        spot = int(rng.integers(width)), int(rng.integers(foot + 8, height))
        size = int(rng.integers(2, 7))
        shade = rng.uniform(50.0, 140.0) * np.array([1.1, 1.0, rng.uniform(0.5, 0.9)])
        axes, turn = (size, max(1, size // 3)), rng.uniform(-30.0, 30.0)
        cv2.ellipse(canvas, spot, axes, turn, 0, 360, shade.tolist(), -1)


def _clutter(canvas: Image, foot: int, echo: Image, rng: np.random.Generator) -> None:
    """A box at leg height against the wall, such as a bin or crate, sometimes in the walker's colour."""
    height, width = canvas.shape[:2]
    x = int(rng.integers(0, width))
    wide, high = int(rng.uniform(0.04, 0.13) * height), int(rng.uniform(0.1, 0.24) * height)
    base = foot + int(rng.integers(2, 24))
    colour = np.asarray(echo, np.float64) * rng.uniform(0.75, 1.2)
    if rng.uniform() < 0.35:
        colour = rng.uniform(60.0, 150.0) + rng.normal(0.0, 22.0, 3)
    _box(canvas, x - 4, base - 4, x + wide + 10, base + 6, np.full(3, 70.0))
    _box(canvas, x, base - high, x + wide, base, colour)
    _box(canvas, x, base - high, x + wide // 4, base, colour * 1.15)
    for i in range(1, int(rng.integers(2, 5))):
        y = base - high + i * high // 4
        _box(canvas, x, y, x + wide, y + 3, colour * 0.7)


def _hedge(canvas: Image, foot: int, rng: np.random.Generator) -> None:
    height, width = canvas.shape[:2]
    wide, high = min(int(rng.uniform(0.5, 0.8) * height), width), int(rng.uniform(0.2, 0.3) * height)
    x0 = int(rng.integers(0, max(1, width - wide)))
    leaves = value_noise(rng, (high, wide), (5.0, 9.0, 40.0))
    bulge = value_noise(rng, (1, wide), (12.0, 60.0))[0] * 0.05 * high
    rows, columns = np.indices((high, wide))
    ends = np.minimum(columns, wide - columns) / (0.12 * high)
    outline = rows > 0.16 * high + bulge + 0.5 * high * np.maximum(1.0 - ends, 0.0) + 3.0 * leaves
    green = np.array([74.0, 96.0, 52.0]) * rng.uniform(0.8, 1.15)
    tone = (0.85 - 0.35 * rows / high)[..., None] + 0.24 * leaves[..., None]
    part = canvas[foot + 14 - high : foot + 14, x0 : x0 + wide]
    part[outline] = (green * np.maximum(tone, 0.15))[outline]


def _lamp_post(canvas: Image, foot: int, rng: np.random.Generator) -> None:
    height, width = canvas.shape[:2]
    x, half = int(rng.uniform(0.1, 0.9) * width), max(int(0.008 * height), 1)
    base = foot + int(0.03 * height)
    for i in range(-half, half + 1):
        _box(canvas, x + i, 0, x + i + 1, base, np.array([58.0, 66.0, 62.0]) * (1.15 - 0.3 * (i / half) ** 2))
    _box(canvas, x - 2 * half, base - 6 * half, x + 2 * half + 1, base, np.array([50.0, 56.0, 54.0]))


def _shrub(layer: Image, centre: float, rng: np.random.Generator) -> None:
    height = len(layer)
    wide = int(rng.uniform(*SHRUB_WIDTH) * height)
    high, ground = int(rng.uniform(*SHRUB_HEIGHT) * height), int(rng.uniform(0.93, 0.96) * height)
    x0 = int(centre - wide / 2)
    leaves = value_noise(rng, (high, wide), (3.0, 6.0, 25.0))
    rows, columns = np.indices((high, wide))
    across = np.abs(columns - wide / 2) / (wide / 2)
    outline = (1.0 - rows / high) < np.sqrt(np.maximum(1.0 - across**2, 0.0)) + 0.05 * leaves
    green = np.array([70.0, 92.0, 58.0]) * rng.uniform(0.7, 1.2) + rng.normal(0.0, 8.0, 3)
    tone = (1.0 - 0.4 * rows / high)[..., None] + 0.3 * leaves[..., None]
    left, right = max(x0, 0), min(x0 + wide, layer.shape[1])
    part = layer[ground - high : ground, left:right]
    shown = outline[:, left - x0 : right - x0]
    part[shown, :3] = np.clip(green * np.maximum(tone, 0.2), 0.0, 255.0)[:, left - x0 : right - x0][shown]
    part[shown, 3] = 1.0
    box = layer[ground - high // 4 : ground, max(x0 + wide // 8, 0) : max(x0 + wide - wide // 8, 0)]
    box[..., :3] = np.array([120.0, 86.0, 66.0]) * rng.uniform(0.7, 1.1)
    box[..., 3] = 1.0


def _box(canvas: Image, x0: int, y0: int, x1: int, y1: int, colour: NDArray[np.float64]) -> None:
    canvas[max(y0, 0) : max(y1, 0), max(x0, 0) : max(x1, 0)] = colour
