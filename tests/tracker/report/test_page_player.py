"""Playing and seeking in report.html in a real browser: film, slider, cursor and numbers show one frame."""

import re
from dataclasses import replace

import numpy as np
import pytest

from tests.tracker.report import reports
from tests.tracker.report.reports import FPS, HIP, SECONDS, Report, chapter, compared, made, write_clip
from tests.tracker.strolls import stroll
from tracker.report import page
from tracker.report.page import write_report
from tracker.run.read import FILM


def test_the_slider_moves_clip_cursor_and_numbers_to_one_frame(browser, tmp_path):
    track = stroll(SECONDS)
    report = Report(browser, made(tmp_path, track))
    for frame in (0, 41, 17, len(track) - 1):
        report.go(frame)
        assert report.cursor() == pytest.approx(frame / (len(track) - 1), abs=0.005)
        degrees = np.degrees(track.q[frame, HIP])
        near = report.values(0)[0].replace("\u2212", "-")
        assert near == f"near {degrees:.1f}\u00b0 \u00b1 {2.0 * np.degrees(track.sigma(HIP)[frame]):.1f}"


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


def test_from_its_end_the_clip_plays_again_from_the_start_and_goes_where_the_slider_is_put(browser, tmp_path):
    report = Report(browser, made(tmp_path))
    last = round(SECONDS * FPS) - 1
    report.go(last)
    browser.push("#play")
    browser.wait(f"Number(document.querySelector('#frame').value) < {last - 10}")
    report.go(41)


def test_a_click_in_a_plot_goes_there(browser, tmp_path):
    report = Report(browser, made(tmp_path))
    left, top, width, height = browser.box(".panel .chart", 1)
    last = round(SECONDS * FPS) - 1
    for frame in (44, 7):
        browser.click(left + 1 + (width - 1) * frame / last, top + height / 2)
        report.shows(frame)


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
    titles = {"Errors", "Error against time, in leg lengths", "Where they part", "Joint angles", "Gait"}
    assert titles <= set(browser.each("h2", "one.innerText"))
    assert "cv, lost at frame 2" in browser.text("#errors .legend")
    browser.press(" ")
    browser.wait("Number(document.querySelector('#frame').value) > 40")
    browser.press(" ")
    report.shows(int(browser.value("document.querySelector('#frame').value")))


def test_the_cursor_is_where_another_model_s_part_of_the_curves_has_it(browser, tmp_path, monkeypatch):
    monkeypatch.setattr(reports, "SECONDS", 20.0)
    report = Report(browser, compared(tmp_path))
    report.slide(300)
    report.span(3)
    report.slide(320)
    assert report.cursor() > 0.6
    browser.push("[data-tab='1']")
    assert report.cursor() == pytest.approx(0.5, abs=0.01)


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


def test_long_clips_are_seen_a_few_seconds_at_a_time(browser, tmp_path):
    track = stroll(20.0)
    path = tmp_path / "report.html"
    write_report(path, chapter(track), write_clip(tmp_path / FILM, track.times[:60]))
    report = Report(browser, path)
    report.slide(300)
    report.span(3)
    assert report.cursor() == pytest.approx(0.5, abs=0.01)
    width = browser.value("document.querySelector('.panel svg').viewBox.baseVal.width")
    assert width == pytest.approx(3.0)
    report.slide(500)
    assert 0.0 <= report.cursor() <= 1.0


def test_the_page_opens_at_the_frame_that_was_followed_from(browser, tmp_path):
    run = replace(chapter(stroll(SECONDS)).run, start=25)
    Report(browser, made(tmp_path, run=run)).shows(25)
    assert chapter(run=replace(run, track=replace(run.track, first=10))).drawn()["start"] == 15


def test_a_clip_of_one_frame_is_a_page_too_without_words_and_plots_of_strides(browser, tmp_path):
    track = stroll(1.0 / FPS)
    report = Report(browser, made(tmp_path, track))
    report.shows(0)
    browser.press("ArrowRight")
    report.shows(0)
    assert "No gait figures" in browser.text("article")
    assert browser.each(".headline, .unusual, .cycles", "one.innerText") == []
