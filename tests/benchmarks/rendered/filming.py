"""A plan painted: pictures, and where every joint is in them.

At each of the shutter's moments street, people and what stands before them are laid over one another as the
camera sees them then; a frame is the mean of its moments, and its truth is that of the middle one.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import cv2
import numpy as np

from tests.benchmarks.rendered.plans import MOMENTS, SHRUB, Plan, Walker
from tracker.scene.body import MARK_RANKS, Painter, compose, seen
from tracker.scene.cloth import Image, Wardrobe
from tracker.scene.film import Picture, compress, develop, in_pixels, shadow_on, under
from tracker.scene.steps import Array, joint_places
from tracker.scene.street import FLOOR, SHRUB_WIDTH, foreground, light_fields, street
from tracker.tables.keypoints import Mark, Marks
from videos.writer import Writer

ALIKE = (0.93, 0.94, 0.95)  # light on the far leg where it is hardly darker
POST_TONE = (70.0, 180.0)  # grey levels
POST_GROUND = 0.95  # where a post stands, of the street's height


@dataclass(frozen=True)
class Film:
    """What was filmed.

    images : T pictures (H, W, 3) uint8 RGB, as compressed one by one
    marks  : every joint of the first walker in every frame, pixels, visible where nothing covers it
    """

    plan: Plan
    images: list[Picture]
    marks: Marks

    def write(self, path: Path) -> None:
        """The pictures as h264."""
        with Writer(path, self.plan.fps, self.plan.size, crf=self.plan.crf) as writer:
            for t, image in enumerate(self.images):
                writer.write(image, t / self.plan.fps)


def film(plan: Plan) -> Film:
    """Paint a plan; the same plan gives the same pictures."""
    rng = np.random.default_rng([plan.seed, 1])
    shot = _Set.built(plan, rng)
    images, marks = [], {}
    for t in range(plan.frames):
        picture, marks[t] = shot.exposed(t)
        images.append(develop(picture, rng, plan.noise))
    return Film(plan, compress(images, plan.quality), marks)


@dataclass(frozen=True)
class _Actor:
    """A walker with clothes on.

    place : (S, 2) by name, pixels of the street
    """

    walker: Walker
    painter: Painter
    place: dict[str, Array]

    @classmethod
    def dressed(cls, walker: Walker, plan: Plan, wear: Wardrobe) -> "_Actor":
        lit = replace(wear, light=wear.light * (walker.facing, 1.0, 1.0))
        painter = Painter(walker.build, lit, walker.leg_px, plan.size[::-1])
        unmirrored = in_pixels(joint_places(walker.build, walker.gait), walker.leg_px, np.zeros(2))
        place = {name: walker.start + at * (walker.facing, 1.0) for name, at in unmirrored.items()}
        return cls(walker, painter, place)

    def painted(self, moment: int, corner: Array) -> tuple[Image, dict[str, Array], dict[str, bool]]:
        """Layer (H, W, 4), places in the picture, and which marks the figure itself does not cover."""
        joints = {name: at[moment] - corner for name, at in self.place.items()}
        right = self.walker.facing > 0
        width = self.painter.shape[1]
        turned = joints if right else {n: np.array([width - 1 - x, y]) for n, (x, y) in joints.items()}
        parts = self.painter.parts(turned, float(self.walker.gait.phase[moment]))
        layer = compose(parts, self.painter.shape)
        return layer if right else layer[:, ::-1], joints, seen(parts, turned)


@dataclass(frozen=True)
class _Set:
    """Everything that is filmed.

    actors : from the farthest to the nearest
    light  : (T, h, w) on the street; front (H, W, 4) what stands before everybody
    """

    plan: Plan
    actors: list[_Actor]
    street: Image
    front: Image | None
    light: Array | None
    slant: Array

    @classmethod
    def built(cls, plan: Plan, rng: np.random.Generator) -> "_Set":
        wears = [_clothes(plan, rng) for _ in plan.walkers]
        actors = [
            _Actor.dressed(walker, plan, wear) for walker, wear in zip(plan.walkers, wears, strict=True)
        ]
        return cls(
            plan,
            sorted(actors, key=lambda actor: float(actor.walker.start[1])),
            street(plan.street, wears[0].trousers, rng) * np.float32(rng.uniform(0.75, 1.05)),
            _front(plan, rng),
            light_fields(plan.street, plan.frames, rng) if plan.moving_light else None,
            np.array([rng.uniform(-0.55, 0.55), rng.uniform(0.14, 0.24)]),
        )

    @cached_property
    def lead(self) -> int:
        """Which of the actors is to be followed."""
        return next(i for i, actor in enumerate(self.actors) if actor.walker is self.plan.walkers[0])

    def exposed(self, t: int) -> tuple[Image, dict[str, Mark]]:
        """The picture before the lens, and the first walker's joints in it."""
        shape = (*self.plan.size[::-1], 3)
        picture, marks = np.zeros(shape, np.float32), dict[str, Mark]()
        for i in range(MOMENTS):
            shown, at_moment = self._moment(MOMENTS * t + i)
            picture += shown / MOMENTS
            if i == MOMENTS // 2:
                marks = at_moment
        if self.light is not None:
            light = cv2.resize(self.light[t], self.plan.street, interpolation=cv2.INTER_LINEAR)
            picture *= _through(light, self.plan.view[MOMENTS * t + MOMENTS // 2], self.plan.size)[..., None]
        return picture, marks

    def _moment(self, moment: int) -> tuple[Image, dict[str, Mark]]:
        corner, size = self.plan.view[moment], self.plan.size
        picture = _through(self.street, corner, size)
        painted = [actor.painted(moment, corner) for actor in self.actors]
        for actor, (layer, _, _) in zip(self.actors, painted, strict=True):
            dark = 1.0 - shadow_on(layer[..., 3], float(actor.walker.start[1] - corner[1]), self.slant)
            picture *= 1.0 - self.plan.sun * dark[..., None]
        _, places, visible = painted[self.lead]
        front = [] if self.front is None else [_through(self.front, corner, size)]
        for i, layer in enumerate([*(layer for layer, _, _ in painted), *front]):
            picture = picture * (1.0 - layer[..., 3:]) + layer[..., :3]
            if i > self.lead:
                visible = {
                    name: shown and not under(layer[..., 3], places[name][None])[0]
                    for name, shown in visible.items()
                }
        return picture, {name: Mark(*map(float, places[name]), visible[name]) for name in MARK_RANKS}


def _clothes(plan: Plan, rng: np.random.Generator) -> Wardrobe:
    wear = replace(Wardrobe.choose(rng), loose=plan.loose)
    return replace(wear, far_shade=ALIKE) if plan.alike else wear


def _front(plan: Plan, rng: np.random.Generator) -> Image | None:
    """(H, W, 4) colour times cover and cover, over the whole street."""
    if plan.occluder is None:
        return None
    kind, centre, wide = plan.occluder
    return _shrub(plan, centre, wide, rng) if kind == SHRUB else _post(plan, centre, wide, rng)


def _shrub(plan: Plan, centre: float, wide: float, rng: np.random.Generator) -> Image:
    """One of the street's shrubs, brought to this width about the floor."""
    width, height = plan.street
    size = wide / (np.mean(SHRUB_WIDTH) * height)
    layer = foreground((int(np.ceil(width / size)), height), [centre / size], rng)
    about_floor = np.array([[size, 0.0, 0.0], [0.0, size, (1.0 - size) * FLOOR * height]])
    return np.asarray(cv2.warpAffine(layer, about_floor, plan.street, flags=cv2.INTER_LINEAR), np.float32)


def _post(plan: Plan, centre: float, wide: float, rng: np.random.Generator) -> Image:
    """A round post from above the picture to the ground before the walker."""
    width, height = plan.street
    across = (np.arange(width) - centre) / (0.5 * wide)
    cover = np.clip((1.0 - np.abs(across)) * 0.5 * wide + 0.5, 0.0, 1.0)
    tone = rng.uniform(*POST_TONE) + rng.normal(0.0, 12.0, 3)
    colour = tone * (1.0 - 0.4 * np.clip(across + rng.uniform(-0.3, 0.3), -1.0, 1.0) ** 2)[:, None]
    layer = np.zeros((height, width, 4), np.float32)
    layer[: int(POST_GROUND * height)] = (
        np.concatenate([colour, np.ones((width, 1))], axis=1) * cover[:, None]
    )
    return layer


def _through(layer: Image, corner: Array, size: tuple[int, int]) -> Image:
    """What of a layer over the street is in the picture whose top left corner is there."""
    moved = np.array([[1.0, 0.0, -corner[0]], [0.0, 1.0, -corner[1]]])
    return np.asarray(cv2.warpAffine(layer, moved, size, flags=cv2.INTER_LINEAR), np.float32)
