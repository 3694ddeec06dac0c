"""A correction of a run: what it refuses, what it leaves as it was, and what it hands on to the new run."""

import json
import shutil
import signal
import threading

import pytest

from tests.tracker.annotate.clients import running
from tests.tracker.annotate.exchanged_run import LEGS, T
from tests.tracker.clips import QUIET, everything, read_json, refused
from tracker.annotate.correction import Correction
from tracker.annotate.session import MarksRequest, Placed
from tracker.run.folder import FolderError
from tracker.tables.keypoints import read_keypoints


def moved(session, frame):
    """The figure as it was followed into a frame, by a pixel, as a request of the page."""
    figure = session.frame(frame)["figure"]
    placed = {name: Placed(**mark | {"x": mark["x"] + 1.0}) for name, mark in figure.items()}
    return MarksRequest(frames={frame: placed}, anyway=True)


@pytest.mark.whole
def test_a_run_that_is_closed_untouched_is_as_it_was(run):
    before = everything(run)
    with running(run, command="correct") as (process, client):
        opening = client.opening()
        assert opening["run"]["start"] == opening["frame"]["index"] == 0
        assert set(opening["frame"]["figure"]) >= set(LEGS)
        process.terminate()
        _, errors = process.communicate(timeout=120)
    assert (process.returncode, errors) == (1, "error: interrupted; nothing was written\n")
    assert everything(run) == before


@pytest.mark.whole
def test_ctrl_c_while_it_is_followed_leaves_the_run_as_it_was_and_keeps_the_corrections(run):
    before = everything(run)
    with running(run, command="correct") as (process, client):
        figure = client.opening()["frame"]["figure"]
        frames = {"7": {name: mark | {"x": mark["x"] + 2.0} for name, mark in figure.items()}}
        assert client.post("follow", {"frames": frames, "anyway": True})[1]["follows"]
        assert "wait until that is done" in client.post("save", {"frames": frames})[1]["error"]
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=120)
    assert process.returncode == 0
    assert out.splitlines()[-1].endswith(f"not followed yet; next: figtrack correct {run}")
    after = everything(run)
    assert read_keypoints(run / "corrected.keypoints.csv").keys() == {0, 7}
    assert {path: data for path, data in after.items() if path.name != "corrected.keypoints.csv"} == before
    assert {path.name for path in run.parent.iterdir()} == {"run"}
    with running(run, command="correct") as (_, client):
        opening = client.opening()
    assert sorted(opening["marks"]) == ["0", "7"]
    assert (opening["run"]["pending"], opening["run"]["told"]) == (
        True,
        "What was corrected before is not followed yet.",
    )


def test_what_cannot_be_followed_is_said_and_the_run_stays(run, monkeypatch):
    session, before = Correction(run, None, QUIET), everything(run)
    far = Placed(x=9e4, y=9e4)
    session.follow(MarksRequest(frames={0: dict.fromkeys(LEGS, far)}, anyway=True, frame=3))
    session.work(1.0)
    assert session.following()["ended"]
    opening = session.opening()
    assert opening["run"]["told"].startswith("Could not be followed: ")
    assert opening["frame"]["index"] == 3
    assert {name: data for name, data in everything(run).items() if name.name[0] != "c"} == before


def test_a_start_without_marks_and_marks_where_nothing_was_followed_are_refused_and_not_kept(run):
    session, before = Correction(run, None, QUIET), everything(run)
    hip, beyond = {"hip": Placed(x=9.0, y=9.0)}, "is not part of the run; take its marks away"
    for frames, why in (
        ({0: {}}, "frame 0 is the one that the run starts from"),
        ({T: hip}, f"frame {T} {beyond}"),
        ({3: hip, T + 5: hip}, f"frame {T + 5} {beyond}"),
    ):
        with pytest.raises(FolderError, match=why):
            session.save(MarksRequest(frames=frames))
    assert everything(run) == before
    assert session.save(MarksRequest(frames={T: {}}))["wrong"] == []


def test_what_cannot_be_corrected_is_said_in_one_line_before_anything_is_marked(run, monkeypatch):
    assert "ends with frame 29" in refused("correct", run, "--frame", T, "--no-browser")
    news = read_json(run / "run.json")
    film = shutil.copy(news["film"]["path"], run)
    (run / "run.json").write_text(json.dumps(news | {"film": news["film"] | {"path": str(film)}}))
    assert "with it" in refused("correct", run, "--no-browser")
    (run / "run.json").write_text(json.dumps(news))
    monkeypatch.chdir(run)
    assert "the folder you are in" in refused("correct", ".", "--no-browser")


def test_a_run_that_was_replaced_meanwhile_is_not_replaced_again(run):
    one, other = Correction(run, None, QUIET), Correction(run, None, QUIET)
    request = moved(other, 20)
    one.follow(moved(one, 10))
    one.work(1.0)
    assert "Followed again" in one.opening()["run"]["told"]
    assert one.saved
    with pytest.raises(FolderError, match="saved in another tab meanwhile"):
        one.save(moved(one, 12).model_copy(update={"revision": 1}))
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
