"""A run put right on its page in a real browser, and followed again."""

import json
import threading
from contextlib import contextmanager

import numpy as np
import pytest

from kinematics.recover import PoseError
from kinematics.sides import other_side
from tests.tracker.annotate.clients import running
from tests.tracker.annotate.exchanged_run import TURN, exchanged
from tests.tracker.annotate.pages import Page, near, served
from tests.tracker.clips import QUIET, read_json
from tracker.annotate import correction
from tracker.annotate.correction import Correction
from tracker.tables.keypoints import points, read_keypoints


@contextmanager
def correcting(browser, folder, frame=None, **window):
    """The page of a run."""
    session, closed = Correction(folder, frame, QUIET), threading.Event()

    def work():
        while not closed.is_set():
            session.work(0.02)

    threading.Thread(target=work, daemon=True).start()
    try:
        with served(browser, session, **window) as page:
            yield page
    finally:
        closed.set()


def follow_on(browser):
    """Until the figure was followed again and the page has opened anew."""
    browser.value("window.before = true")
    browser.push("#follow")
    browser.wait("!window.before && document.readyState === 'complete'")
    browser.wait("document.querySelector('#saved').textContent.includes('ollowed')")
    return browser.text("#saved")


@pytest.mark.whole
def test_legs_that_were_exchanged_are_put_right_from_the_frame_where_it_is_seen(browser, scene, run):
    before = exchanged(scene, run)
    assert (before[:TURN].any(), before[TURN:].all()) == (False, True)
    with running(run, "--frame", TURN, "--quiet", command="correct") as (process, client):
        shown = Page(browser, client.address)
        shown.turn_to(TURN)
        tracked = shown.points()
        browser.push("#legs")
        assert {other_side(name): place for name, place in shown.points().items()} == tracked
        shown.turn_to(TURN + 10, ">")
        assert "as it was followed" in browser.text("#guide")
        assert near(shown.points()["near_ankle"], scene.joints["near_ankle"][TURN + 10], 6.0)
        shown.turn_to(TURN, "<")
        assert "choose Follow on" in browser.text("#guide")
        assert "Followed again through 2 frames" in follow_on(browser)
        assert "slide to where" in browser.text("#guide")
        assert browser.text("#marked").split()[-2:] == ["0", str(TURN)]
        browser.push("#close")
        browser.wait("document.querySelector('.over')")
        out, errors = process.communicate(timeout=120)
    assert (process.returncode, errors) == (0, "")
    assert (
        out.splitlines()[-1]
        == f"Followed again through 2 frames; {run} is replaced; open {run / 'report.html'}"
    )
    assert out.count("Followed") == 1
    assert not exchanged(scene, run).any()
    assert read_json(run / "run.json")["start"] == {"frame": 0, "marks": "given", "near_leg": "given"}
    assert not (run / "overlay.mp4").exists()  # as before
    assert {path.name for path in run.parent.iterdir()} == {"run"}


def test_a_dragged_joint_corrects_its_frame_and_stays_corrected(browser, scene, run):
    with correcting(browser, run, 5) as shown:
        shown.turn_to(5)
        tracked = shown.points()
        place = (tracked["near_ankle"][0] + 5.0, tracked["near_ankle"][1])
        shown.drag(tracked["near_ankle"], place)
        browser.push("button[data-joint=far_toe]")
        browser.push("#hidden")
        shown.save()
        marks = read_keypoints(run / "corrected.keypoints.csv")[5]
        assert near((marks["near_ankle"].x, marks["near_ankle"].y), place)
        assert [name for name, mark in marks.items() if not mark.visible] == ["far_toe"]
        follow_on(browser)
        assert read_keypoints(run / "start.keypoints.csv").keys() == {0, 5}
        assert not (run / "corrected.keypoints.csv").exists()
        shown.turn_to(5)
        assert near(shown.points()["near_ankle"], place)
    found = points(read_keypoints(run / "keypoints.csv")[5])
    # The frames around it, which were not corrected, pull it back, but by less than half of the way.
    assert near(found["near_ankle"], place, 2.5)


def test_closed_in_the_app_a_correction_names_the_buttons_that_follow_it(browser, run, monkeypatch):
    monkeypatch.setenv("FIGTRACK_APP", "1")
    with correcting(browser, run, 5) as page:
        page.press("Enter")
        browser.push("#close")
        browser.wait("document.querySelector('.over')")
        assert "Next, on the card of the film:\n\nCorrect, then Follow on" in browser.text(".over")
        assert page.server.session.ending().endswith("not followed yet; next: Correct, then Follow on")


def test_the_legs_of_all_frames_are_exchanged_undone_and_done_again_together(browser, run):
    def turned(key, frame):
        shown.turn_to(frame, key)
        return shown.points()

    def exchanged(places):
        return {other_side(name): place for name, place in places.items()}

    with correcting(browser, run) as shown:
        start, corrected = shown.points(), turned(".", 1)
        shown.press("Enter")  # kept as it was followed: a frame that the track is to pass through
        browser.push("#all")
        assert shown.points() == exchanged(corrected)
        browser.push("#undo")
        assert shown.points() == corrected
        assert turned(",", 0) == start
        assert turned(".", 1) == corrected
        browser.push("#redo")
        assert shown.points() == exchanged(corrected)
        assert turned(",", 0) == exchanged(start)
        browser.push("#undo")
        assert turned(".", 1) == corrected
        browser.push("#redo")
        (x, y) = shown.points()["hip"]
        shown.drag((x, y), (x + 8, y + 4))
        assert turned(",", 0) == exchanged(start)
        browser.push("#undo")
        assert "Frame 1 was changed after the legs of all frames" in browser.text("#saved")
        assert shown.points() == exchanged(start)
        turned(".", 1)
        browser.push("#undo")
        browser.push("#undo")
        assert shown.points() == corrected
        shown.drag((x, y), (x + 8, y + 4))
        assert turned(",", 0) == start
        assert browser.value("document.querySelector('#redo').disabled")


def test_the_start_stays_marked_and_other_frames_need_not(browser, run):
    with correcting(browser, run) as shown:
        assert browser.value("document.querySelector('#clear').disabled")
        shown.turn_to(1, ".")
        tracked = shown.points()
        shown.press("Enter")
        assert "corrected" in browser.text("#guide")
        browser.push("#clear")
        assert "as it was followed" in browser.text("#guide")
        assert shown.points() == tracked


def test_what_looks_wrong_is_followed_only_when_told_so(browser, run):
    with correcting(browser, run, 3) as shown:
        shown.turn_to(3)
        tracked = shown.points()
        shown.drag(tracked["near_knee"], (20.0, 20.0))
        shown.advice("times as far")  # which moves the button
        browser.push("#follow")
        browser.wait("document.querySelector('#doubt').open")
        assert "frame 3:" in browser.text("#doubts")
        browser.push("#stay")
        assert not browser.value("document.querySelector('#following').open")


@pytest.mark.parametrize(("width", "dark"), [(390, True), (1280, False)])
def test_the_page_of_an_unsure_run_says_so_fits_its_window_and_can_be_read(browser, run, width, dark):
    news = read_json(run / "run.json")
    news["start"]["near_leg"] = "unsure"
    (run / "run.json").write_text(json.dumps(news))
    with correcting(browser, run, width=width, height=800, dark=dark, touch=width < 500) as shown:
        assert "not sure which leg" in browser.text("#unsure")
        shown.can_be_read(width)
        assert browser.value(COVERED) == 0


# Joints over which a button lies.
COVERED = """[...document.querySelectorAll('#points circle')].map((circle) => circle.getBoundingClientRect())
  .filter((b) => document.elementFromPoint(b.x + b.width / 2, b.y + b.height / 2).closest('button')).length"""


def test_where_the_figure_was_lost_the_forecast_is_carried_by_its_hip_and_counts_as_seen(browser, run):
    with np.load(run / "track.npz") as stored:
        arrays = dict(stored)
    arrays["outcome"] = arrays["outcome"].astype("U7")
    arrays["outcome"][8:11], arrays["outcome"][20:] = "lost", "outside"
    np.savez_compressed(run / "track.npz", **arrays)
    with correcting(browser, run, 9) as shown:
        assert "The figure was lost here" in browser.text("#guide")
        assert browser.value("document.querySelectorAll('#strip .lost, #strip .outside').length") == 2
        before = shown.points()
        assert browser.value("document.querySelectorAll('#points .unseen').length") == len(before)
        x, y = before["hip"]
        shown.drag((x, y), (x + 8, y + 4))
        assert all(near(place, np.add(before[name], (8, 4)), 0.02) for name, place in shown.points().items())
        assert browser.value("document.querySelectorAll('#points .unseen').length") == 0
        shown.turn_to(7, ",", ",")
        assert "as it was followed" in browser.text("#guide")


def test_a_joint_without_which_the_run_began_is_not_asked_for(browser, run):
    start = run / "start.keypoints.csv"
    start.write_text("".join(line for line in start.read_text().splitlines(True) if "far_toe" not in line))
    with correcting(browser, run):
        assert browser.text("#guide").startswith("The run starts from this frame.")


def test_another_facing_is_kept_only_where_the_figure_is_followed_on_and_that_is_said(browser, run):
    with correcting(browser, run) as page:
        browser.push("#left")
        page.save()
        assert browser.value("document.title").startswith("*")
        browser.push("#close")
        browser.wait("document.querySelector('#doubt').open")
        assert "Faces is kept only where the figure is followed on" in browser.text("#doubts")
        browser.push("#stay")
        browser.push("#right")
        page.save()
        assert page.server.session.facing == 1
        assert browser.value("document.querySelector('#follow').disabled")


def test_another_facing_can_be_followed_once_more_where_that_failed(browser, run, monkeypatch):
    def fails(*_):
        raise PoseError("nothing to follow")

    monkeypatch.setattr(correction, "follow", fails)
    with correcting(browser, run):
        browser.push("#left")
        browser.value("window.before = true")
        browser.push("#follow")
        browser.wait("document.querySelector('#doubt').open")
        browser.push("#leave")
        browser.wait("!window.before && document.readyState === 'complete'")
        browser.wait("document.querySelector('#saved').textContent.includes('Could not be followed')")
        assert browser.value("document.querySelector('#left').ariaPressed") == "true"
        assert not browser.value("document.querySelector('#follow').disabled")
        browser.push("#right")
        assert browser.value("document.querySelector('#follow').disabled")
