"""What a rendered walker is made of: textures, the clothes of one person, outlines.

Textures are (256, 256, 3) and hold 1 where the cloth has its plain colour; u runs along a row.
"""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.scene_gait import Array

Image = NDArray[np.float32]

SKIN = ((226, 186, 158), (204, 158, 128), (158, 116, 90), (112, 80, 62))
HAIR = ((38, 30, 26), (78, 54, 36), (120, 88, 54), (96, 92, 90))
TROUSERS = ((62, 74, 104), (128, 112, 88), (86, 88, 94), (88, 92, 70), (96, 76, 62))
SHIRTS = ((176, 62, 48), (206, 158, 64), (58, 128, 132), (204, 196, 178), (122, 78, 132), (84, 122, 74))
SHOES = ((52, 46, 44), (150, 146, 140), (118, 72, 46))


@dataclass(frozen=True)
class Wardrobe:
    """What one walker wears, and is lit by.

    skin .. shoes : (3,) plain colours, 0..255
    denim, pattern : textures of trousers and shirt; folds, (256, 256), of both
    hair_end : how far the hair reaches down, legs from the top of the head; past 0.25 it hangs free
    light : (3,) unit vector to the light: x right, y down, z towards the camera
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

    @classmethod
    def choose(cls, rng: np.random.Generator) -> "Wardrobe":
        """Clothes, skin, hair, and the side the light comes from."""

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
            hair_end=float(rng.choice([0.17, 0.2, 0.3])),
            long_sleeves=bool(rng.uniform() < 0.5),
            light=light / np.linalg.norm(light),
        )


def value_noise(rng: np.random.Generator, shape: tuple[int, int], scales: tuple[float, ...]) -> Image:
    """Smooth noise of mean 0 and deviation 1: one octave of random blobs per scale, in pixels."""
    total = np.zeros(shape, np.float32)
    for scale in scales:
        coarse = rng.standard_normal([max(2, round(n / scale)) + 1 for n in shape]).astype(np.float32)
        total += np.sqrt(scale) * cv2.resize(coarse, shape[::-1], interpolation=cv2.INTER_CUBIC)
    return np.asarray((total - total.mean()) / total.std(), np.float32)


def look_up(texture: Image, x: Array, y: Array) -> Image:
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
    cloth = 1.0 + 0.1 * grain + 0.13 * wear
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
