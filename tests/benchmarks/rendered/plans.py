"""What a film of a seed is to show and how it is filmed, all drawn before anything is painted."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from scipy.ndimage import gaussian_filter1d

from kinematics.mocap import Trial
from tests.benchmarks.rendered.captures import GAITS, Motion, gait_of, motions
from tracker.scene.steps import Array, Build, Gait, joint_places, random_build
from tracker.scene.street import FLOOR

STILL, DRIFT, PAN, SHAKE = "still", "drift", "pan", "shake"
SHRUB, POST = "shrub", "post"
BEFORE, BEHIND = "before", "behind"
HEIGHT = 360
WIDTHS = (640, 640, 768)  # h264 of other than multiples of 128 differs from one time to the next
LEGS = (0.19, 0.27)  # thigh + shank, of the picture's height
LEAST_LEG = 50.0  # px
LEAST_WAY = 2.0  # leg lengths; who goes less far in a film does not walk through it
MARGIN = 0.15  # of a leg, kept free beside the outermost joint
MOMENTS = 3  # of the shutter, averaged into one frame
SPARE = 0.1  # seconds of a motion before and after the film
LONGER = 2.5  # how much longer than its capture a film may be
EDGE = 24.0  # px of street beside what the camera sees


@dataclass(frozen=True)
class Walker:
    """One person's way through the street.

    gait   : at every moment of the film
    leg_px : thigh + shank, pixels
    start  : (2,) pixels of the street, where the floor is under the figure's root_x of 0
    facing : +1 right, -1 left
    motion : what is shown, and at which of its seconds, `zero`, the film's first frame is
    """

    gait: Gait
    build: Build
    leg_px: float
    start: Array
    facing: int
    label: str
    name: str
    motion: Motion
    zero: float

    @property
    def x(self) -> Array:
        """(S,) of the hip in the street, pixels."""
        return np.asarray(self.start[0] + self.facing * self.leg_px * self.gait.pose[:, 0])

    @property
    def reach(self) -> float:
        """How far from the hip any joint ever is along the way, leg lengths."""
        places = joint_places(self.build, self.gait)
        return float(max(np.abs(place[:, 0] - places["hip"][:, 0]).max() for place in places.values()))


@dataclass(frozen=True)
class Plan:
    """A film to be made.

    walkers  : the one to be followed, and who crosses
    view     : (S, 2) top left corner of the picture in the street at every moment, pixels
    street   : width and height of the street, pixels
    speed    : of playback, 0.5 for slow motion
    crossing : where the second one passes, None without
    occluder : what hides the legs for a while, and centre and width of it in the street, pixels; None without
    alike    : whether the far leg is hardly darker than the near one
    loose    : width of the trousers, 1 as usual
    quality  : of JPEG, 1 to 100; crf of h264
    sun      : how strong the shadows are, 1 as in full sun
    moving_light : whether the light changes
    """

    seed: int
    walkers: tuple[Walker, ...]
    size: tuple[int, int]
    street: tuple[int, int]
    frames: int
    fps: float
    speed: float
    camera: str
    view: Array
    crossing: str | None
    occluder: tuple[str, float, float] | None
    alike: bool
    loose: float
    quality: int
    crf: int
    noise: float
    sun: float
    moving_light: bool

    @property
    def kinds(self) -> dict[str, str]:
        """In which kinds of films it counts."""
        return {
            "gait": self.walkers[0].label,
            "camera": self.camera,
            "occluder": "none" if self.occluder is None else self.occluder[0],
            "second person": self.crossing or "none",
            "playback": f"{self.speed:g}",
            "legs": "alike" if self.alike else "far one darker",
        }


@dataclass(frozen=True)
class Casting:
    """What is drawn once, however often the rest must be drawn again until it fits the picture."""

    label: str
    facing: int
    camera: str
    crossing: str | None
    occluder: str | None

    @classmethod
    def draw(cls, rng: np.random.Generator) -> Self:
        return cls(
            label=GAITS[int(rng.uniform() < 0.4)],
            facing=int(rng.choice([-1, 1])),
            camera=str(rng.choice([STILL, DRIFT, PAN, SHAKE], p=[0.5, 0.15, 0.2, 0.15])),
            crossing=str(rng.choice([BEFORE, BEHIND])) if rng.uniform() < 0.2 else None,
            occluder=str(rng.choice([SHRUB, POST])) if rng.uniform() < 0.25 else None,
        )


def planned(seed: int, trials: Sequence[Trial]) -> Plan:
    """The film of a seed.

    Args:
        trials: rows of the table of captures; a person of each gait is drawn first, then one of its captures.
    """
    rng = np.random.default_rng([seed, 0])
    casting = Casting.draw(rng)
    while True:
        fits = _drawn(seed, casting, trials, rng)
        if fits is not None:
            return fits


def _drawn(seed: int, casting: Casting, trials: Sequence[Trial], rng: np.random.Generator) -> Plan | None:
    """A film of this cast, None where it is too short, or too long, for the walk and the picture."""
    frames, fps = int(rng.integers(60, 151)), float(rng.choice([24.0, 25.0, 30.0, 50.0]))
    speed = float(rng.choice([1.0, 0.5, 2.0], p=[0.84, 0.08, 0.08]))
    step, shutter = speed / fps, rng.uniform(0.1, 0.5)
    moments = step * (np.arange(frames)[:, None] + shutter * np.linspace(-0.5, 0.5, MOMENTS)).ravel()
    motion = _motion(casting.label, trials, rng)
    if motion is None or step * frames > LONGER * motion.seconds:
        return None
    size = (int(rng.choice(WIDTHS)), HEIGHT)
    lead = _walker(motion, moments, rng.uniform(*LEGS) * HEIGHT, casting.facing, rng)
    way = _way(casting.camera, lead, frames, fps, rng)
    framed = _framed(casting.camera, lead, way, size, rng)
    if framed is None:
        return None
    lead, view, street = framed
    walkers = [lead]
    if casting.crossing is not None:
        other = _motion(GAITS[int(rng.uniform() < 0.3)], trials, rng)
        if other is None or step * frames > LONGER * other.seconds:
            return None
        walkers.append(_crossing(lead, other, moments, casting.crossing, rng))
    return Plan(
        seed=seed,
        walkers=tuple(walkers),
        size=size,
        street=street,
        frames=frames,
        fps=fps,
        speed=speed,
        camera=casting.camera,
        view=view,
        crossing=casting.crossing,
        occluder=_occluder(casting.occluder, lead, rng),
        alike=bool(rng.uniform() < 0.4),
        loose=float(rng.uniform(0.85, 1.3)),
        quality=int(rng.integers(45, 96)),
        crf=int(rng.integers(17, 31)),
        noise=float(rng.uniform(1.0, 5.0)),
        sun=float(rng.choice([0.4, 1.0])),
        moving_light=bool(rng.uniform() < 0.5),
    )


def _framed(
    camera: str, lead: Walker, way: Array, size: tuple[int, int], rng: np.random.Generator
) -> tuple[Walker, Array, tuple[int, int]] | None:
    """The walker in the street, the picture's corner at every moment, and the street's size.

    The walker is made as small as it takes to stay in the picture; None where that is too small, or where the
    way is too short.
    """
    # The walker's way grows with the leg, and a camera that follows goes with it; the picture stays as large.
    beside = 2.0 * (lead.reach + MARGIN) * lead.leg_px
    smaller = min(1.0, (size[0] - 1) / (np.ptp(lead.x - way[:, 0]) + beside))
    lead = replace(lead, leg_px=smaller * lead.leg_px)
    way = way * (smaller if camera == PAN else 1.0, 1.0)
    relative, beside = lead.x - way[:, 0], smaller * beside
    free = size[0] - 1 - np.ptp(relative) - beside
    if lead.leg_px < LEAST_LEG or free < 0.0 or np.ptp(lead.gait.pose[:, 0]) < LEAST_WAY:
        return None
    left = relative.min() - 0.5 * beside - rng.uniform(0.0, 1.0) * free
    edge = EDGE * (camera != STILL)
    corner = np.array([left + way[:, 0].min(), way[:, 1].min()]) - edge
    view = way + np.array([left, 0.0]) - corner
    width, height = (int(n) for n in np.ceil(view.max(axis=0) + size + edge))
    start = np.array([lead.start[0] - corner[0], FLOOR * height])
    return replace(lead, start=start), view, (width, height)


def _motion(label: str, trials: Sequence[Trial], rng: np.random.Generator) -> Motion | None:
    """Of one person with this gait, each as likely; None where the capture drawn holds none."""
    own = [trial for trial in trials if trial.activity == label]
    person = rng.choice(sorted({trial.subject for trial in own}))
    mine = [trial for trial in own if trial.subject == person]
    found = motions(mine[rng.integers(len(mine))])
    return found[rng.integers(len(found))] if found else None


def _walker(motion: Motion, moments: Array, leg_px: float, facing: int, rng: np.random.Generator) -> Walker:
    build = random_build(rng)
    seconds = float(np.ptp(moments))
    longer, begin = _lasting(motion, seconds, rng)
    gait = gait_of(longer, build, begin + moments - moments[0], float(rng.uniform(0.7, 1.2)))
    zero = begin - float(moments[0])
    return Walker(gait, build, leg_px, np.zeros(2), facing, motion.label, motion.name, longer, zero)


def _lasting(motion: Motion, film_seconds: float, rng: np.random.Generator) -> tuple[Motion, float]:
    """A motion that lasts for the film, either leg near, and when in it the film begins, seconds."""
    motion = motion.mirrored if rng.uniform() < 0.5 else motion
    needed = film_seconds + 2.0 * SPARE
    if motion.seconds < needed:
        motion = motion.prolonged(needed)
    return motion, float(rng.uniform(SPARE, motion.seconds - film_seconds - SPARE + 1e-9))


def _crossing(lead: Walker, motion: Motion, moments: Array, where: str, rng: np.random.Generator) -> Walker:
    """Somebody who comes towards the first one and passes about the middle of the film."""
    nearer = 1.0 if where == BEFORE else -1.0
    leg_px = lead.leg_px * (1.0 + nearer * rng.uniform(0.03, 0.12))
    other = _walker(motion, moments, leg_px, -lead.facing, rng)
    meeting = int(rng.uniform(0.35, 0.65) * len(moments))
    floor = lead.start[1] + nearer * rng.uniform(0.08, 0.18) * lead.leg_px
    return replace(other, start=np.array([lead.x[meeting] - other.x[meeting], floor]))


def _occluder(kind: str | None, lead: Walker, rng: np.random.Generator) -> tuple[str, float, float] | None:
    if kind is None:
        return None
    wide = rng.uniform(0.45, 0.7) if kind == SHRUB else rng.uniform(0.15, 0.35)
    return kind, float(np.quantile(lead.x, rng.uniform(0.3, 0.75))), float(wide * lead.leg_px)


def _way(camera: str, lead: Walker, frames: int, fps: float, rng: np.random.Generator) -> Array:
    """(S, 2) way of the picture's corner over the street from anywhere, pixels."""
    seconds = np.repeat(np.arange(frames) / fps, MOMENTS)
    if camera == DRIFT:
        along = rng.choice([-1.0, 1.0], 2) * (rng.uniform(4.0, 25.0), rng.uniform(0.0, 4.0))
        return np.asarray(seconds[:, None] * along)
    if camera == PAN:
        path = gaussian_filter1d(lead.x, 0.4 * fps * MOMENTS, mode="nearest")
        followed = rng.uniform(0.4, 0.95) * (path - path[0])
        return np.stack([followed, _wandering(frames, fps, 0.5, rng)], axis=1)
    if camera == SHAKE:
        return np.stack([_wandering(frames, fps, rng.uniform(0.5, 2.0), rng) for _ in range(2)], axis=1)
    return np.zeros((frames * MOMENTS, 2))


def _wandering(frames: int, fps: float, size: float, rng: np.random.Generator) -> Array:
    """(S,) of a hand that holds a camera: tremor of this many pixels, and sway three times as large."""
    total = np.zeros(frames * MOMENTS)
    for seconds, share in ((0.12, 1.0), (0.7, 3.0)):
        sigma = seconds * fps * MOMENTS
        noise = gaussian_filter1d(rng.standard_normal(len(total)), sigma, mode="reflect")
        total += share * size * noise * np.sqrt(2.0 * np.sqrt(np.pi) * sigma)
    return total
