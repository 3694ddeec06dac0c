"""A clothed walker, painted from its joints: tapered tubes of cloth in limb coordinates.

Every part is a tube around a path of joints. A pixel of it has two cloth coordinates, u along the path and
v across it (-1 back, +1 front), looked up in that part's own texture, so that the cloth moves with the limb,
but not rigidly: a bending joint stretches u on one side and compresses it on the other, folds slide with the
stride, and the trunk turns under the shirt. In all pictures the walker faces right.
"""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from tracker.scene.cloth import Image, Tube, Wardrobe, Window, capsule, look_up, tube_around, window_around
from tracker.scene.steps import Array, Build

# Outlines in legs: place along the part, reach to the front, reach to the back.
LEG = (
    (-0.1, 0.13, 0.135),
    (0.08, 0.16, 0.152),
    (0.25, 0.132, 0.114),
    (0.37, 0.108, 0.096),
    (0.5, 0.092, 0.088),
    (0.7, 0.07, 0.092),
    (1.0, 0.06, 0.078),
)
TRUNK = (
    (-0.02, 0.05, 0.06),
    (0.06, 0.075, 0.105),
    (0.2, 0.135, 0.125),
    (0.42, 0.122, 0.1),
    (0.72, 0.142, 0.155),
)
ARM = (
    (0.0, 0.074, 0.074),
    (0.2, 0.066, 0.066),
    (0.37, 0.05, 0.056),
    (0.48, 0.05, 0.05),
    (0.66, 0.034, 0.034),
    (0.7, 0.036, 0.034),  # from here on the hand
    (0.74, 0.05, 0.04),
    (0.79, 0.044, 0.036),
    (0.84, 0.028, 0.028),
)

WHITE = np.ones(3, np.float32)  # base colour of parts whose texture has colours
SOLE = np.array([176.0, 172.0, 164.0], np.float32)
# Parts drawn later hide earlier ones; a mark is hidden only by parts of a later rank than its own.
FAR_ARM, FAR_LEG, NEAR_LEG, TRUNK_RANK, NEAR_ARM = range(5)
MARK_RANKS = dict.fromkeys(("head_top", "neck", "hip"), TRUNK_RANK) | {
    f"{side}_{joint}": rank
    for side, rank in (("near", NEAR_LEG), ("far", FAR_LEG))
    for joint in ("knee", "ankle", "toe")
}


@dataclass(frozen=True)
class Part:
    """One painted part: colour (h, w, 3) in 0..255 and coverage (h, w) in its window of the picture."""

    rank: int
    window: Window
    colour: Image
    alpha: Image


class Painter:
    """Paints one walker at successive moments, with leg_px pixels a leg."""

    def __init__(self, build: Build, wardrobe: Wardrobe, leg_px: float, shape: tuple[int, int]) -> None:
        self.build = build
        self.wear = wardrobe
        self.leg_px = leg_px
        self.shape = shape
        self.leg = tuple((place, wardrobe.loose * front, wardrobe.loose * back) for place, front, back in LEG)

    def parts(self, joints: dict[str, Array], phase: float) -> list[Part]:
        """All parts to draw at one moment, far to near, from joints (2,) in pixels; `phase` is the number of
        strides walked, for parts that sway once a stride."""
        sway = float(np.sin(2.0 * np.pi * phase))
        parts = [self._arm(joints, "far", FAR_ARM, -sway)]
        parts += [self._shoe(joints, "far", FAR_LEG), self._leg(joints, "far", FAR_LEG, -sway)]
        parts += [self._shoe(joints, "near", NEAR_LEG), self._leg(joints, "near", NEAR_LEG, sway)]
        parts += [self._trunk(joints, sway), self._head(joints)]
        parts += [self._arm(joints, "near", NEAR_ARM, sway)]
        return [part for part in parts if part.alpha.size]

    def _leg(self, joints: dict[str, Array], side: str, rank: int, sway: float) -> Part:
        hip, knee, ankle = joints["hip"], joints[f"{side}_knee"], joints[f"{side}_ankle"]
        px = self.leg_px
        bend = _turn(hip, knee, ankle)
        tube = tube_around([hip, knee, ankle], self.leg, px, self.shape, spare=0.1)
        from_knee = (tube.u - self.build.thigh * px) / (0.16 * px)
        near_knee = np.exp(-0.5 * from_knee**2)
        # A bent knee stretches the cloth over its front and compresses it behind.
        u = tube.u - 0.05 * px * bend * tube.v * np.tanh(from_knee) * near_knee
        v = tube.v + 0.12 * sway
        cloth = self._cloth(tube, self.wear.denim, u, v + (0.0 if side == "near" else 2.3))
        gathers = bend * near_knee * np.clip(0.35 - tube.v, 0.0, 1.0) * np.sin(u / (0.028 * px) + 2.0 * v)
        at_groin = np.exp(-0.5 * ((tube.u - 0.08 * px) / (0.1 * px)) ** 2)
        shade = 1.0 + 0.16 * gathers + 0.1 * at_groin * np.sin(u / (0.03 * px) - 3.0 * v + 2.0 * sway)
        shade *= 1.0 + 0.18 * self._fold(u + 0.1 * px * bend, v + 0.4 * bend + sway * 0.2)
        shade *= self._lambert(tube)
        hem = 1.0 - 0.25 * (np.abs(tube.u - 0.97 * px) < 0.008 * px)
        signed = np.maximum(tube.signed, tube.u - px * (1.0 + 0.02 * tube.v))
        return self._part(rank, tube.window, self.wear.trousers, cloth * (shade * hem)[..., None], signed)

    def _shoe(self, joints: dict[str, Array], side: str, rank: int) -> Part:
        px, build = self.leg_px, self.build
        ankle, toe = joints[f"{side}_ankle"], joints[f"{side}_toe"]
        rest = np.array([build.toe, build.ankle - build.toe_height])
        turn = np.arctan2(*(toe - ankle)[::-1]) - np.arctan2(*rest[::-1])
        forward = np.array([np.cos(turn), np.sin(turn)])
        down = np.array([-forward[1], forward[0]])
        window, at = window_around(ankle[None], 0.34 * px, self.shape)
        f, d = ((at - ankle) @ forward) / px, ((at - ankle) @ down) / px
        upper = capsule(f, d, (-0.015, 0.0), (0.04, 0.045), 0.062, 0.055)
        back, front = (-build.heel + 0.045, build.ankle - 0.05), (build.toe - 0.04, build.ankle - 0.042)
        sole = capsule(f, d, back, front, 0.05, 0.042)
        signed = np.maximum(np.minimum(upper, sole), d - build.ankle)
        tone = 0.8 + 0.2 * np.clip(-d / 0.08 + 0.5, 0.0, 1.0) + 0.14 * (np.abs(f - 0.07) < 0.045) * (d < 0.03)
        colour = np.where((d > build.ankle - 0.026)[..., None], SOLE, self.wear.shoes * tone[..., None])
        return self._part(rank, window, WHITE, colour, px * signed)

    def _trunk(self, joints: dict[str, Array], sway: float) -> Part:
        px = self.leg_px
        tube = tube_around([joints["neck"], joints["hip"]], TRUNK, px, self.shape, spare=0.1)
        v = tube.v + 0.16 * sway
        cloth = self._cloth(tube, self.wear.pattern, tube.u, v)
        shade = self._lambert(tube) * (1.0 + 0.22 * self._fold(tube.u, v + 0.3 * sway))
        waist = np.exp(-0.5 * ((tube.u - 0.5 * px) / (0.12 * px)) ** 2)
        shade *= 1.0 + 0.08 * waist * np.sin(tube.u / (0.035 * px) + 2.5 * v + 1.5 * sway)
        hem = self.build.torso * px + px * (0.075 - 0.03 * tube.v**2 + 0.012 * sway * tube.v)
        signed = np.maximum(tube.signed, tube.u - hem)
        return self._part(TRUNK_RANK, tube.window, self.wear.shirt, cloth * shade[..., None], signed)

    def _head(self, joints: dict[str, Array]) -> Part:
        px, wear = self.leg_px, self.wear
        top, neck = joints["head_top"], joints["neck"]
        down = (neck - top) / np.linalg.norm(neck - top)
        window, at = window_around(np.stack([top, neck]), 0.18 * px, self.shape)
        u = ((at - top) @ down) / px
        v = ((at - top) @ np.array([down[1], -down[0]])) / px
        skull = 0.125 * (np.hypot((u - 0.13) / 0.13, (v + 0.005) / 0.122) - 1.0)
        skull = np.maximum(skull, u - wear.hair_end - 1.2 * (v + 0.06))  # no bare bulge below the hair
        jaw = capsule(u, v, (0.16, 0.03), (0.235, 0.066), 0.08, 0.034)
        nose = capsule(u, v, (0.125, 0.112), (0.16, 0.13), 0.012, 0.015)
        throat = capsule(u, v, (0.18, -0.02), (0.35, -0.01), 0.056, 0.062)
        face = np.minimum(np.minimum(skull, jaw), np.minimum(nose, throat))
        crown = 0.135 * (np.hypot((u - 0.128) / 0.136, (v + 0.012) / 0.13) - 1.0)
        locks = np.maximum(crown, u - wear.hair_end)
        is_hair = (locks < 0.0) & ((u < 0.078 - 0.2 * v) | (v < -0.022))
        if wear.hair_end > 0.25:
            tail = capsule(u, v, (0.1, -0.1), (wear.hair_end, -0.11), 0.04, 0.022)
            is_hair |= tail < 0.0
            locks = np.minimum(locks, tail)
        round_light = 0.88 + 1.5 * (v * wear.light[0] - (u - 0.12) * 0.6)
        tone = round_light * np.where(np.hypot(u - 0.12, v - 0.084) < 0.014, 0.45, 1.0)
        tone *= np.where(np.abs(np.hypot(u - 0.15, v + 0.01) - 0.018) < 0.007, 0.8, 1.0)
        tone *= np.where((np.abs(u - 0.205) < 0.006) & (v > 0.065), 0.72, 1.0)
        tone *= np.where((u > 0.262) | ((u > 0.2) & (v < -0.01)), 0.84, 1.0)
        strands = round_light * (1.0 + 0.12 * np.sin(70.0 * v + 18.0 * u) + 0.1 * np.sin(41.0 * u - 23.0 * v))
        colour = np.where(is_hair[..., None], wear.hair * strands[..., None], wear.skin * tone[..., None])
        signed = px * np.minimum(face, np.where(is_hair, locks, np.inf))
        return self._part(TRUNK_RANK, window, WHITE, colour, signed)

    def _arm(self, joints: dict[str, Array], side: str, rank: int, sway: float) -> Part:
        px, build = self.leg_px, self.build
        shoulder, elbow, wrist = joints["shoulder"], joints[f"{side}_elbow"], joints[f"{side}_wrist"]
        tips = wrist + 0.13 * px * (wrist - elbow) / np.linalg.norm(wrist - elbow)
        tube = tube_around([shoulder, elbow, tips], ARM, px, self.shape)
        bend = _turn(tips, elbow, shoulder)
        at_elbow = np.exp(-0.5 * ((tube.u - build.upper_arm * px) / (0.1 * px)) ** 2)
        u = tube.u + 0.04 * px * bend * tube.v * at_elbow
        cloth = self._cloth(tube, self.wear.pattern, u, tube.v + 1.1 + 0.1 * sway)
        shade = 1.0 + 0.16 * at_elbow * np.sin(u / (0.024 * px) + 2.0 * tube.v + 2.0 * bend)
        shade *= 1.0 + 0.2 * self._fold(u, tube.v + sway)
        sleeve = (0.93 * (build.upper_arm + build.forearm) if self.wear.long_sleeves else 0.24) * px
        shirt = self.wear.shirt * cloth * shade[..., None]
        shirt *= np.where(np.abs(tube.u - sleeve + 0.012 * px) < 0.012 * px, 0.8, 1.0)[..., None]
        colour = np.where((tube.u < sleeve)[..., None], shirt, self.wear.skin * np.float32(0.92))
        return self._part(rank, tube.window, WHITE, colour * self._lambert(tube)[..., None], tube.signed)

    def _cloth(self, tube: Tube, texture: Image, u: Array, v: Array) -> Image:
        """Look a texture up, twice as fine as the picture, wrapped around the limb."""
        around = np.arcsin(np.clip(v - np.round(v - tube.v), -1.0, 1.0)) + (v - tube.v)
        return look_up(texture, 2.0 * u, 2.0 * around * tube.reach)

    def _fold(self, u: Array, v: Array) -> Image:
        return look_up(self.wear.folds, 1.2 * u + 18.0 * v, 26.0 * v)

    def _lambert(self, tube: Tube) -> Array:
        light = self.wear.light
        facing_us = np.sqrt(np.maximum(1.0 - tube.v**2, 0.0))
        lit = tube.v * (tube.front @ light[:2]) + facing_us * light[2]
        return np.asarray(0.62 + 0.6 * np.maximum(lit, 0.0))

    def _part(self, rank: int, window: Window, base: Image, tone: Any, signed: Array) -> Part:
        colour = np.clip(base * tone, 0.0, 255.0).astype(np.float32)
        if rank in (FAR_ARM, FAR_LEG):
            colour *= np.array(self.wear.far_shade, np.float32)
        return Part(rank, window, colour, np.clip(0.5 - signed, 0.0, 1.0).astype(np.float32))


def compose(parts: list[Part], shape: tuple[int, int]) -> Image:
    """Compose parts, far to near: (H, W, 4), colour times coverage, and coverage.

    Each part darkens the area just behind its outline, like the shadow of close cloth.
    """
    layer = np.zeros((*shape, 4), np.float32)
    for part in parts:
        under = layer[part.window]
        contact = cv2.blur(part.alpha, (9, 9))[..., None]
        under[..., :3] *= 1.0 - 0.38 * contact
        under *= 1.0 - part.alpha[..., None]
        under[..., :3] += part.colour * part.alpha[..., None]
        under[..., 3] += part.alpha
    return layer


def seen(parts: list[Part], joints: dict[str, Array]) -> dict[str, bool]:
    """Whether each mark is uncovered by nearer parts."""
    return {
        name: not any(_covers(part, joints[name]) for part in parts if part.rank > rank)
        for name, rank in MARK_RANKS.items()
    }


def _covers(part: Part, place: Array) -> bool:
    rows, columns = part.window
    x, y = np.round(place).astype(int)
    inside = rows.start <= y < rows.stop and columns.start <= x < columns.stop
    return bool(inside and part.alpha[y - rows.start, x - columns.start] > 0.5)


def _turn(a: Array, b: Array, c: Array) -> float:
    """Angle by which a path turns at b, radians, without sign."""
    before, after = b - a, c - b
    cross = before[0] * after[1] - before[1] * after[0]
    return float(abs(np.arctan2(cross, before @ after)))
