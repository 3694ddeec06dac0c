"""What a clip is started from: marks of ours or of another program."""

import json

import pytest

from tests.tracker import people
from tests.tracker.clips import succeeds, write_table
from tracker.batch.jobs import read_jobs
from tracker.clip.asked import asked, suggestion_path
from tracker.clip.job import Following, OptionsError, bare_name
from tracker.progress import Progress
from tracker.tables.keypoints import points, read_keypoints


@pytest.fixture
def net(clip, tmp_path):
    """The clip's true joints as a pose network's, in every frame."""
    marks = read_keypoints(clip.keypoints)
    names = {name: name.replace("near", "right").replace("far", "left") for name in marks[0]}
    rows = {str(t): {names[name]: place for name, place in points(of).items()} for t, of in marks.items()}
    return people.dlc(tmp_path / "net.csv", rows, names=list(names.values()))


def test_another_programs_marks_are_those_of_the_frame_with_the_ankles_apart_and_it_is_said(
    clip, net, capsys
):
    job = asked(Following(), clip.video, net, None, Progress("plain"))
    truth = read_keypoints(clip.keypoints)
    apart = {t: abs(of["near_ankle"].x - of["far_ankle"].x) for t, of in truth.items()}
    (frame,) = job.marks
    assert frame == max(apart, key=lambda t: apart[t])
    for name, place in points(job.marks[frame]).items():
        assert place == pytest.approx(points(truth[frame])[name], abs=0.01)
    assert capsys.readouterr().err.startswith(
        f"took 9 joints from net.csv (DeepLabCut, frame {frame}); faces right"
    )
    asked(Following(), clip.video, net, None, Progress("quiet"))
    assert capsys.readouterr().err == ""


def test_another_programs_file_has_no_anchors(clip, net):
    with pytest.raises(OptionsError, match="another program's file gives one frame"):
        asked(Following(anchors=True), clip.video, net, None, Progress("quiet"))


def test_results_are_called_after_a_file_without_its_ending_and_after_a_whole_folder(tmp_path):
    (tmp_path / "trial.1").mkdir()
    assert bare_name(tmp_path / "trial.1") == "trial.1"
    assert bare_name(tmp_path / "trial.1.mp4") == "trial.1"
    assert suggestion_path(tmp_path, tmp_path / "trial.1").name == "trial.1.suggested.keypoints.csv"


def test_start_stop_and_facing_say_what_is_taken(clip, net):
    def taken(**options):
        return asked(Following(**options), clip.video, net, None, Progress("quiet")).marks

    assert taken(start=4).keys() == {4}
    (frame,) = taken(stop=3)
    assert frame <= 3
    right, left = taken(start=4, facing="right"), taken(start=4, facing="left")
    assert right[4]["near_knee"] == left[4]["far_knee"] != right[4]["far_knee"]


def test_track_and_a_table_of_clips_follow_from_another_programs_file(clip, net, tmp_path):
    out = tmp_path / "out"
    words = ("track", clip.video, "--keypoints", net, "--start", 1, "--stop", 2, "--model", "cv")
    result = succeeds(*words, "--no-smooth", "--out", out)
    assert "took 9 joints from net.csv (DeepLabCut, frame 1)" in result.stderr
    assert json.loads((out / "run.json").read_text())["start"] == {
        "frame": 1,
        "marks": "given",
        "near_leg": "given",
    }
    write_table(tmp_path / "jobs.csv", [(clip.video, net, 1)], ("video", "keypoints", "start"))
    (row,) = read_jobs(tmp_path / "jobs.csv", tmp_path, Progress("quiet"))
    assert row.job().marks.keys() == {1}
