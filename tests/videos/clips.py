"""Small clips, made here to be cut, turned or spoiled."""

from fractions import Fraction

import av
import numpy as np

WIDTH, HEIGHT = 96, 64
# Flat patches at crf 10: quantisation and the way to yuv420p and back move a mean by a few grey levels.
CODEC = 8


def picture(t):
    """Grey that brightens with t; the top left quarter red, so that turning and mirroring show."""
    image = np.full((HEIGHT, WIDTH, 3), 40 + 4 * t, np.uint8)
    image[: HEIGHT // 2, : WIDTH // 2] = (220, 30, 30)
    return image


def corner_colors(image):
    """(4, 3) mean RGB of the quarters: top left, top right, bottom left, bottom right."""
    h, w = image.shape[0] // 2, image.shape[1] // 2
    inner = [(slice(0, h), slice(0, w)), (slice(0, h), slice(w, None)), (slice(h, None), slice(0, w))]
    return np.array([image[k].mean((0, 1)) for k in [*inner, (slice(h, None), slice(w, None))]])


def make_clip(
    path, images, *, ticks=None, format="mp4", key_every=250, x264="", codec="libx264", pixels="yuv420p"
):
    """A clip at 30 frames a second, the index in front; `ticks` are times in milliseconds."""
    options = {"movflags": "+faststart"} if format == "mp4" else {}
    with av.open(str(path), "w", format=format, options=options) as container:
        coding = {"crf": "10", "g": str(key_every), "x264-params": x264}
        stream = container.add_stream(codec, rate=30, options=coding)
        stream.height, stream.width = images[0].shape[:2]
        stream.pix_fmt = pixels
        if ticks is not None:
            stream.codec_context.time_base = Fraction(1, 1000)
        for t, image in enumerate(images):
            frame = av.VideoFrame.from_ndarray(image, format="rgb24")
            if ticks is not None:
                frame.pts, frame.time_base = ticks[t], Fraction(1, 1000)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path


def set_display_matrix(path, matrix):
    """Patch a, b, c, d of the track header: a stored pixel goes to x' = a x + c y, y' = b x + d y."""

    def fixed(a, b, c, d):
        return b"".join((65536 * n).to_bytes(4, "big", signed=True) for n in (a, b, 0, c, d))

    stored = path.read_bytes()
    at = stored.index(fixed(1, 0, 0, 1), stored.index(b"tkhd"))
    path.write_bytes(stored[:at] + fixed(*matrix) + stored[at + 20 :])


def begin_later(path, frames):
    """Patch the edit list of a clip of `make_clip`, so that its first frames are not shown."""
    stored = path.read_bytes()
    at = stored.index(b"elst") + 16  # where in the track its showing begins, 512 ticks a frame
    begin = int.from_bytes(stored[at : at + 4], "big") + 512 * frames
    path.write_bytes(stored[:at] + begin.to_bytes(4, "big") + stored[at + 4 :])


def noise(count, rng):
    """Images that compress badly, so that bytes are spread evenly over the frames."""
    return [rng.integers(0, 256, (HEIGHT, WIDTH, 3), dtype=np.uint8) for _ in range(count)]


def joined(path, parts):
    """Recordings put one after another, as `cat` does: the times of each begin anew."""
    each = [make_clip(path.with_name(f"{n}.ts"), images, format="mpegts") for n, images in enumerate(parts)]
    path.write_bytes(b"".join(part.read_bytes() for part in each))
    return path
