"""A run opened on the page, put right in a real browser, and followed again."""

import json
import shutil
import signal
import threading
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

from kinematics.recover import PoseError
from kinematics.sides import exchanged as sides
from kinematics.sides import other_side
from tests.tracker.annotate.pages import Page, near, served
from tests.tracker.annotate.test_launch import page, post, running
from tests.tracker.clips import everything, read_json, refused, write_table, write_video
from tracker.annotate import correction
from tracker.annotate.correction import Correction
from tracker.annotate.session import Placed, SaveRequest
from tracker.clip.follow import follow
from tracker.clip.job import Job
from tracker.progress import Progress
from tracker.report.results import write_run
from tracker.run.folder import FolderError
from tracker.scene.film import render, truth_table
from tracker.tables.keypoints import points, read_keypoints

T, TURN = 30, 12  # frames; from TURN on the run's legs are exchanged
QUIET = Progress("quiet")
LEGS = ("near_knee", "near_ankle", "far_knee", "far_ankle")


@pytest.fixture(scope="module")
def scene():
    return render(11, frames=T, size=(480, 270), shrubs=False)


@pytest.fixture(scope="module")
def tracked(scene, tmp_path_factory):
    """The run of a film, its legs exchanged on purpose from TURN on; not to be written to."""
    folder = tmp_path_factory.mktemp("exchanged")
    write_video(folder / "walk.mp4", scene.images)
    write_table(folder / "walk.csv", [row for row in truth_table(scene) if row[0] == 0])
    finished = follow(Job(folder / "walk.mp4", read_keypoints(folder / "walk.csv")), QUIET)
    track, (twin, q) = finished.track, (sides(finished.track.figure.freedoms), finished.track.q.copy())
    q[TURN:] = q[TURN:, twin]
    (folder / "run").mkdir()
    write_run(replace(finished, track=replace(track, q=q)), folder / "run", QUIET, overlay=False)
    return folder / "run"


@pytest.fixture
def run(tracked, tmp_path):
    """A copy of the run."""
    return shutil.copytree(tracked, tmp_path / "run")


def exchanged(scene, folder):
    """(T,) whether the legs of a run lie nearer to those of the other names."""
    found = {t: points(marks) for t, marks in read_keypoints(folder / "keypoints.csv").items()}

    def away(t, named):
        return sum(np.hypot(*np.subtract(found[t][name], scene.joints[named(name)][t])) for name in LEGS)

    return np.array([away(t, other_side) < away(t, str) for t in range(T)])


@contextmanager
def correcting(browser, folder, frame=None, **window):
    """The page of a run."""
    session, closed = Correction(folder, frame, QUIET), threading.Event()

    def work():
        while not closed.is_set():
            session.work(0.02)

    threading.Thread(target=work, daemon=True).start()
    with served(browser, session, **window) as page:
        yield page
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
    with running(run, "--frame", TURN, "--quiet", command="correct") as (process, address):
        shown = Page(browser, address)
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


@pytest.mark.whole
def test_the_legs_of_all_frames_are_exchanged_with_one_click(browser, scene, run):
    with correcting(browser, run) as shown:
        shown.turn_to(1, ".")
        tracked = shown.points()
        browser.push("#all")
        assert {other_side(name): place for name, place in shown.points().items()} == tracked
        follow_on(browser)
    assert exchanged(scene, run).all()


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


@pytest.mark.whole
def test_a_run_that_is_closed_untouched_is_as_it_was(run):
    before = everything(run)
    with running(run, command="correct") as (process, address):
        opening = page(address)
        assert opening["run"]["start"] == opening["frame"]["index"] == 0
        assert set(opening["frame"]["figure"]) >= set(LEGS)
        process.terminate()
        _, errors = process.communicate(timeout=120)
    assert (process.returncode, errors) == (1, "error: interrupted; nothing was written\n")
    assert everything(run) == before


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


@pytest.mark.whole
def test_ctrl_c_while_it_is_followed_leaves_the_run_as_it_was_and_keeps_the_corrections(run):
    before = everything(run)
    with running(run, command="correct") as (process, address):
        figure = page(address)["frame"]["figure"]
        frames = {"7": {name: mark | {"x": mark["x"] + 2.0} for name, mark in figure.items()}}
        assert post(address, "follow", {"frames": frames, "anyway": True})["follows"]
        assert "wait until that is done" in post(address, "save", {"frames": frames})["error"]
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=120)
    assert process.returncode == 0
    assert out.splitlines()[-1].endswith(f"not followed yet; next: figtrack correct {run}")
    after = everything(run)
    assert read_keypoints(run / "corrected.keypoints.csv").keys() == {0, 7}
    assert {path: data for path, data in after.items() if path.name != "corrected.keypoints.csv"} == before
    assert {path.name for path in run.parent.iterdir()} == {"run"}
    with running(run, command="correct") as (_, address):
        opening = page(address)
    assert sorted(opening["marks"]) == ["0", "7"]
    assert (opening["run"]["pending"], opening["run"]["told"]) == (
        True,
        "What was corrected before is not followed yet.",
    )


def test_what_cannot_be_followed_is_said_and_the_run_stays(run, monkeypatch):
    session, before = Correction(run, None, QUIET), everything(run)
    far = Placed(x=9e4, y=9e4)
    session.follow(SaveRequest(frames={0: dict.fromkeys(LEGS, far)}, anyway=True))
    session.work(1.0)
    assert session.following()["ended"]
    assert session.opening()["run"]["told"].startswith("Could not be followed: ")
    assert {name: data for name, data in everything(run).items() if name.name[0] != "c"} == before


def test_the_marks_of_the_start_cannot_be_taken_away(run):
    with pytest.raises(FolderError, match="frame 0 is the one that the run starts from"):
        Correction(run, None, QUIET).save(SaveRequest(frames={0: {}}))


def test_a_run_that_holds_its_own_film_is_refused_before_anything_is_marked(run, monkeypatch):
    news = read_json(run / "run.json")
    film = shutil.copy(news["film"]["path"], run)
    (run / "run.json").write_text(json.dumps(news | {"film": news["film"] | {"path": str(film)}}))
    assert "with it" in refused("correct", run, "--no-browser")
    (run / "run.json").write_text(json.dumps(news))
    monkeypatch.chdir(run)
    assert "the folder you are in" in refused("correct", ".", "--no-browser")


def test_what_cannot_be_corrected_is_said_in_one_line(run, tmp_path):
    assert "holds no complete run" in refused("correct", tmp_path, "--no-browser")
    assert "ends with frame 29" in refused("correct", run, "--frame", T, "--no-browser")
    (run / "start.keypoints.csv").unlink()
    assert "track the clip again" in refused("correct", run, "--no-browser")


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


def moved(session, frame):
    """The figure as it was followed into a frame, by a pixel, as a request of the page."""
    figure = session.frame(frame)["figure"]
    placed = {name: Placed(**mark | {"x": mark["x"] + 1.0}) for name, mark in figure.items()}
    return SaveRequest(frames={frame: placed}, anyway=True)


def test_a_run_that_was_replaced_meanwhile_is_not_replaced_again(run):
    one, other = Correction(run, None, QUIET), Correction(run, None, QUIET)
    request = moved(other, 20)
    one.follow(moved(one, 10))
    one.work(1.0)
    assert "Followed again" in one.opening()["run"]["told"]
    assert one.saved
    for act in (other.save, other.follow):
        with pytest.raises(FolderError, match="was replaced since it was opened here; open it again"):
            act(request)
    assert read_keypoints(run / "start.keypoints.csv").keys() == {0, 10}
    assert not (run / "corrected.keypoints.csv").exists()


def test_a_run_that_is_replaced_while_it_is_followed_stays(run, monkeypatch):
    session = Correction(run, None, QUIET)
    session.follow(moved(session, 10))
    news = read_json(run / "run.json")
    (run / "run.json").write_text(json.dumps(news | {"height": 1.8}))
    session.work(1.0)
    assert "was replaced since" in session.opening()["run"]["told"]
    assert read_json(run / "run.json")["height"] == 1.8


def test_of_two_requests_at_once_one_is_followed(run):
    session = Correction(run, None, QUIET)
    request, both, answers = moved(session, 10), threading.Barrier(2), []

    def ask():
        both.wait()
        try:
            answers.append(session.follow(request)["follows"])
        except FolderError as error:
            answers.append(str(error))

    threads = [threading.Thread(target=ask) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(map(str, answers)) == ["True", "the figure is just being followed; wait until that is done"]


def test_a_leg_that_was_not_sure_stays_so_while_the_start_is_as_it_was(run):
    news = read_json(run / "run.json")
    start = news["start"] | {"marks": "found", "near_leg": "unsure"}
    (run / "run.json").write_text(json.dumps(news | {"start": start}))
    session = Correction(run, None, QUIET)
    for frame, told in ((10, start), (0, news["start"])):
        session.follow(moved(session, frame))
        session.work(1.0)
        assert read_json(run / "run.json")["start"] == told
