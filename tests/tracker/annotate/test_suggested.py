"""What the marking page opens with where nobody has marked anything."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from kinematics.sides import other_side
from tests.kinematics.figures import FOOTLESS
from tests.tracker.annotate.clients import running
from tests.tracker.annotate.marked import told
from tests.tracker.annotate.pages import Page, near, session_page
from tests.tracker.clips import QUIET, succeeds
from tests.tracker.outline.films import FIRST, WALKER, a_walk
from tracker.annotate import suggestion as module
from tracker.annotate.launch import _suggest
from tracker.annotate.marks import Table
from tracker.annotate.session import MarksRequest, Placed, Session
from tracker.annotate.suggestion import suggested
from tracker.annotate.wanted import Request
from tracker.clip.asked import suggestion_path
from tracker.clip.found import TURNED, people
from tracker.foreign.start_marks import Taken
from tracker.tables.keypoints import Mark, points, read_keypoints, write_marks
from videos.frames import Video

APART = 0.85  # of the farthest that they come apart, the ankles are in a frame that is suggested
WITHIN = 2.0  # pixels of a leg of 40; people are marked with longer trunks than the walker was painted with
LEFT = {6: {"hip": Mark(100.0, 90.0), "near_knee": Mark(101.0, 110.0)}}


@pytest.fixture(scope="module")
def walker(film):
    (one,) = people(Video(film), QUIET)
    return one


def truth_of(frame):
    """The joints of a frame, in which the ankles are about farthest apart."""
    joints = a_walk().joints[FIRST:]
    ankles = [WALKER.joints.index(name) for name in ("near_ankle", "far_ankle")]
    apart = np.abs(np.diff(joints[:, ankles, 0], axis=1))[:, 0]
    assert apart[frame] > APART * apart.max()
    return dict(zip(WALKER.joints, map(tuple, joints[frame]), strict=True))


def test_the_suggestion_is_who_walks_through_the_film_with_the_ankles_apart(film, table):
    taken = suggested(film, table, WALKER, None, QUIET)
    truth = truth_of(taken.frame)
    assert taken.marks.keys() == truth.keys()
    for name, place in points(taken.marks).items():
        assert near(place, truth[name], WITHIN), name
    assert "faces right, the near leg behind; check every joint, and which leg is nearer" in taken.told


def test_what_is_not_sure_is_suggested_all_the_same_and_said(film, walker, table, monkeypatch):
    unsure = replace(walker, turned=0.9 * TURNED, outline=replace(walker.outline, named=0.1))
    monkeypatch.setattr(module, "people", lambda *_, **__: [unsure, walker])
    taken = suggested(film, table, WALKER, None, QUIET)
    assert "the surest of 2 people who walk through the film" in taken.told
    assert "faces right (not sure), the near leg behind (not sure)" in taken.told


def test_what_track_left_beside_the_table_is_suggested_without_a_look_at_the_film(film, table, monkeypatch):
    monkeypatch.setattr(module, "people", None)
    write_marks(suggestion_path(table.parent, film), LEFT)
    taken = suggested(film, table, WALKER, None, QUIET)
    assert {taken.frame: taken.marks} == LEFT
    assert "the suggestion of walk.suggested.keypoints.csv" in taken.told


@pytest.mark.whole
def test_where_nobody_is_found_the_page_opens_without_marks_and_it_is_said(clip, table):
    with running(clip.video, "--out", table) as (process, client):
        opening = client.opening()
    assert process.said.startswith("nobody was found")
    assert (opening["taken"], opening["marks"], opening["frame"]["index"]) == (None, {}, 0)


@pytest.mark.whole
@pytest.mark.parametrize(
    ("options", "frame", "taken"), [((), 6, LEFT[6]), (("--frame", 2), 2, None), (("--empty",), 0, None)]
)
def test_the_page_opens_with_the_suggestion_unless_it_is_told_otherwise(film, table, options, frame, taken):
    write_marks(suggestion_path(table.parent, film), LEFT)
    with running(film, "--out", table, *options) as (_, client):
        opening = client.opening()
    assert opening["frame"]["index"] == frame
    assert (opening["taken"] and opening["taken"]["marks"]) == (taken and told(taken))
    assert opening["marks"] == {}
    assert not table.exists()


@pytest.mark.whole
def test_a_table_with_marks_opens_without_a_suggestion_unless_it_is_begun_anew(film, table):
    write_marks(suggestion_path(table.parent, film), LEFT)
    write_marks(table, {1: {"neck": Mark(3.0, 4.0)}})
    with running(film, "--out", table) as (_, client):
        opening = client.opening()
    assert (opening["taken"], opening["frame"]["index"]) == (None, 1)
    assert opening["marks"] == {"1": told({"neck": Mark(3.0, 4.0)})}
    with running(film, "--out", table, "--overwrite") as (_, client):
        assert client.opening()["taken"]["frame"] == 6


@pytest.mark.whole
def test_the_suggestion_is_dragged_right_its_legs_are_exchanged_and_track_takes_it(browser, film, table):
    with running(film, "--out", table, "--quiet") as (process, client):
        best = int(re.match(r"frame (\d+) has a suggestion", process.said)[1])
        page = Page(browser, client.address)
        page.turn_to(best)
        assert "check every joint" in browser.text("#saved")
        suggestion = page.points()
        for name, place in truth_of(best).items():
            assert near(suggestion[name], place, WITHIN), name
        assert not table.exists()

        wanted = (suggestion["head_top"][0] + 1.5, suggestion["head_top"][1] - 1.0)
        page.drag(suggestion["head_top"], (40.0, 40.0), wanted)
        browser.push("#legs")
        browser.push("#close")
        browser.wait("document.querySelector('.over')")
        _, errors = process.communicate(timeout=120)
        assert (process.returncode, errors) == (0, "")

    marks = points(read_keypoints(table)[best])
    assert near(marks.pop("head_top"), wanted)
    for name, place in marks.items():
        assert near(place, suggestion[other_side(name)]), name

    out = table.parent / "followed"
    succeeds("track", film, "--keypoints", table, "--model", "cv", "--stop", best + 1, "--out", out)
    assert json.loads((out / "run.json").read_text())["start"]["frame"] == best


def test_legs_are_exchanged_by_the_keyboard_undone_and_done_again(browser, film, table):
    marks = {"hip": (100, 90), "near_knee": (101, 110), "near_ankle": (99, 130), "far_knee": (104, 109)}
    other = {"hip": (100, 90), "far_knee": (101, 110), "far_ankle": (99, 130), "near_knee": (104, 109)}
    taken = Taken(0, {name: Mark(*place, "ankle" not in name) for name, place in marks.items()}, "taken")
    with session_page(browser, film, table, taken=taken) as page:
        page.press("x")
        assert page.points() == other
        page.press("Control+z")
        assert page.points() == marks
        page.press("Control+y")
        assert page.points() == other
        page.save()
        saved = read_keypoints(table)[0]
        assert (points(saved), [name for name in saved if not saved[name].visible]) == (other, ["far_ankle"])
        page.turn_to(1, ".")
        assert page.points() == other  # a further frame begins with the figure as it was marked last
        page.press("x")
        assert page.points() == marks


def test_a_joint_that_was_left_out_is_left_out_of_the_other_leg_when_they_are_exchanged(browser, film, table):
    taken = Taken(0, {"near_knee": Mark(101.0, 110.0)}, "taken")
    with session_page(browser, film, table, taken=taken) as page:
        browser.push("button[data-joint=near_ankle]")
        page.press("s", "x")
        left = "document.querySelector('button[data-joint={}] .state').textContent"
        assert browser.value(left.format("far_ankle")) == "left out"
        assert browser.value(left.format("near_ankle")) == ""


def test_what_was_saved_in_place_of_a_suggestion_stays_where_the_page_is_opened_anew(film, table):
    marks = {"hip": Mark(100.0, 90.0)}
    session = Session(film, Table(table), 0)
    session.start_from(Taken(3, marks, "found"))
    assert session.opening()["taken"]["frame"] == 3
    session.save(MarksRequest(frames={3: {"hip": Placed(x=130.0, y=90.0)}}))
    opening = session.opening()
    assert opening["taken"] is None
    assert opening["marks"][3]["hip"]["x"] == 130.0


def test_a_suggestion_is_of_the_marked_joints_and_of_the_facing_that_is_told(film, table, monkeypatch):
    asked, one = [], people(Video(film), QUIET)
    monkeypatch.setattr(module, "people", lambda *_, facing: asked.append(facing) or one)
    taken = suggested(film, table, FOOTLESS, 1, QUIET)
    assert asked == [1]
    assert set(taken.marks) == set(FOOTLESS.marks)
    toe = {"near_toe": Mark(103.0, 120.0)}
    write_marks(suggestion_path(table.parent, film), {taken.frame: LEFT[6] | toe})
    left = suggested(film, table, FOOTLESS, None, QUIET)
    assert {left.frame: left.marks} == {taken.frame: LEFT[6]}


def test_a_suggestion_beyond_the_film_is_left_out(film, table, capsys):
    write_marks(suggestion_path(table.parent, film), {99: LEFT[6]})
    session = Session(film, Table(table), 0)
    _suggest(Request(video=film, out=table), session, WALKER, QUIET)
    assert "the page opens without a suggestion: frame 99 is not in walk.mp4" in capsys.readouterr().out
    assert session.opening()["taken"] is None
