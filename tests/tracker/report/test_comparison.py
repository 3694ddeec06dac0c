"""Models side by side on one clip: what a comparison leaves."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from dynamics.slds import constant_velocity
from dynamics.store import ModelError, save
from kinematics.mocap import POSE_COLUMNS
from tests.tracker.clips import RUN_FILES, read_csv, read_json, refused, succeeds, write_table, write_video
from tracker.clip import part
from tracker.clip.follow import follow
from tracker.clip.job import Job
from tracker.progress import Progress
from tracker.report import comparison, page
from tracker.report.comparison import compare_models
from tracker.report.results import write_run
from tracker.tables.keypoints import read_keypoints

MODELS = ("cv", "walk-run-1")
SCORE_KEYS = {
    "first_failure_frame", "frames_followed", "truth_frames", "mean_error_leg", "median_error_leg",
    "pck_02_leg", "swaps", "angle_median_deg",
}  # fmt: skip
SCORED = ("head_top", "neck", "hip", "near_knee", "near_ankle", "far_knee", "far_ankle")


def compare(clip, out, *more):
    return ["compare", clip.video, "--keypoints", clip.keypoints, "--out", out, *more]


@pytest.fixture(scope="module")
def done(clip, tmp_path_factory):
    """A finished comparison, its folder and what was printed."""
    out = tmp_path_factory.mktemp("compare") / "out"
    result = succeeds(*compare(clip, out, "--model", "cv", "--model", "walk-run-1", "--quiet"))
    return out, result


@pytest.fixture
def job(clip):
    return Job(clip.video, read_keypoints(clip.keypoints), model="cv")


def test_a_comparison_leaves_a_run_a_model_and_one_page(done):
    out, _ = done
    assert {path.name for path in out.iterdir()} == {
        *MODELS, "compare.json", "failure.png", "errors.png", "report.html",
    }  # fmt: skip
    for name in MODELS:
        assert {path.name for path in (out / name).iterdir()} == RUN_FILES
        assert read_json(out / name / "run.json")["model"] == name


def test_the_film_is_surveyed_once_whatever_the_number_of_models(job, clip, tmp_path, monkeypatch):
    looked = []
    monkeypatch.setattr(part, "surveyed", lambda *words: looked.append(words))
    compare_models(replace(job, stop=4), read_keypoints(clip.keypoints), MODELS, tmp_path, Progress("quiet"))
    assert len(looked) == 1


def test_a_large_film_lies_once_beside_the_pages_that_show_it(job, clip, tmp_path, monkeypatch):
    monkeypatch.setattr(page, "LARGEST", 100)
    truth = read_keypoints(clip.keypoints)
    compare_models(replace(job, stop=4), truth, ["cv"], tmp_path, Progress("quiet"))
    assert [path.parent for path in tmp_path.rglob("film.mp4")] == [tmp_path]
    for folder, link in ((tmp_path, "film.mp4"), (tmp_path / "cv", "../film.mp4")):
        assert f'"link":"{link}"' in (folder / "report.html").read_text(encoding="utf-8")
    (tmp_path / "alone").mkdir()
    write_run(follow(replace(job, stop=4), Progress("quiet")), tmp_path / "alone", Progress("quiet"))
    assert {path.name for path in (tmp_path / "alone").iterdir()} == RUN_FILES | {"film.mp4"}


def test_compare_json_has_exactly_the_keys_that_others_read(clip, done):
    news = read_json(done[0] / "compare.json")
    assert news.keys() == {"models"}
    assert tuple(news["models"]) == MODELS
    for result in news["models"].values():
        assert result.keys() == SCORE_KEYS
        assert result["truth_frames"] == len(clip) - 1
        assert result["first_failure_frame"] is None
        assert result["frames_followed"] == len(clip) - 1


def test_the_mean_error_is_that_of_the_keypoints_beside_it(clip, done):
    """The slow twin: distances read back from keypoints.csv."""
    for name, result in read_json(done[0] / "compare.json")["models"].items():
        away = [
            np.hypot(*(clip.joints[row["keypoint"]][int(row["frame"])] - (float(row["x"]), float(row["y"]))))
            for row in read_csv(done[0] / name / "keypoints.csv")
            if row["keypoint"] in SCORED and row["frame"] != "0"
        ]
        # Both tables are rounded to a thousandth of a pixel, the score to 1e-4.
        assert result["mean_error_leg"] == pytest.approx(np.mean(away) / clip.leg_px, abs=1e-3)
        assert result["mean_error_leg"] < 0.1


def test_pictures_can_be_seen(done):
    for name in ("failure.png", "errors.png"):
        picture = cv2.imread(str(done[0] / name))
        assert picture.shape[0] > 100
        assert picture.std() > 5


def test_stdout_is_the_table_and_where_the_page_is(done):
    out, result = done
    lines = result.stdout.splitlines()
    assert lines[0].split()[0] == "model"
    assert [line.split()[0] for line in lines[1:3]] == list(MODELS)
    assert lines[-1] == f"open {out / 'report.html'}"
    assert result.stderr == ""


def test_models_that_are_named_twice_are_followed_once_and_scored_up_to_the_stop(clip, tmp_path):
    words = compare(clip, tmp_path / "out", "--model", "cv", "--model", "cv", "--stop", 2)
    succeeds(*words)
    models = read_json(tmp_path / "out" / "compare.json")["models"]
    assert {name: result["truth_frames"] for name, result in models.items()} == {"cv": 2}


def test_two_model_files_of_one_name_are_refused(clip, tmp_path):
    files = [tmp_path / "a" / "gait.npz", tmp_path / "b" / "gait.npz"]
    n = len(POSE_COLUMNS)
    for path in files:
        path.parent.mkdir()
        save(constant_velocity(POSE_COLUMNS, np.full(n, 0.01), np.full(n, 0.1), 30.0), path, "a test")
    line = refused(*compare(clip, tmp_path / "out", "--model", files[0], "--model", files[1]))
    assert "have one name; rename a file" in line
    assert not (tmp_path / "out").exists()


def test_what_is_wrong_with_the_last_model_is_said_before_the_work(job, tmp_path, monkeypatch):
    monkeypatch.setattr(comparison, "follow", None)
    with pytest.raises(ModelError, match="no model 'swim' ships"):
        compare_models(job, job.marks, ["cv", "swim"], tmp_path, Progress("quiet"))


def test_a_truth_without_frames_after_the_start_is_refused_before_the_work(clip, tmp_path, monkeypatch):
    monkeypatch.setattr(comparison, "follow", None)
    write_table(tmp_path / "truth.csv", clip.rows([0, 4]))
    more = ["--truth", tmp_path / "truth.csv", "--start", 5]
    assert "the truth marks no frame after frame 5" in refused(*compare(clip, tmp_path / "out", *more))
    write_table(tmp_path / "truth.csv", [*clip.rows([0]), (5, "near_toe", 1, 1, 1)])
    more = ["--truth", tmp_path / "truth.csv"]
    assert "the truth marks no frame after frame 0" in refused(*compare(clip, tmp_path / "out", *more))
    assert not (tmp_path / "out").exists()


def test_anchors_of_the_very_truth_leave_nothing_to_score(clip, job, tmp_path, monkeypatch):
    monkeypatch.setattr(comparison, "follow", None)
    every = replace(job, anchors=True)
    with pytest.raises(ValueError, match=r"all 9 truth frames after frame 0 are anchors; give --truth"):
        compare_models(every, job.marks, ["cv"], tmp_path, Progress("quiet"))
    some = replace(every, marks={t: job.marks[t] for t in (0, 3, 6)})
    monkeypatch.undo()
    table = compare_models(some, job.marks, ["cv"], tmp_path, Progress("quiet"))
    assert table.splitlines()[-1] == "2 anchors not scored"
    assert "2 anchors not scored" in (tmp_path / "report.html").read_text(encoding="utf-8")
    assert read_json(tmp_path / "compare.json")["models"]["cv"]["truth_frames"] == len(job.marks) - 3
    assert read_json(tmp_path / "cv" / "run.json")["anchors"] is True


def test_anchors_marked_anew_for_the_truth_are_scored(clip, tmp_path):
    marks, out = tmp_path / "some.csv", tmp_path / "out"
    write_table(marks, [(t, name, x + 1.0, y, 1) for t, name, x, y, _ in clip.rows([0, 3, 6])])
    words = ["compare", clip.video, "--keypoints", marks, "--truth", clip.keypoints, "--out", out]
    result = succeeds(*words, "--model", "cv", "--anchors", "--quiet")
    assert read_json(out / "compare.json")["models"]["cv"]["truth_frames"] == len(clip) - 1
    assert "not scored" not in result.stdout


def test_of_a_video_cut_short_what_was_read_is_compared_and_it_is_said(clip, tmp_path):
    write_video(tmp_path / "long.mp4", clip.images + clip.images[::-1])
    data = (tmp_path / "long.mp4").read_bytes()
    (tmp_path / "cut.mp4").write_bytes(data[: len(data) // 2])
    rows = [(t, name, x, y, 1) for t in range(20) for _, name, x, y, _ in clip.rows([0])]
    write_table(tmp_path / "truth.csv", rows)
    words = ["--keypoints", clip.keypoints, "--truth", tmp_path / "truth.csv", "--model", "cv", "--quiet"]
    result = succeeds("compare", tmp_path / "cut.mp4", *words, "--out", tmp_path / "out")
    assert result.stderr.startswith("warning: cv: cut.mp4 ")
    read = read_json(tmp_path / "out" / "cv" / "run.json")["frames"]
    assert read_json(tmp_path / "out" / "compare.json")["models"]["cv"]["truth_frames"] == read - 1
