"""A rendered walk whose poses are known: for `figtrack demo`, the README, and tests.

A walker of `scene.steps`, painted by `scene.body` in the street of `scene.street`, is filmed by a simulated
camera: the light changes, the shutter is open for half a frame, the lens is a little soft, the sensor is
noisy, and the picture is compressed. The walk is planar and filmed square from the side by a still camera, so
that a limb keeps its length in pixels; the difficulties are in the picture, not in the geometry.

A rendered walk tests correctness. It does not say how well real footage is followed.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.scene.body import MARK_RANKS, Painter, compose, seen
from tracker.scene.cloth import Image, Wardrobe
from tracker.scene.steps import STEPS, Array, Gait, joint_places, random_build, walk
from tracker.scene.street import FLOOR, foreground, light_fields, street

Picture = NDArray[np.uint8]

KEYPOINTS = tuple(MARK_RANKS)
ARM_JOINTS = ("near_elbow", "near_wrist", "far_elbow", "far_wrist")
SHUTTER = (-2, 0, 2)  # of STEPS moments a frame, those that are averaged: about half of the frame
MARGIN = 0.55  # margin beside the hip at both ends, for half a step and the arms, legs
FPS = 30.0
STRIDES = (31.0, 37.0)  # range of a stride's duration, frames
SHRUBS = ((0.25, 0.35), (0.6, 0.75))  # ranges of the shrubs' places, shares of the way
NOISE = 3.2  # noise of the sensor, grey levels
QUALITY = 60  # JPEG quality
LOWEST = 30  # least height of a picture, pixels; in a lower one the hedge has no room


@dataclass(frozen=True)
class Scene:
    """A rendered walk with its true poses.

    images : T pictures (H, W, 3) uint8 RGB, the compressed ones
    joints : (T, 2) pixels for each keypoint; x right, y down, (0, 0) the centre of the top-left pixel
    arms   : the same for elbows and wrists
    visible: (T,) bool for each keypoint, true if no nearer limb covers it
    pose   : (T, 8) root_x, root_y, torso, neck, hip_near, knee_near, hip_far, knee_far; the root in leg
             lengths from the hip's place in frame 0, x forward and y up; angles in radians, lean forward,
             thigh ahead and knee flexion positive, neck relative to the torso
    leg_px : leg length (thigh + shank), pixels
    facing : +1 walks to the right, -1 to the left
    fps    : frames per second
    """

    images: list[Picture]
    joints: dict[str, Array]
    arms: dict[str, Array]
    visible: dict[str, NDArray[np.bool_]]
    pose: Array
    leg_px: float
    facing: int
    fps: float


def render(
    seed: int,
    *,
    frames: int = 90,
    size: tuple[int, int] = (640, 360),
    shrubs: bool = True,
    advance: Callable[[], None] = lambda: None,
) -> Scene:
    """Render one person's walk along a street; the same seed gives the same pictures.

    Seeds differ in the person, the clothes, the walk, the street, the light and the facing.

    Args:
        frames: T, FPS a second.
        size: width and height of the pictures, pixels. The walker is about half as tall as the picture.
        shrubs: whether the walker passes behind shrubs.
        advance: called after every picture.

    Raises:
        ValueError: the picture is too small, or the walk would leave it.
    """
    if size[1] < LOWEST:
        raise ValueError(f"a rendered picture must be at least {LOWEST} px high; got {size[1]}")
    rng = np.random.default_rng(seed)
    build = random_build(rng)
    facing = int(rng.choice([-1, 1]))
    width, height = size
    stature = 1.0 + build.ankle + build.torso + build.neck  # height of the figure standing straight, legs
    leg_px = height * rng.uniform(0.475, 0.525) / stature

    half_shutter = max(SHUTTER)
    moments = half_shutter + STEPS * np.arange(frames)
    stride = rng.uniform(*STRIDES) * STEPS
    gait = walk(build, int(moments[-1]) + half_shutter + 1, stride, rng)

    travel = float(np.ptp(gait.pose[:, 0]))
    free = width - 1 - (travel + 2.0 * MARGIN) * leg_px
    if free < 0.0:
        raise ValueError(
            f"{frames} frames take the walker {travel * leg_px:.0f} px, too far for a picture {width} px "
            "wide; render fewer frames or a wider picture"
        )
    start = np.array([MARGIN * leg_px + rng.uniform(0.3, 0.7) * free, FLOOR * height])

    wardrobe = Wardrobe.choose(rng)
    background = street(size, wardrobe.trousers, rng)
    light = light_fields(size, frames, rng)
    path = start[0] + leg_px * (gait.pose[moments, 0] - gait.pose[moments[0], 0])
    places_on_path = [float(np.quantile(path, rng.uniform(*place))) for place in SHRUBS]
    front = foreground(size, places_on_path if shrubs else [], rng)
    shadow = np.array([rng.uniform(-0.55, 0.55), rng.uniform(0.16, 0.24)])
    painter = Painter(build, wardrobe, leg_px, (height, width))

    images, visible = [], []
    for t, moment in enumerate(moments):
        window = gait.at(moment + np.array(SHUTTER))
        layer, visible_now = _expose(painter, window, start)
        ground = background * shadow_on(layer[..., 3], start[1], shadow)[..., None]
        picture = ground * (1.0 - layer[..., 3:]) + layer[..., :3]
        picture = picture * (1.0 - front[..., 3:]) + front[..., :3]
        picture *= cv2.resize(light[t], size, interpolation=cv2.INTER_LINEAR)[..., None]
        images.append(develop(picture[:, ::facing], rng))
        visible.append(visible_now)
        advance()

    places = in_pixels(joint_places(build, gait.at(moments)), leg_px, start)
    covered = {name: under(front[..., 3], at) for name, at in places.items()}
    if facing < 0:
        places = {name: np.array([width - 1, 0.0]) + at * (-1.0, 1.0) for name, at in places.items()}
    pose = gait.pose[moments]
    pose[:, :2] -= pose[0, :2].copy()
    return Scene(
        images=compress(images),
        joints={name: places[name] for name in KEYPOINTS},
        arms={name: places[name] for name in ARM_JOINTS},
        visible={name: np.array([now[name] for now in visible]) & ~covered[name] for name in KEYPOINTS},
        pose=pose,
        leg_px=float(leg_px),
        facing=facing,
        fps=FPS,
    )


def compress(images: Sequence[Picture], quality: int = QUALITY) -> list[Picture]:
    """(H, W, 3) uint8 RGB pictures after JPEG compression, each separately, with quality 1 to 100."""
    options = [cv2.IMWRITE_JPEG_QUALITY, quality]
    squeezed = []
    for image in images:
        _, code = cv2.imencode(".jpg", cv2.cvtColor(image, cv2.COLOR_RGB2BGR), options)
        squeezed.append(np.array(cv2.imdecode(code, cv2.IMREAD_COLOR), np.uint8)[..., ::-1].copy())
    return squeezed


def truth_table(scene: Scene) -> list[tuple[int, str, float, float, int]]:
    """The rows of the scene's keypoints table: frame, keypoint, x, y in pixels, visible 1 or 0."""
    return [
        (t, name, *scene.joints[name][t].tolist(), int(scene.visible[name][t]))
        for t in range(len(scene.images))
        for name in KEYPOINTS
    ]


def in_pixels(places: dict[str, Array], leg_px: float, start: Array) -> dict[str, Array]:
    """Convert body units, y up from the floor, to pixels of a picture in which the walker faces right."""
    return {name: start + leg_px * np.array([1.0, -1.0]) * at for name, at in places.items()}


def under(cover: Image, places: Array) -> NDArray[np.bool_]:
    """(T,) whether the foreground image `cover` hides each of the places (T, 2), pixels."""
    rows = np.clip(np.round(places[:, 1]).astype(int), 0, cover.shape[0] - 1)
    columns = np.clip(np.round(places[:, 0]).astype(int), 0, cover.shape[1] - 1)
    return np.asarray(cover[rows, columns] > 0.5)


def shadow_on(alpha: Image, floor: float, slant: Array) -> Image:
    """Share of light left on the ground by the walker's shadow, the softened outline projected on it."""
    # The shadow of a place y above the floor lies slant[1] y below the floor and slant[0] y aside.
    flipped = np.array([[1.0, -slant[0], slant[0] * floor], [0.0, -slant[1], floor * (1.0 + slant[1])]])
    laid = cv2.warpAffine(alpha, flipped, alpha.shape[::-1], flags=cv2.INTER_LINEAR)
    cast = 0.45 * cv2.GaussianBlur(laid, (0, 0), 1.7, sigmaY=0.9)
    # The shadow is darkest where a sole meets the ground, however thin the shoe's own shadow is.
    soles = np.where(np.abs(np.arange(len(alpha)) - floor + 1.5) <= 2.5, 1.0, 0.0)[:, None] * alpha
    touch = 0.9 * cv2.GaussianBlur(soles.astype(np.float32), (0, 0), 3.5, sigmaY=1.8)
    dark = np.maximum(cast, touch) + 0.3 * np.minimum(cast, touch)
    return np.asarray(1.0 - np.minimum(dark, 0.65), np.float32)


def develop(picture: Image, rng: np.random.Generator, noise: float = NOISE) -> Picture:
    """The picture after lens and sensor; noise in grey levels."""
    soft = cv2.GaussianBlur(np.ascontiguousarray(picture), (0, 0), 0.65)
    noisy = soft + noise * rng.standard_normal(soft.shape, dtype=np.float32)
    return np.asarray(np.clip(np.round(noisy), 0.0, 255.0), np.uint8)


def _expose(painter: Painter, gait: Gait, start: Array) -> tuple[Image, dict[str, bool]]:
    """The walker's layer averaged over the shutter's moments, and the marks visible at the middle one."""
    places = in_pixels(joint_places(painter.build, gait), painter.leg_px, start)
    layer = np.zeros((*painter.shape, 4), np.float32)
    visible: dict[str, bool] = {}
    for i in range(len(gait.phase)):
        joints = {name: at[i] for name, at in places.items()}
        parts = painter.parts(joints, float(gait.phase[i]))
        layer += compose(parts, painter.shape) / len(gait.phase)
        if i == len(gait.phase) // 2:
            visible = seen(parts, joints)
    return layer, visible
