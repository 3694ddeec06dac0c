"""report.html in a real browser: clips, slider, plots and keys at one frame, and a silent console."""

import base64
import json
import re
import sys
import time
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.kinematics.figures import WALKER
from tests.tracker.report.test_chapter import chapter
from tests.tracker.report.test_html_tables import SCORE
from tests.tracker.strolls import stroll
from tests.videos.clips import make_clip, set_display_matrix
from tests.videos.test_playable import begin_later
from tracker.report import page
from tracker.report.chapter import headline, unusual
from tracker.report.page import write_comparison, write_report
from tracker.run.read import FILM
from tracker.tables.table import by_column, read_lines
from videos.frames import Video
from videos.overlay import NEAR, TRUNK
from videos.playable import Playable, copied
from videos.writer import Writer

FPS, SECONDS, SIZE = 30.0, 2.0, (320, 240)
STEP = 4  # grey levels from one frame of a clip to the next
HIP = WALKER.index("hip_near")

# What the first clip shows: its middle pixel, red.
SHOWN = """(() => {{
  const clip = document.querySelectorAll('video')[{clip}];
  const canvas = document.createElement('canvas');
  canvas.width = clip.videoWidth;
  canvas.height = clip.videoHeight;
  const context = canvas.getContext('2d', {{ willReadFrequently: true }});
  context.drawImage(clip, 0, 0);
  return clip.seeking ? -1 : context.getImageData(canvas.width / 2, canvas.height / 2, 1, 1).data[0];
}})()"""


def write_clip(path, times, start=0.0):
    """A clip whose frames tell their number by how bright they are, the first of them shown at `start`."""
    with Writer(path, FPS, SIZE, crf=10) as writer:
        for early in np.arange(0.0, start - 1e-6, 1.0 / FPS):
            writer.write(np.full((SIZE[1], SIZE[0], 3), 255, np.uint8), float(early))
        for t, time in enumerate(times):
            writer.write(np.full((SIZE[1], SIZE[0], 3), STEP * t, np.uint8), float(start + time))
    return Playable(path, start, SIZE)


class Report:
    """A report that is open in the browser, and what a person does with it."""

    def __init__(self, browser, path, **window):
        self.browser = browser
        browser.open(path.as_uri(), **window)
        browser.wait("[...document.querySelectorAll('video')].every(clip => clip.readyState >= 2)")

    def shows(self, frame, first=0):
        """Until every clip, the figure on it, the slider, the cursor and the words are at this frame."""
        for clip in range(self.browser.value("document.querySelectorAll('video').length")):
            self.browser.wait(f"Math.abs({SHOWN.format(clip=clip)} - {STEP * (first + frame)}) < {STEP / 2}")
            self.browser.wait(f"document.querySelectorAll('.screen svg')[{clip}].dataset.frame === '{frame}'")
        self.browser.wait(f"document.querySelector('#frame').value === '{frame}'")
        self.browser.wait(f"document.querySelector('#where').innerText.startsWith('frame {first + frame} ')")

    def cursor(self):
        """Where the cursor is, as a share of a chart's width."""
        return self.browser.value(
            "(() => {const box = document.querySelector('.panel .chart').getBoundingClientRect();"
            "const line = document.querySelector('.panel .cursor').getBoundingClientRect();"
            "return (line.x - box.x - 1) / (box.width - 1)})()"
        )

    def slide(self, frame):
        self.browser.value(
            "(() => {const slider = document.querySelector('#frame');"
            f"slider.value = {frame}; slider.dispatchEvent(new Event('input'))}})()"
        )

    def go(self, frame, first=0):
        self.slide(frame)
        self.shows(frame, first)

    def values(self, panel):
        return self.browser.value(
            f"[...document.querySelectorAll('article:not([hidden]) .panel')[{panel}]"
            ".querySelectorAll('.value')].map(value => value.textContent)"
        )


def made(folder, track=None, start=0.0, **changes):
    """A run's page beside its film, which shows the first frame at `start`."""
    track = stroll(SECONDS) if track is None else track
    path = folder / "report.html"
    write_report(path, chapter(track, **changes), write_clip(folder / FILM, track.times, start))
    return path


def compared(folder, names=("walk-run", "cv"), **changes):
    """A comparison's page beside its film."""
    tracks = [stroll(SECONDS, swings=(swing, swing)) for swing in (0.5, 0.3)]
    chapters = [chapter(track, name=name, **changes) for name, track in zip(names, tracks, strict=True)]
    film = write_clip(folder / FILM, tracks[0].times[:60])
    sheet = folder / "failure.png"
    sheet.write_bytes(
        bytes.fromhex(
            "89504e470d0a1a0a0000000d49484452000000010000000108060000001f15c489"
            "0000000d49444154789c6360606060000000050001a5f645400000000049454e44ae426082"
        )
    )
    lost = replace(SCORE, first_failure_frame=2)
    path = folder / "report.html"
    write_comparison(
        path, "walk.mp4", film, chapters, dict(zip(names, (SCORE, lost), strict=True)), sheet, ["A note."]
    )
    return path


def test_the_slider_moves_clip_cursor_and_numbers_to_one_frame(browser, tmp_path):
    track = stroll(SECONDS)
    report = Report(browser, made(tmp_path, track))
    for frame in (0, 41, 17, len(track) - 1):
        report.go(frame)
        assert report.cursor() == pytest.approx(frame / (len(track) - 1), abs=0.005)
        degrees = np.degrees(track.q[frame, HIP])
        near = report.values(0)[0].replace("\u2212", "-")
        assert near == f"near {degrees:.1f}\u00b0 \u00b1 {2.0 * np.degrees(0.002):.1f}"


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


def test_frames_of_uneven_length_are_found_one_by_one(browser, tmp_path):
    track = stroll(1.0)
    track = replace(track, times=np.cumsum(np.tile([0.02, 0.05, 0.03], 10)) - 0.02)
    report = Report(browser, made(tmp_path, track))
    for frame in (1, 2, 3, 29):
        report.go(frame)
        assert report.cursor() == pytest.approx(track.times[frame] / track.times[-1], abs=0.005)


def test_keys_step_frames_and_stop_at_the_ends(browser, tmp_path):
    report = Report(browser, made(tmp_path))
    last = round(SECONDS * FPS) - 1
    for key, held, frame in (
        ("ArrowRight", (), 1), ("ArrowRight", ("Shift",), 11), ("ArrowLeft", (), 10), ("End", (), last),
        ("ArrowRight", (), last), ("Home", (), 0), ("ArrowLeft", (), 0),
    ):  # fmt: skip
        browser.press(key, *held)
        report.shows(frame)


def test_space_plays_and_pauses_at_a_whole_frame(browser, tmp_path):
    report = Report(browser, made(tmp_path))
    browser.press(" ")
    browser.wait("document.querySelector('#play').ariaLabel === 'Pause'")
    browser.wait("Number(document.querySelector('#frame').value) > 5")
    browser.press(" ")
    browser.wait("document.querySelector('#play').ariaLabel === 'Play'")
    frame = int(browser.value("document.querySelector('#frame').value"))
    assert 5 < frame < SECONDS * FPS - 1
    report.shows(frame)
    assert report.cursor() == pytest.approx(frame / (SECONDS * FPS - 1), abs=0.005)


def test_from_its_end_the_clip_plays_again_from_the_start(browser, tmp_path):
    report = Report(browser, made(tmp_path))
    last = round(SECONDS * FPS) - 1
    report.go(last)
    browser.push("#play")
    browser.wait(f"Number(document.querySelector('#frame').value) < {last - 10}")
    browser.push("#play")


def test_a_click_in_a_plot_goes_there(browser, tmp_path):
    report = Report(browser, made(tmp_path))
    left, top, width, height = box(browser, ".panel .chart", 1)
    last = round(SECONDS * FPS) - 1
    for frame in (44, 7):
        browser.click(left + 1 + (width - 1) * frame / last, top + height / 2)
        report.shows(frame)


def test_the_slider_goes_where_it_is_put_while_the_clip_plays(browser, tmp_path):
    report = Report(browser, made(tmp_path))
    browser.push("#play")
    browser.wait("Number(document.querySelector('#frame').value) > 2")
    report.go(41)


def test_motions_and_outcomes_stand_under_the_curves(browser, tmp_path):
    track = stroll(SECONDS)
    T = len(track)
    track = replace(
        track,
        motions=("walk",) * (T - 15) + ("run",) * 15,
        outcome=("ok",) * 30 + ("lost",) * 6 + ("ok",) * (T - 36),
    )
    report = Report(browser, made(tmp_path, track))
    widths = browser.each(".strip", "[...one.querySelectorAll('rect')].map(rect => rect.width.baseVal.value)")
    assert np.ravel(widths[0]) * FPS == pytest.approx([T - 15, 15], abs=0.01)
    assert np.ravel(widths[1]) * FPS == pytest.approx([30, 6, T - 36], abs=0.01)
    legends = browser.each(".legend", "one.innerText")
    assert "walk" in legends[0]
    assert "run" in legends[0]
    assert "lost: nothing matched" in legends[1]
    shaded = browser.each(".plots .panel", "one.querySelectorAll('rect.unsure').length")
    assert shaded == [1] * len(shaded)
    report.go(33)
    assert report.values(0) == ["near not seen", "far not seen"]


def test_below_two_sentences_angles_over_the_stride_have_a_line_a_stride_and_a_band_a_leg(browser, tmp_path):
    track = stroll(6.0)
    told = chapter(track, warnings=["<i>odd</i>"])
    write_report(tmp_path / "report.html", told, write_clip(tmp_path / FILM, track.times[:10]))
    report = Report(browser, tmp_path / "report.html")
    lines = browser.each(".gait > p", "one.innerText")
    assert lines[:2] == [headline(told), unusual(told)]
    strides = sum(len(of_side.sound) for of_side in told.gait.strides.values())
    for kind, count in (("thin", strides), ("curve", 2), ("band", 2), ("norm", 1)):
        found = browser.each(".cycles .panel", f"one.querySelectorAll('path.{kind}').length")
        assert found == [count] * 3
    assert browser.each(".cycles path.curve", "one.getBBox().width") == pytest.approx([100.0] * 6)
    report.go(7)
    browser.push(".cycles .chart")
    report.shows(7)


def test_without_strides_there_are_no_plots_of_them(browser, tmp_path):
    Report(browser, made(tmp_path, stroll(0.9)))
    assert browser.value("document.querySelectorAll('.headline, .unusual').length") == 0
    assert browser.value("document.querySelectorAll('.cycles').length") == 0


def test_several_models_move_together_on_one_source_and_each_has_its_name_and_numbers(browser, tmp_path):
    report = Report(browser, compared(tmp_path))
    assert browser.each("figcaption", "one.innerText") == ["walk-run", "cv"]
    sources = browser.each("video", "one.src")
    assert len(set(sources)) == 1
    assert sources[0].startswith("blob:")
    report.go(33)
    first = report.values(0)
    browser.push("[data-tab='1']")
    assert report.values(0) != first
    titles = {"Errors", "Error against time", "Where they part", "Joint angles", "Gait"}
    assert titles <= set(browser.each("h2", "one.innerText"))
    assert "cv, lost at frame 2" in browser.text("#errors .legend")
    browser.press(" ")
    browser.wait("Number(document.querySelector('#frame').value) > 40")
    browser.press(" ")
    report.shows(int(browser.value("document.querySelector('#frame').value")))


def test_the_cursor_is_where_another_model_s_part_of_the_curves_has_it(browser, tmp_path, monkeypatch):
    monkeypatch.setattr(sys.modules[__name__], "SECONDS", 20.0)
    report = Report(browser, compared(tmp_path))
    report.slide(300)
    browser.value(
        "(() => {const choice = document.querySelector('.spans select'); choice.value = '3';"
        "choice.dispatchEvent(new Event('change'))})()"
    )
    report.slide(320)
    assert report.cursor() > 0.6
    browser.push("[data-tab='1']")
    assert report.cursor() == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize("several", [False, True])
@pytest.mark.parametrize("width", [390, 1000, 1280, 1920])
def test_no_window_is_too_narrow(browser, tmp_path, several, width):
    path = compared(tmp_path) if several else made(tmp_path)
    Report(browser, path, width=width, dark=several, touch=width < 500)
    assert browser.value("document.documentElement.scrollWidth") <= width
    assert max(browser.each(".gait .wide", "one.scrollWidth - one.clientWidth")) <= 0


@pytest.mark.parametrize("width", [390, 1100, 1280, 1920, 2560])
def test_the_film_has_half_of_a_wide_window_and_all_of_a_narrow_one(browser, tmp_path, width):
    Report(browser, made(tmp_path), width=width)
    (film, _, film_width, _), (told, _, told_width, _) = (box(browser, name) for name in (".clips", ".told"))
    if width < 1200:
        assert film_width > width - 45  # margins and a scroll bar
        assert film == pytest.approx(told, abs=1.0)
    else:
        assert film_width + 0.1 >= told_width > 0.4 * width
        assert told > film + film_width


def test_the_film_fills_the_screen_and_goes_back_with_its_slider(browser, tmp_path):
    report = Report(browser, made(tmp_path))
    browser.push("#full")
    browser.wait("document.fullscreenElement?.matches('.player')")
    browser.press("ArrowRight")
    report.shows(1)
    assert browser.value("document.querySelector('#frame').checkVisibility()")
    browser.push("#full")
    browser.wait("document.fullscreenElement === null")


def test_large_clips_are_linked_and_play(browser, tmp_path, monkeypatch):
    monkeypatch.setattr(page, "LARGEST", 100)
    (folder := tmp_path / "späte Läufe #1? 50%25").mkdir()
    path = compared(folder)
    assert re.search(r'id="film" type="text/plain"></script>', path.read_text(encoding="utf-8"))
    report = Report(browser, path)
    report.slide(20)
    for i in range(2):
        clip = f"document.querySelectorAll('video')[{i}]"
        browser.wait(f"!{clip}.seeking && Math.abs({clip}.currentTime * {FPS} - 20.5) < 0.1")
    browser.push("#play")
    browser.wait("Number(document.querySelector('#frame').value) > 25")
    browser.push("#play")


def test_plots_and_tables_are_saved_as_pictures_and_numbers(browser, tmp_path):
    track = stroll(SECONDS)
    track = replace(track, times=track.times + 2.0)  # followed from a later frame on
    page, saved = made(tmp_path, track), tmp_path / "saved"
    browser.call("Page.setDownloadBehavior", behavior="allow", downloadPath=str(saved))
    Report(browser, page)
    browser.value("document.querySelectorAll('.save button').forEach((button) => button.click())")
    files = {f"{what}-walk-run.{kind}" for what in ("angles", "strides") for kind in ("csv", "svg", "png")}
    files.add("gait-walk-run.csv")
    end = time.monotonic() + 20.0
    while not (saved.exists() and {path.name for path in saved.iterdir()} >= files):
        assert time.monotonic() < end
        time.sleep(0.02)

    (head, *rows) = read_lines(saved / "angles-walk-run.csv")
    angles = [by_column(head[1], cells) for _, cells in rows]
    assert [float(row["time_s"]) for row in angles] == pytest.approx(track.times, abs=1e-3)
    found = np.array([float(row["hip_near_deg"]) for row in angles])
    assert found == pytest.approx(np.degrees(track.q[:, HIP]), abs=0.051)
    (head, *rows) = read_lines(saved / "gait-walk-run.csv")
    figures = {cells[0]: by_column(head[1], cells) for _, cells in rows}
    assert float(figures["stride time"]["near leg"]) == pytest.approx(1.1, abs=0.02)
    assert figures["stride time"]["unit"] == "s"
    assert figures["cadence"]["near leg"] == ""
    (head, *rows) = read_lines(saved / "strides-walk-run.csv")
    assert [int(cells[0]) for _, cells in rows] == list(range(101))
    assert {"hip_near_mean", "hip_near_1"} <= set(head[1])
    for what in ("angles", "strides"):
        picture = cv2.imread(str(saved / f"{what}-walk-run.png"))
        assert min(picture.shape[:2]) > 200
        assert np.ptp(picture) > 100
        drawn = (saved / f"{what}-walk-run.svg").read_text()
        assert drawn.count("<text") > 5
        assert "Hip" in drawn
        assert "var(" not in drawn


def test_long_clips_are_seen_a_few_seconds_at_a_time(browser, tmp_path):
    track = stroll(20.0)
    path = tmp_path / "report.html"
    write_report(path, chapter(track), write_clip(tmp_path / FILM, track.times[:60]))
    report = Report(browser, path)
    report.slide(300)
    browser.value(
        "(() => {const choice = document.querySelector('.spans select'); choice.value = '3';"
        "choice.dispatchEvent(new Event('change'))})()"
    )
    assert report.cursor() == pytest.approx(0.5, abs=0.01)
    width = browser.value("document.querySelector('.panel svg').viewBox.baseVal.width")
    assert width == pytest.approx(3.0)
    report.slide(500)
    assert 0.0 <= report.cursor() <= 1.0


def test_the_page_opens_at_the_frame_that_was_followed_from(browser, tmp_path):
    run = replace(chapter(stroll(SECONDS)).run, start=25)
    Report(browser, made(tmp_path, run=run)).shows(25)
    assert chapter(run=replace(run, track=replace(run.track, first=10))).drawn()["start"] == 15


def test_a_clip_of_one_frame_is_a_page_too(browser, tmp_path):
    track = stroll(1.0 / FPS)
    report = Report(browser, made(tmp_path, track))
    report.shows(0)
    browser.press("ArrowRight")
    report.shows(0)
    assert "No gait figures" in browser.text("article")


# Where a joint is on the screen, by the page's own numbers: CSS pixels of the window.
PLACE = """((point, frame) => {{
  const svg = document.querySelectorAll('.screen svg')[{clip}];
  const opening = JSON.parse(document.querySelector('#data').textContent);
  const [x, y] = opening.chapters[{clip}].figure.points[frame].slice(2 * point).map((tenths) => tenths / 10);
  const place = new DOMPoint(x, y).matrixTransform(svg.getScreenCTM());
  return [place.x, place.y];
}})({point}, {frame})"""


def box(browser, selector, i=0):
    """Left, top, width and height of an element, pixels of the window."""
    return browser.value(
        f"(() => {{const b = document.querySelectorAll('{selector}')[{i}].getBoundingClientRect();"
        "return [b.x, b.y, b.width, b.height]})()"
    )


def seen(browser, folder):
    """The first film and what is on it, as it is on the screen, (H, W, 3) RGB."""
    browser.picture(folder / "seen.png")
    left, top, width, height = np.rint(box(browser, ".screen")).astype(int)
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
    left, top, width, _ = box(browser, ".screen")
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
            left, top, width, height = box(browser, ".screen", clip)
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
    browser.press(" ")
    browser.wait("Number(document.querySelector('#frame').value) > 45")
    browser.press(" ")
    pairs = np.array(browser.value("pairs"))
    assert len(np.unique(pairs[:, 1])) > 15
    assert np.abs(pairs[:, 0] - pairs[:, 1])[pairs[:, 0] >= 0].max() <= 1.0 + 2.0 / STEP


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
    browser.press(" ")
    browser.wait("document.querySelector('#play').ariaLabel === 'Play'")
    report.shows(len(frames) - 1, first)


def test_frames_before_and_after_those_followed_have_no_figure(browser, tmp_path):
    track = stroll(SECONDS)
    path = tmp_path / "report.html"
    film = write_clip(tmp_path / FILM, track.times, start=0.4)
    part = {name: getattr(track, name)[:40] for name in ("times", "q", "cov", "s", "outcome", "shift")}
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


def test_names_and_warnings_are_no_html(browser, tmp_path):
    name = "</script><b>&\"'.mp4"
    Report(browser, made(tmp_path, video=name, name=name, warnings=["<i>nothing</i> matched"]))
    assert browser.text("h1") == Path(name).name
    assert browser.value("document.title") == Path(name).name
    assert browser.text(".warning") == "<i>nothing</i> matched"


def test_nothing_outside_is_asked_for(tmp_path):
    text = compared(tmp_path).read_text(encoding="utf-8")
    assert "://" not in text
    sources = re.findall(r"""(?:src|href|poster|url)\s*[=(]\s*["']?([^"'>\s]{0,30})""", text)
    assert len(sources) >= 2
    assert all(source.startswith(("data:", "source;")) for source in sources)  # the latter is the film within
    assert "default-src 'none'" in text


def test_the_clip_in_the_page_is_the_clip(tmp_path, monkeypatch):
    """In pieces that are no whole file."""
    monkeypatch.setattr(page, "BLOCK", 300)
    text = made(tmp_path).read_text(encoding="utf-8")
    (coded,) = re.findall(r'id="film" type="text/plain">([^<]*)</script>', text)
    assert base64.b64decode(coded, validate=True) == (tmp_path / FILM).read_bytes()
    data = re.search(r'id="data" type="application/json">(.*)</script>', text)
    assert json.loads(data[1])["errors"] is None
