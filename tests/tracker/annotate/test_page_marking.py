"""Marking on the page in a real browser: clicks, drags, keys, touches, zoom, and what is undone."""

import cv2
import numpy as np
import pytest

from tests.tracker.annotate.pages import HUNDREDTH, SAVED, near, session_page
from tracker.tables.keypoints import KEYPOINTS, read_keypoints


def test_the_middle_of_a_pixel_as_seen_is_that_pixel_in_the_table(browser, tmp_path, table):
    image = np.full((48, 64, 3), 60, np.uint8)
    image[21, 37] = 255
    (tmp_path / "v").mkdir()
    cv2.imwrite(str(tmp_path / "v" / "1.png"), image)
    with session_page(browser, tmp_path / "v", table) as page:
        browser.picture(tmp_path / "seen.png")
        (left, top), (right, bottom) = (np.round(page.window(*at)).astype(int) for at in ((0, 0), (63, 47)))
        seen = cv2.imread(str(tmp_path / "seen.png"), cv2.IMREAD_GRAYSCALE)[top:bottom, left:right]
        ys, xs = np.nonzero(seen == 255)
        assert len(xs) > 100
        browser.click(xs.mean() + left + 0.5, ys.mean() + top + 0.5)
        page.save()
    mark = read_keypoints(table)[0]["head_top"]
    assert near((mark.x, mark.y), (37, 21), 0.06)


def test_steps_are_undone_one_by_one_and_done_again(page, browser, truth):
    page.mark(truth)
    whole = page.points()
    page.drag(truth["neck"], (30, 40))
    moved = page.points()
    assert near(moved["neck"], (30, 40))
    browser.push("#undo")
    assert page.points() == whole
    page.press("Control+z", "Control+z")
    assert page.points().keys() == set(KEYPOINTS) - {"far_toe", "far_ankle"}
    assert browser.text("#guide").startswith("Click the far ankle")
    page.press("Control+y", "Control+Shift+Z")
    browser.push("#redo")
    assert page.points() == moved
    assert browser.value("document.querySelector('#redo').disabled")


def test_a_point_that_is_grabbed_beside_its_middle_does_not_jump(page, truth):
    page.mark(truth)
    x, y = truth["head_top"]
    page.drag((x + 2, y - 3), (x + 20, y + 20), (x + 12, y + 7))
    assert near(page.points()["head_top"], (x + 10, y + 10))


def test_the_wheel_zooms_to_the_pointer(page, browser, truth):
    at = page.window(*truth["hip"])
    for _ in range(4):
        browser.mouse("mouseWheel", *at, deltaX=0, deltaY=-240)
    browser.wait("document.querySelector('#picture').classList.contains('near')")
    # A wheel's place is in whole window pixels, and what is cut off is magnified.
    assert near(page.window(*truth["hip"]), at, 5.0)
    one, other = page.window(0, 0), page.window(1, 0)
    assert other[0] - one[0] > 7.0
    page.click(*truth["hip"])
    assert near(page.points()["head_top"], truth["hip"])
    page.press("0")
    assert browser.value("document.querySelector('#picture').getScreenCTM().a") < 3.0


def test_dragging_the_picture_moves_it_and_marks_nothing(page, browser):
    before = page.window(100, 100)
    page.drag((100, 100), (130, 90), (150, 120))
    shift = np.subtract(page.window(100, 100), before)
    assert shift[0] > 50
    assert page.points() == {}
    browser.push("#fit")
    assert near(page.window(100, 100), before)


def test_a_click_on_a_point_marks_the_joint_asked_for_where_legs_cross(page, truth):
    page.mark(truth | {"far_knee": truth["near_knee"]})
    assert near(page.points()["far_knee"], truth["near_knee"])
    assert near(page.points()["near_knee"], truth["near_knee"])


def test_arrow_keys_nudge_the_chosen_joint(page, browser, truth):
    page.mark(truth)
    page.press("3", "ArrowRight", "ArrowRight", "ArrowUp", "Shift+ArrowLeft", "Control+ArrowDown")
    x, y = truth["hip"]
    assert near(page.points()["hip"], (x + 1.75, y + 9), 2 * HUNDREDTH)
    browser.push("#undo")
    assert near(page.points()["hip"], truth["hip"])


def test_a_figure_can_be_marked_and_saved_with_the_keyboard_alone(page, browser, table):
    for step in ("Up", "Down", "Right", "Down", "Down", "Right", "Left", "Down", "Left"):
        page.press(*[f"Control+Arrow{step}"] * 2, "Enter")
    page.press("Control+s")
    browser.wait(SAVED)
    assert list(read_keypoints(table)[0]) == list(KEYPOINTS)


def test_the_keyboard_stays_on_the_joint_that_it_chose(page, browser):
    browser.value("document.querySelector('button[data-joint=near_knee]').focus()")
    page.press("Enter")
    assert browser.value("document.activeElement.dataset.joint") == "near_knee"
    assert browser.value("document.activeElement.getAttribute('aria-current')") == "true"
    assert browser.value("getComputedStyle(document.activeElement).outlineStyle") == "solid"


def test_joints_can_be_skipped_deleted_and_hidden_before_they_are_placed(page, browser, table, truth):
    for name in KEYPOINTS:
        if name == "near_toe":
            browser.push("#skip")
            continue
        if name == "far_ankle":
            page.press("h")
        page.click(*truth[name])
    page.press("9", "Delete", "s")
    assert "Left out: near toe, far toe" in browser.text("#guide")
    page.save()
    marks = read_keypoints(table)[0]
    assert [name for name in KEYPOINTS if name not in marks] == ["near_toe", "far_toe"]
    assert [name for name, mark in marks.items() if not mark.visible] == ["far_ankle"]


def test_fingers_tap_drag_and_pinch(browser, clip, table):
    with session_page(browser, clip.video, table, width=390, height=844, touch=True) as page:
        browser.touch("touchStart", page.window(200, 120))
        browser.touch("touchEnd")
        assert near(page.points()["head_top"], (200, 120), 0.7)
        before = browser.value("document.querySelector('#picture').getScreenCTM().a")
        (x, y) = page.window(240, 135)
        browser.touch("touchStart", (x - 20, y), (x + 20, y))
        for apart in (30, 40, 50, 60):
            browser.touch("touchMove", (x - apart, y), (x + apart, y))
        browser.touch("touchEnd")
        assert browser.value("document.querySelector('#picture').getScreenCTM().a") == pytest.approx(
            3.0 * before, rel=0.05
        )
        assert list(page.points()) == ["head_top"]
