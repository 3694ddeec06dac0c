"""The materials of a rendered walker: textures, the clothes of one person, outlines.

Textures are (256, 256, 3) and are 1 where the cloth has its plain colour; u runs along a row.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.scene.steps import Array

Image = NDArray[np.float32]
Window = tuple[slice, slice]

SKIN = ((226, 186, 158), (204, 158, 128), (158, 116, 90), (112, 80, 62))
HAIR = ((38, 30, 26), (78, 54, 36), (120, 88, 54), (96, 92, 90))
TROUSERS = ((62, 74, 104), (128, 112, 88), (86, 88, 94), (88, 92, 70), (96, 76, 62))
SHIRTS = ((176, 62, 48), (206, 158, 64), (58, 128, 132), (204, 196, 178), (122, 78, 132), (84, 122, 74))
SHOES = ((52, 46, 44), (92, 44, 42), (118, 72, 46))


@dataclass(frozen=True)
class Wardrobe:
    """Clothes and lighting of one walker.

    skin .. shoes : (3,) plain colours, 0..255
    denim, pattern : textures of trousers and shirt; folds, (256, 256), of both
    hair_end : end of the hair, legs from the top of the head; beyond 0.25 it hangs free
    light : (3,) unit vector to the light: x right, y down, z towards the camera
    loose : width of the trouser legs, 1 as usual
    far_shade : (3,) share of the light on the far arm and leg, which the body shades
    """

    skin: Image
    hair: Image
    trousers: Image
    shirt: Image
    shoes: Image
    denim: Image
    pattern: Image
    folds: Image
    hair_end: float
    long_sleeves: bool
    light: Array
    loose: float = 1.0
    far_shade: tuple[float, float, float] = (0.66, 0.68, 0.74)

    @classmethod
    def choose(cls, rng: np.random.Generator) -> "Wardrobe":
        def one_of(colours: Any) -> Image:
            return np.asarray(colours[rng.integers(len(colours))] + rng.normal(0.0, 4.0, 3), np.float32)

        light = np.array([rng.uniform(-0.6, 0.6), -0.6, 0.65])
        return cls(
            skin=one_of(SKIN),
            hair=one_of(HAIR),
            trousers=one_of(TROUSERS),
            shirt=one_of(SHIRTS),
            shoes=one_of(SHOES),
            denim=_weave(rng),
            pattern=_pattern(rng),
            folds=value_noise(rng, (256, 256), (8, 24, 64)),
            hair_end=float(rng.choice([0.19, 0.21, 0.3])),
            long_sleeves=bool(rng.uniform() < 0.5),
            light=light / np.linalg.norm(light),
        )


@dataclass(frozen=True)
class Tube:
    """The pixels around a path of joints.

    window : of the picture; all arrays are (h, w) over it
    signed : pixels outside the outline, negative within
    u, v   : pixels along the path; across it, -1 back to +1 front
    front  : (h, w, 2) unit vector to the front, x right and y down
    reach  : half width here, pixels
    """

    window: Window
    signed: Array
    u: Array
    v: Array
    front: Array
    reach: Array


def window_around(points: Array, margin: float, shape: tuple[int, int]) -> tuple[Window, Array]:
    """The window around points in a picture of this (H, W) shape, and the (h, w, 2) places of its pixels."""
    low = np.floor(points.min(axis=0) - margin).astype(int)
    high = np.ceil(points.max(axis=0) + margin).astype(int) + 1
    x0, y0 = np.maximum(low, 0)
    x1, y1 = np.maximum(np.minimum(high, shape[::-1]), (x0, y0))
    at = np.stack(np.meshgrid(np.arange(x0, x1), np.arange(y0, y1)), axis=-1).astype(np.float64)
    return (slice(y0, y1), slice(x0, x1)), at


def tube_around(
    path: list[Array],
    outline: tuple[tuple[float, float, float], ...],
    leg_px: float,
    shape: tuple[int, int],
    *,
    spare: float = 0.0,
) -> Tube:
    """The pixels around one link, or around two that meet in a smooth bend.

    Args:
        path: joints from the body outwards, pixels.
        outline: places along the path and reaches to front and back, legs.
        leg_px: pixels a leg.
        shape: height and width of the picture.
        spare: extension of the tube before its round end, legs; for tubes that are cut off at a hem.
    """
    stations, fronts, backs = np.array(outline).T * leg_px
    window, at = window_around(np.stack(path), 0.2 * leg_px, shape)
    links = []
    walked = 0.0
    for i, (start, end) in enumerate(pairwise(path)):
        length = float(np.linalg.norm(end - start))
        along_axis = (end - start) / length
        front = np.array([along_axis[1], -along_axis[0]])
        along, across = (at - start) @ along_axis, (at - start) @ front
        low = -np.inf if i == 0 else 0.0
        high = np.inf if i == len(path) - 2 else length
        clipped = np.clip(along, low, high)
        u = walked + clipped
        reach = np.where(across > 0.0, np.interp(u, stations, fronts), np.interp(u, stations, backs))
        past = along - np.clip(along, 0.0, length + (spare * leg_px if i == len(path) - 2 else 0.0))
        links.append((np.hypot(past, across) - reach, u, across / reach, front, reach))
        walked += length
    signed, u, v, front, reach = links[0]
    fronts_here = np.broadcast_to(front, at.shape)
    if len(links) == 2:
        signed2, u2, v2, front2, reach2 = links[1]
        weight = 1.0 / (1.0 + np.exp(np.clip((signed2 - signed) / 1.5, -30.0, 30.0)))
        round_off = 0.04 * leg_px
        gap = np.maximum(round_off - np.abs(signed - signed2), 0.0) / round_off
        signed = np.minimum(signed, signed2) - 0.25 * round_off * gap**2
        u, v, reach = (a + weight * (b - a) for a, b in ((u, u2), (v, v2), (reach, reach2)))
        fronts_here = front + weight[..., None] * (front2 - front)
    return Tube(window, signed, u, np.clip(v, -1.0, 1.0), fronts_here, reach)


def value_noise(rng: np.random.Generator, shape: tuple[int, int], scales: tuple[float, ...]) -> Image:
    """Smooth noise with mean 0 and standard deviation 1: one octave of random blobs per scale, in pixels."""
    total = np.zeros(shape, np.float32)
    for scale in scales:
        coarse = rng.standard_normal([max(2, round(n / scale)) + 1 for n in shape]).astype(np.float32)
        total += np.sqrt(scale) * cv2.resize(coarse, shape[::-1], interpolation=cv2.INTER_CUBIC)
    return np.asarray((total - total.mean()) / total.std(), np.float32)


def look_up(texture: Image, x: Array, y: Array) -> Image:
    """The periodic texture at places x and y of one shape, pixels."""
    if x.size == 0:  # a part outside the picture
        return np.zeros((*x.shape, *texture.shape[2:]), np.float32)
    maps = x.astype(np.float32) % texture.shape[1], y.astype(np.float32) % texture.shape[0]
    return np.asarray(cv2.remap(texture, *maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP), np.float32)


def capsule(
    x: Array, y: Array, a: tuple[float, float], b: tuple[float, float], ra: float, rb: float
) -> Array:
    """Distance to a rounded bar from a to b whose radius goes from ra to rb, negative inside."""
    length2 = (b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2
    t = np.clip(((x - a[0]) * (b[0] - a[0]) + (y - a[1]) * (b[1] - a[1])) / length2, 0.0, 1.0)
    across = np.hypot(x - a[0] - t * (b[0] - a[0]), y - a[1] - t * (b[1] - a[1]))
    return np.asarray(across - ra - t * (rb - ra))


def _weave(rng: np.random.Generator) -> Image:
    """Trouser cloth: threads, wear, one seam. u runs along a row."""
    grain = value_noise(rng, (256, 256), (1.6, 3.0))
    wear = value_noise(rng, (256, 256), (20.0, 50.0))
    cloth = 1.0 + 0.1 * grain + 0.1 * wear
    cloth[126:129] *= 0.8
    cloth[131:132] *= 1.15
    return np.repeat(cloth[..., None], 3, axis=2)


def _pattern(rng: np.random.Generator) -> Image:
    """Shirt cloth: plain, striped or checked, with a grain."""
    cloth = np.ones((256, 256, 3), np.float32)
    kind = rng.integers(3)
    ink = rng.uniform(0.35, 1.25, 3).astype(np.float32)
    period = int(rng.choice([16, 32]))
    stripes = (np.arange(256) % period) < period // 3
    if kind >= 1:
        cloth[:, stripes] *= 0.35 + 0.65 * ink
    if kind == 2:
        cloth[stripes] *= 0.45 + 0.55 * ink[::-1]
    grain = value_noise(rng, (256, 256), (1.6, 3.0, 30.0))
    return np.asarray(cloth * (1.0 + 0.09 * grain[..., None]), np.float32)
