"""report.html in a real browser: its plots, words, layout and saved files; nothing outside it is loaded."""

import base64
import json
import re
import time
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.tracker.annotate.pages import CONTRASTS
from tests.tracker.report.reports import FPS, HIP, SECONDS, Report, chapter, compared, made, write_clip
from tests.tracker.strolls import stroll
from tracker.gait.figures import gait_of
from tracker.report import page
from tracker.report.chapter import headline, unusual
from tracker.report.page import write_report
from tracker.run.read import FILM
from tracker.tables.table import by_column, read_lines


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


@pytest.mark.parametrize("several", [False, True])
@pytest.mark.parametrize("width", [390, 1000, 1280, 1920])
def test_no_window_is_too_narrow(browser, tmp_path, several, width):
    path = compared(tmp_path) if several else made(tmp_path)
    Report(browser, path, width=width, dark=several, touch=width < 500)
    assert browser.value("document.documentElement.scrollWidth") <= width
    assert max(browser.each(".gait .wide", "one.scrollWidth - one.clientWidth")) <= 0
    assert min(ratio for _, ratio in browser.value(CONTRASTS)) >= 4.5


@pytest.mark.parametrize("width", [375, 1200, 1600])
def test_long_numbers_need_no_scroll_bar_and_stay_on_one_line_in_a_wide_window(browser, tmp_path, width):
    unsure, gait = stroll(SECONDS, sigma=0.25), gait_of(stroll(SECONDS, sigma=0.03, swings=(0.5, 0.3)))
    Report(browser, made(tmp_path, replace(unsure, q=unsure.q - 0.9), gait=gait), width=width)
    assert max(browser.each(".gait .wide", "one.scrollWidth - one.clientWidth")) <= 0
    tops = "new Set([...one.querySelectorAll('.value')].map((value) => value.offsetTop)).size"
    assert width < 1200 or set(browser.each(".plots .head", tops)) == {1}


@pytest.mark.parametrize("width", [390, 1100, 1280, 1920, 2560])
def test_the_film_has_half_of_a_wide_window_and_all_of_a_narrow_one(browser, tmp_path, width):
    Report(browser, made(tmp_path), width=width)
    (film, _, film_width, _), (told, _, told_width, _) = (browser.box(name) for name in (".clips", ".told"))
    if width < 1200:
        assert film_width > width - 45  # margins and a scroll bar
        assert film == pytest.approx(told, abs=1.0)
    else:
        assert film_width + 0.1 >= told_width > 0.4 * width
        assert told > film + film_width


def test_plots_and_tables_are_saved_as_pictures_and_numbers(browser, tmp_path):
    track = stroll(SECONDS)
    track = replace(track, times=track.times + 2.0)  # followed from a later frame on
    page, saved, film = made(tmp_path, track, video="walk" * 60), tmp_path / "saved", "walk" * 15
    browser.call("Page.setDownloadBehavior", behavior="allow", downloadPath=str(saved))
    Report(browser, page)
    browser.value("document.querySelectorAll('.save button').forEach((button) => button.click())")
    kinds = {"angles": ("csv", "svg", "png"), "strides": ("csv", "svg", "png"), "gait": ("csv",)}
    names = {f"{film} {what}-walk-run.{kind}" for what, some in kinds.items() for kind in some}
    end = time.monotonic() + 20.0
    while not (saved.exists() and {path.name for path in saved.iterdir()} >= names):
        assert time.monotonic() < end
        time.sleep(0.02)

    (head, *rows) = read_lines(saved / f"{film} angles-walk-run.csv")
    angles = [by_column(head[1], cells) for _, cells in rows]
    assert [float(row["time_s"]) for row in angles] == pytest.approx(track.times, abs=1e-3)
    found = np.array([float(row["hip_near_deg"]) for row in angles])
    assert found == pytest.approx(np.degrees(track.q[:, HIP]), abs=0.051)
    (head, *rows) = read_lines(saved / f"{film} gait-walk-run.csv")
    figures = {cells[0]: by_column(head[1], cells) for _, cells in rows}
    assert float(figures["stride time"]["near leg"]) == pytest.approx(1.1, abs=0.02)
    assert [figures[name]["unit"] for name in ("stride time", "hip range")] == ["s", "deg"]
    assert figures["cadence"]["near leg"] == ""
    (head, *rows) = read_lines(saved / f"{film} strides-walk-run.csv")
    assert [int(cells[0]) for _, cells in rows] == list(range(101))
    assert {"hip_near_mean", "hip_near_1"} <= set(head[1])
    for what in ("angles", "strides"):
        picture = cv2.imread(str(saved / f"{film} {what}-walk-run.png"))
        assert min(picture.shape[:2]) > 200
        assert np.ptp(picture) > 100
        drawn = (saved / f"{film} {what}-walk-run.svg").read_text()
        assert drawn.count("<text") > 5
        assert {"Hip", "degrees"} <= set(re.findall(r"(Hip|degrees)<", drawn))
        assert "var(" not in drawn
        assert "\N{PLUS-MINUS SIGN}" not in drawn  # the numbers of the frame that happens to be shown


def test_angles_that_are_not_explained_are_in_degrees(browser, tmp_path):
    track = stroll(1.0)
    bare = replace(track.figure, panels=[replace(panel, reading="") for panel in track.figure.panels])
    Report(browser, made(tmp_path, replace(track, figure=bare)))
    assert set(browser.each(".reading", "one.innerText")) == {"degrees"}


def test_paper_tells_the_frame_of_its_picture_and_splits_no_axis(browser, tmp_path):
    Report(browser, made(tmp_path))
    browser.call("Emulation.setEmulatedMedia", media="print")
    assert browser.text(".controls").startswith("frame 0")
    assert set(browser.each(".axis, .strip", "getComputedStyle(one).breakInside")) == {"avoid"}


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
