"""Small painted films of a walker, and what is known of them.

Every link is a bar as wide as `Shape` has it, written out here anew, with a cloth of its own. The scene is a
picture larger than the frames, so that the camera may move over it.
"""

from dataclasses import dataclass, replace
from functools import cache

import cv2
import numpy as np

from kinematics.recover import Start
from kinematics.spm import View, joints, skeleton
from tracker.outline.cycles import PHASES, Cycles, at_phases, poses
from tracker.outline.fit import Outline
from tracker.outline.person import Person, seen_figure
from tracker.outline.shape import Grid, Shape
from tracker.outline.stage import Stage
from tracker.survey.evidence import NOTHING, UNITS

WALKER = seen_figure()
SHAPE = Shape.of(WALKER)
CYCLES = Cycles.load()
GRID = Grid((-1.2, 1.2), 24.0, (60, 60))  # around a figure
WALK = 4  # among the cycles
FEW = Cycles(*(each[[2, WALK, 6]] for each in (CYCLES.pose, CYCLES.runs, CYCLES.rare)))  # for speed
FRAMES, SIZE, UNIT, FPS = 32, (240, 160), 40.0, 30.0
MIDDLE = FRAMES // 2
FIRST = 5  # frame of those that begin within a stride
PERIOD = 34.7  # frames a stride
SPEED = 2.2  # pixels a frame
HIP = 100.0  # row
BORDER = 48  # pixels of the scene around the first frame
COLOURS = {"torso": (190.0, 40.0, 40.0), "head": (90.0, 50.0, 30.0)}
LEGS = {"near": (40.0, 40.0, 110.0), "far": (30.0, 90.0, 60.0)}


@dataclass(frozen=True)
class Film:
    """A film and its truth.

    images : (T, h, w, 3) uint8 RGB
    cover  : (T, h, w) share of each pixel that the walker covers
    places : (T, 3, 3) from the pixels of each frame to those of the first
    scene  : (h + 2 BORDER, w + 2 BORDER, 3) without the walker, BORDER wider than the first frame
    q      : (T, D) poses, their root at `hips`
    phase  : (T,) of the cycle
    hips   : (T, 2) pixels of each frame
    units  : (T,) pixels in a leg length
    joints : (T, J, 2) pixels of each frame
    facing : +1 right, -1 left
    """

    images: np.ndarray
    cover: np.ndarray
    places: np.ndarray
    scene: np.ndarray
    q: np.ndarray
    phase: np.ndarray
    hips: np.ndarray
    units: np.ndarray
    joints: np.ndarray
    facing: int = 1

    def start(self, frame=MIDDLE):
        """The figure as it would be marked in a frame."""
        view = View(tuple(self.hips[frame].tolist()), float(self.units[frame]), self.facing)
        return Start(WALKER, view, self.q[frame], np.ones(self.q.shape[1], bool))

    def stage(self, rng, noise=0.4):
        """The film with log odds as a good survey would find them."""
        odds = np.clip(5.0 * self.cover - 2.5 + rng.normal(scale=noise, size=self.cover.shape), -2.5, 2.5)
        stored = (NOTHING + np.rint(UNITS * odds)).astype(np.uint8)
        light = np.stack([cv2.cvtColor(each, cv2.COLOR_RGB2Lab)[..., 0] for each in self.images])
        return Stage(stored, light, np.eye(3), self.places, self.facing, FPS, np.ones(len(light)))

    def mirrored(self):
        """Who walks to the left; of a camera that is still."""
        mirror, last = np.array([-1.0, 1.0]), np.array([SIZE[0] - 1.0, 0.0])
        return replace(
            self,
            images=np.ascontiguousarray(self.images[:, :, ::-1]),
            cover=self.cover[:, :, ::-1],
            scene=self.scene[:, ::-1],
            hips=last + mirror * self.hips,
            joints=last + mirror * self.joints,
            facing=-self.facing,
        )

    def shifted(self, right):
        """Who walks so many pixels further right; of a camera that is still."""
        by = np.array([float(right), 0.0])
        return replace(
            self,
            images=np.roll(self.images, right, axis=2),
            cover=np.roll(self.cover, right, axis=2),
            hips=self.hips + by,
            joints=self.joints + by,
        )

    def on_the_spot(self, frame=MIDDLE):
        """Who steps on the spot: the hip stays where it is in a frame, and the scene moves instead."""
        by = np.rint(self.hips[:, 0] - self.hips[frame, 0]).astype(int)
        return self.carried(np.stack([-by, 0 * by], axis=1))

    def part(self, frames):
        """Some of its frames."""
        names = ("images", "cover", "places", "q", "phase", "hips", "units", "joints")
        return replace(self, **{name: getattr(self, name)[frames] for name in names})

    def behind(self, other):
        """The film with the other's walker before its own, who is no part of what is known of it."""
        cover = other.cover[..., None]
        images = np.rint((1.0 - cover) * self.images + cover * other.images).astype(np.uint8)
        return replace(self, images=images, cover=np.maximum(self.cover, other.cover))

    def carried(self, by):
        """Who is so many pixels (T, 2) further right and down in each frame; of a camera that is still."""

        def rolled(pictures):
            return np.stack(
                [np.roll(each, way[::-1], (0, 1)) for each, way in zip(pictures, by, strict=True)]
            )

        return replace(
            self,
            images=rolled(self.images),
            cover=rolled(self.cover),
            hips=self.hips + by,
            joints=self.joints + by[:, None],
        )

    def person(self, frame=MIDDLE, *, direction=1, turned=0.3, named=9.0):
        """Who is found where everything is seen as it is."""
        T = len(self.q)
        outline = Outline(
            self.q,
            self.hips,
            self.units,
            self.joints,
            np.ones(T),
            np.ones(self.joints.shape[:2], bool),
            np.zeros(T),
            gait="walk",
            way=1,
            named=named,
            misnamed=0.5,
        )
        return Person(WALKER, 0, frame, self.facing, direction, turned, outline)

    def backwards(self):
        """The film with time running back; of a camera that is still."""
        names = ("images", "cover", "q", "phase", "hips", "units", "joints")
        return replace(self, **{name: getattr(self, name)[::-1] for name in names})


def evidence(tell, film, stage, *, q=None, seen=None):
    """What `nearness` or `swing` makes of a film: its own poses, in all frames, unless told otherwise."""
    seen = np.ones(len(film.q), bool) if seen is None else seen
    return tell(SHAPE, film.q if q is None else q, stage, film.hips, film.units, seen)


def film(rng, *, frames=FRAMES, camera=(0.0, 0.0, 0.0, 0.0), alike=False, walker=True):
    """Who walks to the right through a scene, in its middle in the middle of the film.

    Args:
        camera: shift x, shift y, turn and log size a frame.
        alike: both legs have one colour, and no link a texture.
    """
    t = np.arange(frames)
    phase = PHASES * t / PERIOD
    q = poses(WALKER, at_phases(CYCLES.pose[WALK], phase))
    hips = np.stack([SIZE[0] / 2 + SPEED * (t - frames // 2), np.full(frames, HIP)], axis=1)
    places = np.stack([_place(*(np.array(camera) * i)) for i in t])
    scene, cloths = _scene(rng), _cloths(rng, alike)
    images, cover = [], []
    for pose, hip, place in zip(q, hips, places, strict=True):
        points = _points(place)
        layer = _layer(pose, (points - hip) / UNIT * (1.0, -1.0), cloths) * float(walker)
        image = (1.0 - layer[..., 3:]) * _scene_at(scene, points) + layer[..., :3]
        image += rng.normal(scale=1.5, size=image.shape)
        images.append(np.clip(np.rint(image), 0, 255).astype(np.uint8))
        cover.append(layer[..., 3])
    inverse = np.linalg.inv(places)
    return Film(
        images=np.stack(images),
        cover=np.stack(cover),
        places=places,
        scene=scene,
        q=q,
        phase=phase,
        hips=moved(inverse, hips[:, None])[:, 0],
        units=UNIT * np.sqrt(np.linalg.det(inverse)),
        joints=moved(inverse, hips[:, None] + joints(WALKER, q) * UNIT * (1.0, -1.0)),
    )


def blobs(rng, count):
    """(count, *GRID.shape) log odds that go evenly up and down."""
    noise = rng.normal(size=(count, *GRID.shape)).astype(np.float32)
    return np.stack([10.0 * cv2.GaussianBlur(each, (0, 0), 3.0) for each in noise])


def random_poses(rng, count):
    return rng.normal(size=(count, len(WALKER.freedoms))) * 0.15


@cache
def a_walk():
    """Who walks before a still camera; not to be written to."""
    return film(np.random.default_rng(20))


def moved(places, points):
    """(T, P, 2) points (T, P, 2), or (P, 2), as similarities (T, 3, 3) map them."""
    return points @ places[:, :2, :2].swapaxes(1, 2) + places[:, None, :2, 2]


def _place(x, y, turn, size):
    """(3, 3) from a frame's pixels to the first's."""
    centre, place = 0.5 * np.array(SIZE), np.eye(3)
    place[:2, :2] = np.exp(size) * np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    place[:2, 2] = centre - place[:2, :2] @ centre + (x, y)
    return place


def _points(place):
    """(h, w, 2) places of a frame's pixels in the first frame."""
    pixels = np.stack(np.meshgrid(*(np.arange(n, dtype=float) for n in SIZE)), axis=-1)
    return pixels @ place[:2, :2].T + place[:2, 2]


def _scene(rng):
    width, height = (n + 2 * BORDER for n in SIZE)
    waves = cv2.GaussianBlur(rng.normal(size=(height, width, 3)), (0, 0), 2.5)
    waves *= 14.0 / waves.std()
    return np.clip((150.0, 160.0, 140.0) + 1.2 * waves.mean(2, keepdims=True) + 0.3 * waves, 0.0, 255.0)


def _scene_at(scene, points):
    at = (points + BORDER).astype(np.float32)
    return cv2.remap(scene, at[..., 0], at[..., 1], cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT)


def _cloths(rng, alike):
    """For each link an RGB colour, contrast, and a texture (along, across)."""
    colours = COLOURS | (dict.fromkeys(LEGS, LEGS["near"]) if alike else LEGS)
    found = []
    for link in WALKER.links:
        colour = next(colour for part, colour in colours.items() if part in link.name)
        texture = cv2.GaussianBlur(rng.normal(size=(24, 16)), (0, 0), 1.5)
        found.append((np.array(colour), 0.0 if alike else 12.0 / texture.std(), texture))
    return found


def _layer(q, body, cloths):
    """(h, w, 4) what each pixel has of a walker's RGB, and how much of it the walker covers.

    Args:
        body: (h, w, 2) its body coordinates.
    """
    close = np.nonzero(np.hypot(body[..., 0], body[..., 1]) < 1.4)
    places, bones = body[close], skeleton(WALKER, q)
    colours = np.zeros((len(places), 4))
    for i in sorted(range(len(WALKER.links)), key=lambda i: WALKER.links[i].layer):
        first, last, start, tip, beside = SHAPE.bars[i]
        length, (colour, contrast, texture) = bones.length[i], cloths[i]
        middle = places - (bones.start[i] + 0.5 * length * bones.direction[i])
        own = np.flatnonzero(np.einsum("pk,pk->p", middle, middle) < (0.5 * length + 0.2) ** 2)
        off = places[own] - bones.start[i]
        u, v = off @ bones.direction[i], off @ bones.normal[i] - beside
        nearest = np.clip(u, first * length, last * length)
        half = start + (tip - start) * (nearest / length - first) / (last - first)
        cover = np.clip(0.5 + UNIT * (half - np.hypot(u - nearest, v)), 0.0, 1.0)[:, None]
        row, column = (4.0 + 16.0 * u / length).astype(np.float32), (8.0 + 40.0 * v).astype(np.float32)
        cloth = cv2.remap(texture, column, row, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
        layer = np.concatenate([colour + contrast * cloth, np.ones_like(cloth)], axis=1)
        colours[own] += cover * (layer - colours[own])
    found = np.zeros((*body.shape[:2], 4))
    found[close] = colours
    return found


def enlarged(stage, by):
    """The same film or stage where the scene is told in a frame in which all is so many times as large."""
    return replace(stage, places=np.diag([by, by, 1.0]) @ stage.places)
