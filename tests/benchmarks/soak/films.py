"""Random films: rendered short walks in codecs, sizes and rates of all kinds, some of them damaged."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from pathlib import Path

import av
import cv2
import numpy as np

from tracker.scene.film import Scene, render, truth_table
from tracker.tables.table import write_table

WALKS, FRAMES, SIZE = 4, 40, (400, 200)
# Ending, encoder and pixel formats.
CODECS = (
    ("mp4", "libx264", ("yuv420p", "yuv444p", "yuv422p10le", "gray")),
    ("ts", "libx264", ("yuv420p",)),
    ("mkv", "libx265", ("yuv420p", "yuv420p10le")),
    ("webm", "libvpx", ("yuv420p",)),
    ("webm", "libvpx-vp9", ("yuv420p", "yuv444p")),
    ("mov", "prores_ks", ("yuv422p10le",)),
    ("mov", "qtrle", ("rgb24", "argb")),
    ("avi", "mjpeg", ("yuvj420p", "yuvj444p")),
    ("avi", "mpeg4", ("yuv420p",)),
    ("avi", "rawvideo", ("bgr24", "yuv420p")),
    ("mpg", "mpeg2video", ("yuv420p",)),
    ("wmv", "wmv2", ("yuv420p",)),
    ("flv", "flv", ("yuv420p",)),
    ("mkv", "ffv1", ("yuv420p", "gray", "bgr0", "yuv444p16le")),
    ("mkv", "huffyuv", ("yuv422p", "rgb24")),
    ("mkv", "png", ("rgb24", "rgba", "rgb48be")),
    ("ogv", "theora", ("yuv420p",)),
    ("nut", "snow", ("yuv420p",)),
    ("gif", "gif", ("rgb8",)),
)
RATES = tuple(
    map(Fraction, ("24", "25", "30", "30000/1001", "60", "15", "25/2", "120", "240", "1000", "1", "1/2"))
)
CLOCK = 90_000  # ticks a second of films whose frames come unevenly


@dataclass(frozen=True)
class Shot:
    """A part of a walk as it is filmed.

    images : pictures (H, W, 3) uint8 RGB of one size
    rows   : of the table of marks: frame, keypoint, x, y in pixels, visible
    """

    images: list[np.ndarray]
    rows: list[tuple[int, str, float, float, int]]


@cache
def walk(seed: int) -> Scene:
    """One of the walks that all films are of."""
    return render(seed, frames=FRAMES, size=SIZE, shrubs=seed % 2 == 1)


def shot(rng: np.random.Generator) -> Shot:
    """Some frames of some walk, in some size from 64 pixels on, even or odd; at times another one follows."""
    scene = walk(int(rng.integers(WALKS)))
    first = int(rng.integers(0, FRAMES // 2)) if rng.random() < 0.3 else 0
    last = int(rng.integers(first, FRAMES)) if rng.random() < 0.3 else FRAMES - 1
    scale = rng.uniform(0.16, 0.4) if rng.random() < 0.1 else rng.uniform(0.6, 1.2)
    size = tuple(int(length * scale) + int(rng.integers(3)) for length in SIZE)
    ratio = np.array(size) / SIZE
    after = walk(int(rng.integers(WALKS))).images if rng.random() < 0.1 else []
    images = [
        cv2.resize(image, size, interpolation=cv2.INTER_AREA)
        for image in (*scene.images[first : last + 1], *after)
    ]
    rows = [
        (t - first, name, round(x * ratio[0], 2), round(y * ratio[1], 2), seen)
        for t, name, x, y, seen in truth_table(scene)
        if first <= t <= last
    ]
    return Shot(images, rows)


def write_film(folder: Path, name: str, film: Shot, rng: np.random.Generator) -> Path:
    """The shot as a film of some kind, or as a folder of numbered pictures; whole or damaged."""
    if rng.random() < 0.1:
        return _pictures(folder / name, film, rng)
    ending, codec, formats = CODECS[rng.integers(len(CODECS))]
    path = folder / f"{name}.{ending}"
    rate = RATES[0 if rng.random() < 0.5 else rng.integers(len(RATES))]
    uneven = rng.random() < 0.15
    # Not every encoder takes every rate and every format.
    with suppress(av.FFmpegError, ValueError, OverflowError):
        _encode(path, film.images, codec, str(rng.choice(formats)), rate, rng if uneven else None)
    if not path.exists() or path.stat().st_size < 1000:
        path.unlink(missing_ok=True)
        path = folder / f"{name}.mp4"
        _encode(path, film.images, "libx264", "yuv420p", Fraction(30), None)
    if rng.random() < 0.25:
        path.write_bytes(damaged(path.read_bytes(), rng))
    return path


def write_marks(path: Path, film: Shot, rng: np.random.Generator) -> Path:
    """Marks of a frame, or of some: exact, careless, few, or spoiled."""
    frames = sorted({row[0] for row in film.rows})
    kept = set(rng.choice(frames, min(len(frames), int(rng.choice([1, 1, 2, 5]))), replace=False))
    noise = float(rng.choice([0.0, 0.0, 1.0, 5.0]))
    rows = [
        (t, name, round(x + noise * rng.normal(), 2), round(y + noise * rng.normal(), 2), seen)
        for t, name, x, y, seen in film.rows
        if t in kept and ("toe" not in name or rng.random() < 0.8)
    ]
    write_table(path, ("frame", "keypoint", "x", "y", "visible"), rows)
    if rng.random() < 0.1:
        path.write_bytes(damaged(path.read_bytes(), rng))
    return path


def damaged(data: bytes, rng: np.random.Generator) -> bytes:
    """The bytes cut, turned, made zero, doubled or grown in the middle."""
    if not data:
        return data
    stored = bytearray(data)
    at = int(rng.integers(len(stored)))
    length = int(rng.integers(1, max(2, len(stored) // 20)))
    ways: list[Callable[[], object]] = [
        lambda: stored.__delitem__(slice(at, None)),
        lambda: [
            stored.__setitem__(int(i), int(rng.integers(256))) for i in rng.integers(0, len(stored), 20)
        ],
        lambda: stored.__setitem__(slice(at, at + length), bytes(length)),
        lambda: stored.extend(data),
        lambda: stored.__setitem__(slice(at, at), rng.bytes(length)),
    ]
    ways[rng.integers(len(ways))]()
    return bytes(stored)


def _encode(
    path: Path,
    images: list[np.ndarray],
    codec: str,
    kind: str,
    rate: Fraction,
    uneven: np.random.Generator | None,
) -> None:
    """At an even rate; or with steps of time drawn at random, of which few are 0 or go back."""
    options = {"strict": "-2"} | ({"x265-params": "log-level=none"} if codec == "libx265" else {})
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=rate, options=options)
        height, width = images[0].shape[:2]
        even = codec not in ("ffv1", "png", "rawvideo", "qtrle", "gif")
        stream.width, stream.height = (width - width % 2, height - height % 2) if even else (width, height)
        stream.pix_fmt = kind
        if uneven is not None:
            stream.codec_context.time_base = Fraction(1, CLOCK)
        ticks = 0
        for image in images:
            picture = np.ascontiguousarray(image[: stream.height, : stream.width])
            frame = av.VideoFrame.from_ndarray(picture, format="rgb24").reformat(format=kind)
            if uneven is not None:
                ticks += int(CLOCK / rate * uneven.choice([0.2, 1.0, 1.0, 1.0, 3.0]))
                frame.pts, frame.time_base = ticks, Fraction(1, CLOCK)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())


def _pictures(folder: Path, film: Shot, rng: np.random.Generator) -> Path:
    """Numbered pictures, of which some may be missing, given twice, damaged or of another size."""
    folder.mkdir()
    for t, image in enumerate(film.images):
        if rng.random() < 0.02:
            continue
        for ending in ("png",) if rng.random() < 0.98 else ("png", "jpg"):
            cv2.imwrite(str(folder / f"img{t}.{ending}"), image[..., ::-1])
    some = sorted(folder.iterdir())
    if some and rng.random() < 0.2:
        one = some[rng.integers(len(some))]
        one.write_bytes(damaged(one.read_bytes(), rng))
    return folder
