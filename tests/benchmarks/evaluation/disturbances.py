"""What may go wrong with a clip, done to its frames in memory: each alone, and repeatable."""

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.run.score import leg_length
from tracker.tables.keypoints import Mark, Marks
from videos.frames import Video

Image = NDArray[np.uint8]

DIM_FRAMES = 20
GREY_LEVELS = 10.0
JPEG_QUALITY = 30
START_NOISE = 3.0  # px a coordinate
GUESS_NOISE = 4.0  # px a coordinate
HEDGE_TOP, HEDGE_BEHIND, HEDGE_AHEAD = 0.72, 1.1, 0.7  # leg lengths below, behind and ahead of the first hip
HEDGE_GREEN = (70.0, 95.0, 50.0)
HEDGE_GRAIN = 2.0  # px
HEDGE_CONTRAST = 0.25  # standard deviation of its brightness, share of the mean


@dataclass(frozen=True)
class Film:
    """Pictures, RGB, their rate, and the joints marked in them."""

    images: list[Image]
    fps: float
    marks: Marks


def read_film(clip: Path, marks: Marks) -> Film:
    """A clip as far as it is marked."""
    video = Video(clip)
    return Film([frame.image for frame in video if frame.index <= max(marks)], video.fps, marks)


def write_film(film: Film, path: Path) -> None:
    """The pictures as they are, without loss, in a .mov of their own rate."""
    height, width = film.images[0].shape[:2]
    with av.open(str(path), "w") as container:
        stream = container.add_stream("qtrle", rate=Fraction(film.fps).limit_denominator(1001))
        stream.width, stream.height, stream.pix_fmt = width, height, "rgb24"
        for image in film.images:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="rgb24")))
        container.mux(stream.encode())


def every_second(film: Film) -> Film:
    """Every second frame dropped, and with it the marks in it."""
    marks = {frame // 2: row for frame, row in film.marks.items() if frame % 2 == 0}
    return Film(film.images[::2], film.fps / 2, marks)


def dimmed(film: Film) -> Film:
    """Brightness that falls linearly to a half over the first 20 frames and stays there."""
    shares = [1.0 - 0.5 * min(t / DIM_FRAMES, 1.0) for t in range(len(film.images))]
    images = [_rounded(share * image) for share, image in zip(shares, film.images, strict=True)]
    return replace(film, images=images)


def noisy(film: Film) -> Film:
    """Gaussian noise of 10 grey levels on every channel of every pixel."""
    rng = np.random.default_rng(0)
    return replace(
        film, images=[_rounded(image + rng.normal(0.0, GREY_LEVELS, image.shape)) for image in film.images]
    )


def compressed(film: Film) -> Film:
    """Every frame through JPEG at quality 30."""
    return replace(film, images=[_through_jpeg(image) for image in film.images])


def behind_hedge(film: Film) -> Film:
    """A hedge before the feet of the first marked frame; it stands still in the picture, down to its foot."""
    frames = sorted(film.marks)
    leg = leg_length(film.marks, frames[:1])
    hip, last = (film.marks[frame]["hip"] for frame in (frames[0], frames[-1]))
    way = 1.0 if last.x >= hip.x else -1.0

    height, width = film.images[0].shape[:2]
    ahead = way * (np.arange(width) - hip.x) / leg
    below = (np.arange(height) - hip.y) / leg
    there = (below > HEDGE_TOP)[:, None] & (ahead > -HEDGE_BEHIND) & (ahead < HEDGE_AHEAD)
    hedge = _hedge(height, width)
    return replace(film, images=[np.where(there[..., None], hedge, image) for image in film.images])


DISTURBANCES: dict[str, Callable[[Film], Film]] = {
    "none": lambda film: film,
    "every second frame": every_second,
    "brightness halved over 20 frames": dimmed,
    "noise of 10 grey levels": noisy,
    "JPEG quality 30": compressed,
}


def moved(row: dict[str, Mark], rng: np.random.Generator) -> dict[str, Mark]:
    """The marks of one frame with Gaussian noise of 3 px on both coordinates."""
    return {name: beside(mark, START_NOISE, rng) for name, mark in row.items()}


def guessed(row: dict[str, Mark], joints: Collection[str], rng: np.random.Generator) -> dict[str, Mark]:
    """The marks of one frame, those of the joints not visible and with Gaussian noise of 4 px."""
    return {
        name: replace(beside(mark, GUESS_NOISE, rng), visible=False) if name in joints else mark
        for name, mark in row.items()
    }


def beside(mark: Mark, noise: float, rng: np.random.Generator) -> Mark:
    """A mark with Gaussian noise of so many pixels on both coordinates."""
    return replace(mark, x=mark.x + rng.normal(0.0, noise), y=mark.y + rng.normal(0.0, noise))


def _hedge(height: int, width: int) -> Image:
    """Green, rough, and the same in every run."""
    rough = cv2.GaussianBlur(np.random.default_rng(0).normal(size=(height, width)), (0, 0), HEDGE_GRAIN)
    brightness = 1.0 + HEDGE_CONTRAST * rough / rough.std()
    return _rounded(brightness[..., None] * HEDGE_GREEN)


def _rounded(image: NDArray[np.float64]) -> Image:
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)


def _through_jpeg(image: Image) -> Image:
    stored = cv2.imencode(".jpg", image[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])[1]
    return np.ascontiguousarray(cv2.imdecode(stored, cv2.IMREAD_COLOR)[..., ::-1])
