"""The marking page in a real browser: what it opens with, says and saves, its looks, and how it is closed."""

import socket
from contextlib import suppress

import numpy as np
import pytest

from kinematics.figure_file import figure_from
from tests.tracker.annotate.clients import running, serving
from tests.tracker.annotate.pages import SAVED, Page, near, session_page
from tests.tracker.clips import succeeds, write_table
from tracker.annotate.marks import Table
from tracker.annotate.server import Server
from tracker.annotate.session import MarksRequest, Placed, Session
from tracker.foreign.start_marks import Taken
from tracker.tables.keypoints import KEYPOINTS, Mark, read_keypoints


def test_what_is_clicked_dragged_and_hidden_on_the_commands_page_is_in_its_table(browser, clip, table, truth):
    with running(clip.video, "--out", table, "--empty") as (command, client):
        page = Page(browser, client.address)
        page.mark(truth)
        page.drag(truth["hip"], (truth["hip"][0] + 40, 90), (truth["hip"][0] + 2, truth["hip"][1] + 1))
        browser.push("button[data-joint=far_knee]")
        browser.push("#hidden")
        page.advice("seems to face right")
        browser.push("#close")
        browser.wait("document.querySelector('.over')")
        assert "figtrack track" in browser.text(".over")
        out, errors = command.communicate(timeout=120)
    assert (command.returncode, errors) == (0, "")
    assert out.splitlines()[-2:] == [
        f"1 frame marked in {table}",
        f"next: figtrack track {clip.video} --keypoints {table}",
    ]

    marks = read_keypoints(table)[0]
    wanted = truth | {"hip": (truth["hip"][0] + 2, truth["hip"][1] + 1)}
    assert list(marks) == list(KEYPOINTS)
    for name, place in wanted.items():
        assert near((marks[name].x, marks[name].y), place), name
    assert [name for name, mark in marks.items() if not mark.visible] == ["far_knee"]

    out = table.parent / "followed"
    succeeds("track", clip.video, "--keypoints", table, "--model", "cv", "--stop", 1, "--out", out)
    assert (out / "run.json").exists()


def test_of_a_figure_that_has_no_twins_no_leg_is_nearer(browser, clip, table):
    link = {"name": "arm", "joint": "hand", "length": 1.0, "width": 0.2, "freedom": "swing"}
    arm = figure_from({"name": "arm", "base": "elbow", "leg": ["arm"], "links": [link]})
    with serving(Server(Session(clip.video, Table(table, figure=arm), 0))) as client:
        browser.open(client.address)
        browser.wait("document.querySelectorAll('#joints button').length === 2")
        assert browser.each("#which, #legs", "one.hidden") == [True, True]
        browser.open("about:blank")


def test_which_way_the_figure_faces_is_seen_or_said(page, browser, table, truth):
    page.mark(truth)
    browser.wait("document.querySelector('#right').ariaPressed === 'true'")
    browser.push("#left")
    page.advice("or choose faces right")
    browser.push("#close")
    browser.wait("document.querySelector('#doubt').open")
    browser.push("#leave")
    browser.wait("document.querySelector('.over')")
    assert "--facing left" in browser.text(".over")


def test_what_cannot_be_right_is_said_at_once_and_again_before_closing(page, browser, clip, table):
    apart = int(np.argmax(np.abs(clip.joints["near_ankle"][:, 0] - clip.joints["far_ankle"][:, 0])))
    places = {name: joints[apart] for name, joints in clip.joints.items()}
    places |= {"near_ankle": places["far_ankle"], "far_ankle": places["near_ankle"]}
    page.mark(places)
    page.advice("near ankle and far ankle")
    browser.push("#close")
    browser.wait("document.querySelector('#doubt').open")
    assert "frame 0: near ankle and far ankle" in browser.text("#doubts").replace(
        "near knee and far knee, or ", ""
    )
    browser.push("#stay")
    page.drag(places["near_ankle"], places["far_ankle"])
    assert table.exists()


def test_missing_joints_are_said_when_the_rest_is_done(page, browser, truth):
    page.press("s")
    for name in KEYPOINTS[1:]:
        page.click(*truth[name])
    page.advice("Tracking cannot start from this frame without head top")


def test_a_table_that_exists_is_opened_and_extended(browser, clip, table):
    rows = [(0, "hip", 100, 90, 1, "me"), (4, "neck", 7, 8, 0, "you")]
    write_table(table, rows, ("frame", "keypoint", "x", "y", "visible", "by"))
    with session_page(browser, clip.video, table) as page:
        assert page.points() == {"hip": (100, 90)}
        assert browser.text("#marked").split()[-2:] == ["0", "4"]
        page.click(120, 40)
        page.save()
    first, *others = table.read_text().splitlines()[1:]
    assert others == ["0,hip,100,90,1,me", "4,neck,7,8,0,you"]
    assert first.startswith("0,head_top,")


def test_taken_marks_are_shown_unsaved_and_can_be_undone(browser, clip, table):
    taken = Taken(3, {"hip": Mark(50.5, 60.25, visible=False)}, "took 1 joint from somewhere")
    with session_page(browser, clip.video, table, taken=taken) as page:
        assert page.points() == {"hip": (50.5, 60.25)}
        assert browser.text("#saved") == "took 1 joint from somewhere"
        assert browser.value("document.title").startswith("* ")
        assert not table.exists()
        page.press("Control+z")
        assert page.points() == {}
        page.press("Control+y")
        page.save()
    assert read_keypoints(table) == {3: {"hip": Mark(50.5, 60.25, visible=False)}}


@pytest.mark.parametrize("width", [1280, 390])
@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_nothing_sticks_out_and_words_stand_out_from_what_is_behind_them(browser, clip, table, width, dark):
    with session_page(
        browser, clip.video, table, width=width, height=800, dark=dark, touch=width < 500
    ) as page:
        page.press("s")
        page.can_be_read(width)
        assert (
            browser.value("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
        ) != dark


def test_every_control_has_a_name(page, browser):
    named = "one.ariaLabel || one.textContent.trim() || one.labels?.length ? '' : one.outerHTML"
    assert not any(browser.each("button, input, [role=application], [role=group], section", named))


def test_what_another_tab_saved_is_not_overwritten_and_the_marks_stay(page, browser, table, truth):
    page.click(*truth["head_top"])
    page.server.session.save(MarksRequest(frames={0: {"hip": Placed(x=1, y=2)}}))
    browser.push("#save")
    browser.wait("document.querySelector('#saved').textContent.includes('saved in another tab')")
    assert list(page.points()) == ["head_top"]
    assert read_keypoints(table)[0].keys() == {"hip"}
    browser.errors.clear()


def test_of_two_saves_at_once_neither_is_taken_for_another_tabs(page, browser, truth):
    page.click(*truth["head_top"])
    browser.value("document.querySelector('#save').click(); document.querySelector('#save').click()")
    browser.wait(
        "performance.getEntriesByType('resource').filter((one) => /save$/.test(one.name)).length > 1"
    )
    browser.wait(SAVED)


def test_a_server_that_is_gone_is_said_and_the_marks_stay(browser, clip, table, truth):
    with session_page(browser, clip.video, table) as page:
        page.server.shutdown()
        page.server.server_close()
        # The process that ends takes along what the browser connected beforehand.
        for connection in tuple(page.server.waiting):
            with suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)
        page.click(*truth["head_top"])
        browser.push("#save")
        browser.wait("document.querySelector('#saved').textContent.includes('does not answer any more')")
        assert list(page.points()) == ["head_top"]
        browser.errors.clear()
