"""Other frames on the page in a real browser: keys, playing and the slider; every frame has its own marks."""

import time

import numpy as np
import pytest

from tests.tracker.annotate.pages import near, session_page
from tests.tracker.clips import write_table
from tracker.tables.keypoints import read_keypoints

WHOLE = "document.querySelector('#image').getAttribute('href').startsWith('data:image/png')"


def test_every_frame_has_marks_of_its_own(page, browser, table, truth):
    page.click(*truth["head_top"])
    browser.push("#ahead1")
    page.turn_to(1)
    page.press("1")
    page.click(50, 60)
    page.turn_to(2, ".")
    browser.value(
        "(f => {f.value = 7; f.dispatchEvent(new Event('change'))})(document.querySelector('#frame'))"
    )
    page.turn_to(7)
    page.press("1")
    page.click(70, 80)
    page.turn_to(5, ",", ",")
    browser.push("#marked button:first-of-type")
    page.turn_to(0)
    assert near(page.points()["head_top"], truth["head_top"])
    page.save()
    assert {t: list(marks) for t, marks in read_keypoints(table).items()} == {
        t: ["head_top"] for t in (0, 1, 7)
    }


@pytest.mark.parametrize("key", ["p", " "])
def test_the_film_is_played_and_where_it_stops_the_frame_comes_whole(page, browser, key):
    page.server.session._frames.fps = 2.0  # or it might end before it is stopped
    browser.open(page.address)
    page.press(key)
    browser.wait("Number(document.querySelector('#frame').value) > 0")
    assert browser.text("#play") == "Stop"
    page.press(key)
    assert browser.text("#play") == "Play"
    browser.wait(WHOLE)
    assert page.points() == {}
    stopped = browser.value("document.querySelector('#frame').value")
    assert browser.value("document.querySelector('#slider').value") == stopped
    page.turn_to(int(stopped))


def test_keys_that_change_marks_stop_the_film(page, browser):
    page.server.session._frames.fps = 0.01
    browser.open(page.address)
    for key in ("Enter", "ArrowUp", "h", "s", "x", "Delete", "Control+z", "Control+y"):
        page.press("p")
        assert browser.text("#play") == "Stop"
        page.press(key)
        assert (browser.text("#play"), key) == ("Play", key)


def test_a_joint_that_is_held_while_another_frame_comes_is_moved_in_neither(browser, clip, table):
    write_table(table, [(0, "hip", 100, 90, 1), (1, "hip", 110, 80, 1)])
    with session_page(browser, clip.video, table) as page:
        page.server.session._frames.fps = 0.01
        browser.open(page.address)
        page.press("p")
        button = {"button": "left", "clickCount": 1}
        browser.mouse("mouseMoved", *page.window(100, 90))
        browser.mouse("mousePressed", *page.window(100, 90), **button)
        assert browser.text("#play") == "Play"
        browser.mouse("mouseMoved", *page.window(130, 90), button="left", buttons=1)
        page.turn_to(1, ".")
        browser.mouse("mouseMoved", *page.window(140, 95), button="left", buttons=1)
        browser.mouse("mouseReleased", *page.window(140, 95), **button)
        assert page.points() == {"hip": (110, 80)}
        page.turn_to(0, ",")
        assert page.points() == {"hip": (100, 90)}


def test_a_film_that_is_played_to_its_end_stops_there_and_begins_anew(page, browser):
    browser.push("#play")
    page.turn_to(9)
    browser.wait("document.querySelector('#play').textContent === 'Play'")
    browser.wait(WHOLE)
    page.server.session._frames.fps = 2.0
    page.press("p")
    browser.wait("Number(document.querySelector('#frame').value) < 9")


def test_the_slider_passes_frames_and_stops_at_one(page, browser):
    left, top, width, height = browser.box("#slider")
    browser.drag(*((left + share * width, top + height / 2) for share in (0.02, 0.3, 0.9, 0.5)))
    browser.wait("['4', '5'].includes(document.querySelector('#frame').value)")
    browser.wait(WHOLE)


def test_keys_still_do_their_work_where_the_slider_was_used_last(page, browser, truth):
    page.mark(truth)
    browser.value("document.querySelector('#slider').focus()")
    page.turn_to(1, ".")
    page.turn_to(0, ",")
    page.press("x")
    assert near(page.points()["near_knee"], truth["far_knee"])


def test_a_marked_frame_is_judged_where_playing_stops(browser, clip, table, truth):
    x, y = truth["near_ankle"]
    too_long = truth | {"near_ankle": (x, y + 60.0)}
    marks = [(t, name, *place, 1) for t, of in enumerate((truth, too_long)) for name, place in of.items()]
    write_table(table, marks)
    with session_page(browser, clip.video, table) as page:
        page.server.session._frames.fps = 0.5
        browser.open(page.address)
        page.press("p")
        browser.wait("document.querySelector('#frame').value === '1'")
        time.sleep(0.4)  # longer than a mark that is set waits to be judged
        page.press("p")
        page.advice("times as far")


def test_the_slider_stays_where_it_is_held_while_earlier_frames_come(page, browser):
    held = browser.value(
        """new Promise(done => {
          const [slider, picture] = ['#slider', '#picture'].map(id => document.querySelector(id));
          const held = [];
          new MutationObserver(() => {
            held.push(slider.value);
            if (picture.ariaLabel.startsWith('Frame 4 ')) done(held);
          }).observe(picture, {attributeFilter: ['aria-label']});
          for (const at of [8, 4]) {slider.value = at; slider.dispatchEvent(new Event('input'))}
        })"""
    )
    assert held == ["4", "4"]


def test_a_further_frame_begins_with_the_nearest_that_is_marked_and_its_hip_carries_all(page, browser, truth):
    page.mark(truth)
    first = page.points()
    page.turn_to(1, ".")
    assert page.points() == first
    assert "The figure is that of frame 0" in browser.text("#guide")
    assert browser.text("#marked").split()[-1] == "0"  # nothing is marked by looking
    x, y = truth["hip"]
    page.drag((x, y), (x + 7, y - 2))
    assert all(near(place, np.add(truth[name], (7, -2))) for name, place in page.points().items())
    page.drag(page.points()["near_toe"], (90.0, 91.0))
    assert near(page.points()["near_toe"], (90.0, 91.0))
    assert near(page.points()["hip"], (x + 7, y - 2))
    page.press("Control+z", "Control+z")
    assert page.points() == first
    page.press("Enter")
    assert browser.text("#marked").split()[-1] == "1"
    browser.push("#clear")
    assert browser.text("#marked").split()[-1] == "0"


def test_arrow_keys_carry_the_whole_figure_of_a_further_frame_as_long_as_they_go_on(page, truth):
    page.mark(truth)
    first = page.points()
    page.turn_to(1, ".")
    page.press("3", *["Control+ArrowRight"] * 3, "ArrowUp")
    assert all(near(place, np.add(first[name], (30, -1))) for name, place in page.points().items())
    page.press("2", "ArrowUp", "3", "ArrowUp")
    moved = {name for name, place in page.points().items() if not near(place, np.add(first[name], (30, -1)))}
    assert moved == {"neck", "hip"}
    page.press(*["Control+z"] * 3)
    assert page.points() == first


def test_a_frame_beyond_the_end_is_said_and_the_page_stays_where_it_is(page, browser):
    page.press(">")
    browser.wait("document.querySelector('#saved').textContent.includes('ends with frame 9')")
    assert browser.value("document.querySelector('#frame').value") == "0"
    (refused,) = browser.errors
    assert refused.endswith("/frame/10")
    browser.errors.clear()
