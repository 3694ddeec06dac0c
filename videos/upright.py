"""Pictures as RGB and upright: those that a video's decoder gives, and those stored one by one."""

import io
import warnings
from typing import cast

import av
import numpy as np
from av.sidedata.sidedata import SideDataContainer
from av.video.frame import VideoFrame
from av.video.reformatter import VideoReformatter
from numpy.typing import NDArray

Image = NDArray[np.uint8]

PNG = b"\x89PNG\r\n\x1a\n"


def upright(picture: VideoFrame, rgb: VideoReformatter) -> Image:
    """The picture as RGB, turned or mirrored by the nearest right angle of its display matrix.

    `rgb` is shared: a frame that reformats itself would keep buffers larger than its pixels.
    """
    image = rgb.reformat(picture, format="rgb24", threads=1).to_ndarray()
    a, b, c, d = display_matrix(picture)
    sideways = abs(b) > abs(a)
    if sideways:
        image = image.swapaxes(0, 1)
    right, down = (c, b) if sideways else (a, d)
    image = image[:: -1 if down < 0 else 1, :: -1 if right < 0 else 1]
    return np.ascontiguousarray(image)


def display_matrix(picture: VideoFrame) -> tuple[int, int, int, int]:
    """(a, b, c, d) of how a picture is to be shown: a pixel goes to (a x + c y, b x + d y), in 65536ths."""
    try:
        # Side data taken from the frame refers back to it: frames would stay until garbage is collected.
        matrix = SideDataContainer(picture).get("DISPLAYMATRIX")  # type: ignore[call-arg]
    except ValueError:  # PyAV has no name for some kinds of side data, as a camera's notes in motion JPEG
        matrix = None
    if matrix is None:
        return 65536, 0, 0, 65536
    a, b, _, c, d = np.frombuffer(cast("bytes", matrix), np.int32, count=5).tolist()  # row by row, of 3 x 3
    return a, b, c, d


def decoded(stored: bytes) -> Image:
    """A stored picture as RGB, upright. OSError, ValueError, av.FFmpegError: no picture, a damaged one, or
    one far too large."""
    if stored.startswith(PNG):
        with av.open(io.BytesIO(stored), mode="r", format="png_pipe") as container:
            for picture in container.decode(video=0):
                return upright(picture, VideoReformatter())
    import PIL.Image  # imported here as few films are folders of pictures
    from PIL import ImageOps

    # OpenCV's library would print messages about a damaged picture, and PyAV blurs a JPEG's colours.
    try:
        with warnings.catch_warnings(action="ignore"), PIL.Image.open(io.BytesIO(stored)) as image:
            return np.asarray(ImageOps.exif_transpose(image).convert("RGB"))
    except PIL.Image.DecompressionBombError as error:
        raise ValueError("a picture far too large") from error
