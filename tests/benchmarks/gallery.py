"""Make the pictures of docs/gallery.md from rendered walks and the models that ship: `make gallery`.

    python -m tests.benchmarks.gallery docs/gallery

No other film, capture or network is needed. Pages are photographed in Debian's Chromium. Three minutes.
"""

import base64
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import chdir
from pathlib import Path

import cv2
import numpy as np

from tests.tracker.annotate.clients import running
from tests.tracker.browser import Browser, chromium
from tests.tracker.clips import read_csv, succeeds, write_table
from tracker.cli.demo import run_demo, write_scene
from tracker.progress import Progress
from tracker.scene.film import render
from videos.frames import Video

SEED, FRAMES, SIZE = 9, 165, (960, 360)
DEMO = 5  # the walk of `figtrack demo`
SHOWN = 66  # the frame that pages are photographed at
STRIP = (60, 66, 72, 78)  # frames of the overlay, half a stride
MOST_BYTES = 60_000
SCALES = tuple(share / 100 for share in range(100, 30, -10))
TRIES = {  # quality of a JPEG and scale; the first that is small enough is taken
    ".jpg": [(quality, scale) for scale in SCALES for quality in range(88, 50, -6)],
    ".png": [(0, scale) for scale in SCALES],
}
GAP = slice(45, 75)  # frames whose poses are taken out and filled

SEEK = """(() => {{ const slider = document.querySelector('input[type=range]');
  slider.value = {frame}; slider.dispatchEvent(new Event('input', {{bubbles: true}})); }})()"""
PAUSE = "new Promise(done => setTimeout(done, 1500))"  # until the film has moved to its frame
BOX = """(() => {{ const box = document.querySelector('{selector}').getBoundingClientRect();
  return [box.x + scrollX, box.y + scrollY, box.width + {edge}, box.height]; }})()"""
EDGE = 12  # margin on the right for the last number of an axis, pixels


def main() -> None:
    """Make every picture."""
    out = Path(sys.argv[1]).resolve()
    out.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        write_scene(render(SEED, frames=FRAMES, size=SIZE, shrubs=False), Path())
        for name, picture in pictures():
            write_small(picture, out / name)


def pictures() -> Iterator[tuple[str, np.ndarray]]:
    """Name and pixels (H, W, 3) BGR of every picture, made in the folder one is in."""
    succeeds("find", "walk.mp4")
    yield "find.jpg", cv2.imread("walk-people.png")
    succeeds("track", "walk.mp4", "--height", "1.75")
    yield "overlay.jpg", strip(Path("walk-track"))
    with tempfile.TemporaryDirectory() as profile, chromium(Path(profile)) as browser:
        yield from pages(browser)
    succeeds(
        "track", "walk.mp4", "--figure", "walker-arms", "--keypoints", "walk.keypoints.csv", "--out", "arms"
    )
    yield "arms.jpg", strip(Path("arms"))
    run_demo(Path("demo"), DEMO, overwrite=False, progress=Progress("quiet"))
    yield "compare.jpg", cv2.imread("demo/failure.png")
    yield "errors.png", cv2.imread("demo/errors.png")
    yield from motion()


def pages(browser: Browser) -> Iterator[tuple[str, np.ndarray]]:
    """The report of the run, its curves over the stride, and the marking page."""
    browser.open(Path("walk-track/report.html").resolve().as_uri(), width=840, height=800)
    browser.value(SEEK.format(frame=SHOWN))
    yield "report.jpg", photograph(browser, (0, 0, 840, 788))
    yield "stride.png", photograph(browser, browser.value(BOX.format(selector=".cycles", edge=EDGE)))
    shutil.copy("walk.mp4", "unmarked.mp4")
    with running("unmarked.mp4", cwd=os.getcwd()) as (_, client):
        browser.open(client.address, width=1100, height=640)
        browser.wait("document.querySelectorAll('#joints button').length === 9")
        yield "annotate.jpg", photograph(browser, (0, 0, 1100, 640))


def motion() -> Iterator[tuple[str, np.ndarray]]:
    """Poses without a film: made up, labelled, forecast, and filled."""
    succeeds("synthesise", "--frames", "150", "--seed", "2", "--no-clip", "--out", "made.csv")
    yield "synthesise.jpg", cv2.imread("made.png")
    succeeds("classify", "made.csv")
    yield "classify.png", cv2.imread("made-classify.png")
    succeeds("predict", "walk-track/pose.csv", "--horizon", "5", "--out", "ahead.csv")
    yield "predict.jpg", cv2.imread("ahead.png")
    rows = read_csv(Path("walk-track/pose.csv"))
    kept = rows[: GAP.start] + rows[GAP.stop :]
    write_table(Path("gap.csv"), [row.values() for row in kept], header=rows[0])
    succeeds("interpolate", "gap.csv", "--out", "filled.csv")
    yield "interpolate.jpg", cv2.imread("filled.png")


def strip(folder: Path) -> np.ndarray:
    """The figure in some frames of a run's overlay, side by side."""
    rows = read_csv(folder / "keypoints.csv")
    hips = {int(row["frame"]): float(row["x"]) for row in rows if row["keypoint"] == "hip"}
    images = {frame.index: frame.image for frame in Video(folder / "overlay.mp4")}
    crops = [images[t][90:, max(int(hips[t]) - 110, 0) :][:, :220, ::-1] for t in STRIP]
    return np.hstack(crops)


def photograph(browser: Browser, box: tuple[float, float, float, float]) -> np.ndarray:
    """A part of the page: left, top, width, height in pixels."""
    browser.value(PAUSE)
    clip = dict(zip(("x", "y", "width", "height"), box, strict=True), scale=1)
    data = browser.call("Page.captureScreenshot", format="png", clip=clip, captureBeyondViewport=True)["data"]
    return cv2.imdecode(np.frombuffer(base64.b64decode(data), np.uint8), cv2.IMREAD_COLOR)


def write_small(picture: np.ndarray, path: Path) -> None:
    """Write a picture of at most MOST_BYTES: the best JPEG, or the largest PNG.

    Raises:
        ValueError: it is larger all the same.
    """
    for quality, scale in TRIES[path.suffix]:
        small = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        options = [cv2.IMWRITE_JPEG_QUALITY, quality] if quality else [cv2.IMWRITE_PNG_COMPRESSION, 9]
        data = cv2.imencode(path.suffix, small, options)[1].tobytes()
        if len(data) <= MOST_BYTES:
            path.write_bytes(data)
            return
    raise ValueError(f"{path.name} takes {len(data)} bytes, more than {MOST_BYTES}; make the picture smaller")


if __name__ == "__main__":
    main()
