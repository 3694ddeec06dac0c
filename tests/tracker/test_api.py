"""The Python face: the same poses as the command, as arrays, and nothing written."""

import re
import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose

import tracker
from tests.tracker.clips import everything, read_csv, succeeds
from tests.tracker.processes import printed_by
from tracker.settings import Settings

SLOW = ("numpy", "scipy", "cv2", "av", "matplotlib", "pydantic", "rich", "typer")


@pytest.fixture(scope="module")
def track(clip):
    return tracker.follow(clip.video, clip.keypoints, start=3, stop=6)


def test_it_gives_arrays_of_every_frame(track):
    J, D = len(track.figure.joints), len(track.figure.freedoms)
    assert track.figure.joints == (
        "hip", "neck", "head_top", "near_knee", "near_ankle", "far_knee", "far_ankle", "near_toe", "far_toe",
    )  # fmt: skip
    assert track.joints().shape == (7, J, 2)
    assert track.joint_covs().shape == (7, J, 2, 2)
    assert track.q.shape == (7, D)
    assert track.cov.shape == (7, D, D)
    assert track.times.shape == track.s.shape == (7,)
    assert set(track.outcome) <= {"ok", "hidden"}


def test_it_is_the_track_of_the_command_with_the_same_options(clip, track, tmp_path):
    words = ["track", clip.video, "--keypoints", clip.keypoints, "--out", tmp_path / "out"]
    succeeds(*words, "--start", 3, "--stop", 6, "--quiet")
    rows = read_csv(tmp_path / "out" / "keypoints.csv")
    for j, name in enumerate(track.figure.joints):
        places = [(float(row["x"]), float(row["y"])) for row in rows if row["keypoint"] == name]
        assert_allclose(track.joints()[:, j], places, atol=0.00051)  # three digits are written


def test_every_option_is_heeded(clip, tmp_path):
    (tmp_path / "s.toml").write_text("cv_angle = 1.5\n", encoding="utf-8")
    told = {"model": "cv", "start": 2, "stop": 4, "smooth": False}

    def poses(**more):
        return tracker.follow(clip.video, clip.keypoints, **(told | more)).q

    plain = poses()
    for changed in ({"stop": 5}, {"start": 3}, {"smooth": True}, {"anchors": True}, {"model": "walk-run"}):
        other = poses(**changed)
        assert other.shape != plain.shape or np.abs(other - plain).max() > 1e-6, changed
    from_file = poses(settings=tmp_path / "s.toml")
    assert np.abs(from_file - plain).max() > 1e-6
    assert_allclose(poses(settings=Settings(cv_angle=1.5)), from_file)
    slow = tracker.follow(clip.video, clip.keypoints, stop=3, rate=0.5)
    assert np.abs(slow.q - tracker.follow(clip.video, clip.keypoints, stop=3, rate=1.0).q).max() > 1e-6
    assert tracker.follow(str(clip.video), str(clip.keypoints), stop=1, facing="right").view.facing == 1
    with pytest.raises(ValueError, match="or give facing right"):
        tracker.follow(clip.video, clip.keypoints, start=6, stop=6, facing="left")


def test_errors_name_keywords_and_a_wrong_one_the_nearest(clip):
    with pytest.raises(TypeError, match=r"^follow\(\) has no option 'heigth'; choose from height$"):
        tracker.follow(clip.video, heigth=1.75)
    with pytest.raises(ValueError, match="from_ 4 comes after the start frame 0; choose an earlier from_"):
        tracker.follow(clip.video, clip.keypoints, start=0, from_=4)
    with pytest.raises(ValueError, match="'figtrack annotate --figure horse' and give keypoints"):
        tracker.follow(clip.video, figure="horse")


@pytest.mark.parametrize("name", ["my--marks.csv", "it's--near ahead.csv"])
def test_names_of_files_are_left_as_they_are_in_errors(name, clip, tmp_path):
    with pytest.raises(ValueError, match=re.escape(name)):
        tracker.follow(clip.video, tmp_path / name)


def test_it_writes_nothing_and_says_nothing(clip, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    before = everything(clip.video.parent)
    tracker.follow(clip.video, clip.keypoints, model="cv", stop=1)
    assert everything(clip.video.parent) == before
    assert list(tmp_path.iterdir()) == []
    assert capfd.readouterr() == ("", "")


def test_progress_is_shown_where_it_is_wanted(clip, capfd):
    tracker.follow(clip.video, clip.keypoints, model="cv", stop=1, progress="plain")
    said = [line.rpartition(" in ")[0] for line in capfd.readouterr().err.splitlines()]
    assert said == ["walk.mp4 surveyed: 2 of 2", "walk.mp4 with cv: 2 of 2"]


def test_what_the_command_warns_of_is_a_warning(clip, tmp_path):
    data = clip.video.read_bytes()
    (tmp_path / "cut.mp4").write_bytes(data[: 3 * len(data) // 4])
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        tracker.follow(tmp_path / "cut.mp4", clip.keypoints, model="cv")
    assert [str(warning.message).split()[0] for warning in said] == ["cut.mp4"]
    assert said[0].filename == __file__


def test_importing_it_imports_nothing_slow():
    code = f"import sys, tracker; print([name for name in {SLOW} if name in sys.modules])"
    assert printed_by(code) == ["[]"]
