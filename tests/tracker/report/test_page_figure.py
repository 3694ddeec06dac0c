"""The figure over the film of report.html in a real browser: its place, layers, and the frame it is of."""

import base64
from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.kinematics.figures import WALKER
from tests.tracker.report.reports import (
    FPS,
    SECONDS,
    SHOWN,
    SIZE,
    STEP,
    Report,
    chapter,
    compared,
    made,
    write_clip,
)
from tests.tracker.strolls import stroll
from tests.videos.clips import begin_later, make_clip, set_display_matrix
from tracker.report.page import write_report
from tracker.run.read import FILM
from videos.frames import Video
from videos.overlay import NEAR, TRUNK
from videos.playable import copied


def test_the_figure_goes_to_the_frame_that_is_asked_for_where_no_picture_is_announced(browser, tmp_path):
    without = "delete HTMLVideoElement.prototype.requestVideoFrameCallback"
    told = browser.call("Page.addScriptToEvaluateOnNewDocument", source=without)
    try:
        report = Report(browser, made(tmp_path, stroll(1.0)))
        report.go(7)
        browser.value(f"document.querySelector('video').currentTime += {5 / FPS}")  # not by the page itself
        browser.wait("document.querySelector('.screen svg').dataset.frame === '12'")
    finally:
        browser.call("Page.removeScriptToEvaluateOnNewDocument", **told)


# Where a joint is on the screen, by the page's own numbers: CSS pixels of the window.
PLACE = """((point, frame) => {{
  const svg = document.querySelectorAll('.screen svg')[{clip}];
  const opening = JSON.parse(document.querySelector('#data').textContent);
  const [x, y] = opening.chapters[{clip}].figure.points[frame].slice(2 * point).map((tenths) => tenths / 10);
  const place = new DOMPoint(x, y).matrixTransform(svg.getScreenCTM());
  return [place.x, place.y];
}})({point}, {frame})"""


def seen(browser, folder):
    """The first film and what is on it, as it is on the screen, (H, W, 3) RGB."""
    browser.picture(folder / "seen.png")
    left, top, width, height = np.rint(browser.box(".screen")).astype(int)
    image = cv2.cvtColor(cv2.imread(str(folder / "seen.png")), cv2.COLOR_BGR2RGB)
    return image[top : top + height, left : left + width].astype(int)


def count(image, colour):
    """How many pixels are of a colour."""
    return int((np.abs(image - colour).max(axis=-1) < 12).sum())


@pytest.mark.parametrize("frame", [0, 23, 59])
def test_the_figure_stands_where_the_track_has_it(browser, tmp_path, frame):
    track = stroll(SECONDS)
    report = Report(browser, made(tmp_path, track, start=0.4))
    report.go(frame)
    image = seen(browser, tmp_path)
    left, top, width, _ = browser.box(".screen")
    scale = width / SIZE[0]
    for start, end, colour in (("hip", "near_knee", NEAR), ("neck", "head_top", TRUNK)):
        places = [track.joints()[frame, WALKER.joints.index(name)] for name in (start, end)]
        x, y = (np.mean(places, axis=0) + 0.5) * scale
        assert_allclose(image[int(y), int(x)], colour, atol=12)
    # The page's own numbers say the same.
    knee = track.joints()[frame, WALKER.joints.index("near_knee")]
    point = PLACE.format(clip=0, point=WALKER.joints.index("near_knee"), frame=frame)
    assert browser.value(point) == pytest.approx((knee + 0.5) * scale + (left, top), abs=0.2)


def test_layers_are_switched_off_and_on(browser, tmp_path):
    track = stroll(SECONDS)
    wide = replace(track, cov=track.cov + np.diag([0.002] * 2 + [0.0] * (track.q.shape[1] - 2)))
    report = Report(browser, made(tmp_path, wide))
    report.go(30)
    both = count(seen(browser, tmp_path), NEAR)
    browser.push("[data-layer=ellipses]")
    limbs = count(seen(browser, tmp_path), NEAR)
    browser.push("[data-layer=limbs]")
    none = seen(browser, tmp_path)
    browser.push("[data-layer=ellipses]")
    ellipses = count(seen(browser, tmp_path), NEAR)
    assert both > limbs > 300
    assert both > ellipses > 100
    assert np.ptp(none[8:-8, 8:-8]) < 12  # nothing but the film
    assert browser.each("[data-layer]", "one.ariaPressed") == ["false", "true", "false"]
    browser.value("document.querySelector('[data-layer=limbs]').focus()")
    browser.press(" ")
    browser.wait("document.querySelector('[data-layer=limbs]').ariaPressed === 'true'")


@pytest.mark.parametrize("clips", [1, 2])
def test_from_near_the_hip_stays_in_the_middle(browser, tmp_path, clips):
    report = Report(browser, made(tmp_path) if clips == 1 else compared(tmp_path))
    browser.push("[data-layer=zoom]")
    for frame in (0, 20, 59):
        report.go(frame)
        for clip in range(clips):
            left, top, width, height = browser.box(".screen", clip)
            hip = np.array(browser.value(PLACE.format(clip=clip, point=0, frame=frame)))
            assert_allclose((hip - (left, top)) / (width, height), 0.5, atol=0.03)
            joints = [browser.value(PLACE.format(clip=clip, point=k, frame=frame)) for k in range(9)]
            assert_allclose((np.array(joints) - (left, top)) / (width, height), 0.5, atol=0.5)
            # The film is enlarged like the figure: its corner is where the figure's pixels begin.
            corner = browser.value(
                f"(() => {{const b = document.querySelectorAll('video')[{clip}].getBoundingClientRect();"
                f"const m = document.querySelectorAll('.screen svg')[{clip}].getScreenCTM();"
                "const c = new DOMPoint(-0.5, -0.5).matrixTransform(m); return [b.x - c.x, b.y - c.y]})()"
            )
            assert_allclose(corner, 0.0, atol=0.1)
    assert height < 2.0 * np.ptp(np.array(joints)[:, 1])
    browser.push("[data-layer=zoom]")
    assert browser.value("document.querySelector('video').style.transform") == ""


def test_while_it_plays_figure_and_film_are_at_one_frame(browser, tmp_path):
    report = Report(browser, made(tmp_path, start=0.4))
    report.shows(0)
    browser.value(
        "window.pairs = []; const look = () => {const shown = "
        + SHOWN.format(clip=0)
        + f" / {STEP}; pairs.push([shown, Number(document.querySelector('.screen svg').dataset.frame)]);"
        "if (pairs.length < 2000) requestAnimationFrame(look)}; requestAnimationFrame(look)"
    )
    browser.value("document.querySelector('video').playbackRate = 0.5")  # a busy machine skips pictures
    browser.press(" ")
    browser.wait("Number(document.querySelector('#frame').value) > 45")
    browser.press(" ")
    film, figure = np.array(browser.value("pairs")).T
    assert len(np.unique(figure)) > 15
    assert (np.abs(film - figure)[film >= 0] <= 1.0 + 2.0 / STEP).mean() > 0.8


@pytest.mark.parametrize(
    ("kind", "first"),
    [("mp4", 0), ("mp4", 17), ("matroska", 17), ("uneven", 17), ("edited", 0), ("edited", 9), ("turned", 0)],
)
def test_of_a_copied_film_every_frame_is_shown_with_its_figure(browser, tmp_path, kind, first):
    """With B frames, key frames 12 apart, and for "edited" a beginning between two of them."""
    count, cut = 32, 5 * (kind == "edited")
    levels = [255] * cut + [STEP * t for t in range(count - cut)]
    images = [np.full((48, 64, 3), level, np.uint8) for level in levels]
    uneven = np.cumsum(np.tile([20, 50, 33], count))[:count].tolist() if kind == "uneven" else None
    format = "matroska" if kind == "matroska" else "mp4"
    source = make_clip(tmp_path / "walk", images, ticks=uneven, format=format, key_every=12)
    if kind == "edited":
        begin_later(source, cut)
    if kind == "turned":
        set_display_matrix(source, (0, 1, -1, 0))
    frames = list(Video(source))[first:]
    times = np.array([frame.time for frame in frames]) - next(iter(Video(source))).time
    size = frames[0].image.shape[1::-1]
    film = copied(source, tmp_path / FILM, first, times, size)
    assert film is not None
    track = stroll(len(frames) / FPS)
    write_report(tmp_path / "report.html", chapter(replace(track, first=first, times=times)), film)
    report = Report(browser, tmp_path / "report.html")
    film_size = "(({videoWidth, videoHeight}) => [videoWidth, videoHeight])(document.querySelector('video'))"
    assert tuple(browser.value(film_size)) == size
    for frame in (0, 1, 11, len(frames) - 1, len(frames) - 4):
        report.go(frame, first)
        assert report.cursor() == pytest.approx(np.ptp(times[: frame + 1]) / np.ptp(times), abs=0.005)
    browser.press(" ")
    browser.wait("document.querySelector('#play').ariaLabel === 'Play'")
    report.shows(len(frames) - 1, first)


def test_frames_before_and_after_those_followed_have_no_figure(browser, tmp_path):
    track = stroll(SECONDS)
    path = tmp_path / "report.html"
    film = write_clip(tmp_path / FILM, track.times, start=0.4)
    part = {name: getattr(track, name)[:40] for name in ("times", "q", "cov", "s", "outcome", "moved")}
    write_report(path, chapter(replace(track, **part)), film)
    report = Report(browser, path)
    report.shows(0)
    figure = "document.querySelector('.screen svg').checkVisibility({visibilityProperty: true})"
    for seconds, visible in ((0.1, False), (0.41, True), (0.4 + 39.5 / FPS, True), (0.4 + 41.5 / FPS, False)):
        browser.value(f"document.querySelector('video').currentTime = {seconds}")
        browser.wait(f"{figure} === {str(visible).lower()}")
    report.go(35)
    browser.press(" ")
    browser.wait("document.querySelector('#play').ariaLabel === 'Play'")
    report.shows(39)


def test_what_is_not_seen_is_drawn_broken_and_told(browser, tmp_path):
    track = stroll(SECONDS)
    outcomes = ("ok",) * 10 + ("hidden",) * 10 + ("lost",) * 10 + ("found",) + ("ok",) * 29
    report = Report(browser, made(tmp_path, replace(track, outcome=outcomes)))
    dash = "getComputedStyle(document.querySelector('.limbs path:not(.rim)')).strokeDasharray"
    for frame, words, broken in (
        (3, "", False), (13, "a limb is not seen", True), (23, "lost: nothing matched", True),
        (30, "found again", False), (40, "", False),
    ):  # fmt: skip
        report.go(frame)
        assert browser.text("figcaption") == words
        assert (browser.value(dash) != "none") is broken
    report.slide(13)
    for layer in ("limbs", "ellipses"):
        browser.push(f"[data-layer={layer}]")
    assert not browser.value("document.querySelector('figcaption').checkVisibility()")  # the film alone


def test_a_film_that_was_not_in_sight_has_its_figure_once_it_is_chosen(browser, tmp_path):
    report = Report(browser, compared(tmp_path), width=390)
    for frame, tab in ((23, 1), (41, 0)):
        report.slide(frame)
        browser.push(f"[data-tab='{tab}']")
        report.shows(frame)


def test_a_film_that_cannot_be_played_leaves_the_figure(browser, tmp_path):
    path = made(tmp_path)
    film = base64.b64encode((tmp_path / FILM).read_bytes()).decode()
    path.write_text(path.read_text(encoding="utf-8").replace(film, film[:200]), encoding="utf-8")
    browser.open(path.as_uri())
    browser.wait("document.querySelector('video').error")
    browser.press("ArrowRight")
    browser.wait("document.querySelector('.screen svg').dataset.frame === '1'")
