"""`track --measure`: which points of a file count, files that cannot be right, and the round trip."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kinematics.recover import start_pose
from kinematics.sides import exchanged as twins
from tests.kinematics.figures import WALKER
from tests.tracker.clips import FPS, QUIET, figtrack, points_of, read_json, refused, succeeds, write_table
from tests.tracker.tracks import random_track
from tracker.clip.follow import follow
from tracker.clip.job import Job
from tracker.clip.measure import Judged, Measured, jitter, read_measured
from tracker.clip.plan import prepare
from tracker.foreign.dlc import write_dlc
from tracker.foreign.points import Points
from tracker.foreign.text_files import ForeignError
from tracker.loop.detections import EXCHANGED, Detections
from tracker.settings import Settings
from tracker.tables.keypoints import read_keypoints

ALONE = ("--no-templates", "--quiet")


@pytest.fixture(scope="module")
def true_points(clip):
    """The rendered clip's true joints."""
    return points_of(clip.joints)


@pytest.fixture
def measured(tmp_path):
    """A DeepLabCut file of points."""

    def write(points, name="p.csv"):
        write_dlc(points, tmp_path / name)
        return tmp_path / name

    return write


@pytest.fixture(scope="module")
def start(clip):
    return start_at(clip, 0)


def exchanged(points, frames):
    """Near leg named far in these frames, and far near."""
    places = points.places.copy()
    places[frames] = places[frames][:, twins(points.names)]
    return replace(points, places=places)


def test_only_points_that_are_likely_enough_count(true_points, measured, start):
    likelihood = true_points.likelihood.copy()
    likelihood[4, 0], likelihood[4, 1], likelihood[6] = 0.29, 0.31, 0.1
    path = measured(replace(true_points, likelihood=likelihood))
    found = read_measured(path, start, 0, FPS, Settings())
    assert sorted(found.frames) == [t for t in range(10) if t != 6]
    head = WALKER.joints.index(true_points.names[0])
    assert head not in found.frames[4].joint
    assert len(found.frames[4].joint) == len(true_points.names) - 1
    every = read_measured(path, start, 0, FPS, Settings(point_likelihood=0.05))
    assert len(every.frames) == 10
    often = read_measured(path, start, 0, 4.0 * FPS, Settings())
    assert [found.doubt for found in (often.frames[0], every.frames[0])] == [2.0, 1.0]
    with pytest.raises(ForeignError, match=r"no point of .* likelihood of 0\.3; lower point_likelihood"):
        read_measured(measured(replace(true_points, likelihood=0.2 * likelihood)), start, 0, FPS, Settings())


def test_points_of_another_clip_are_refused_and_exchanged_legs_are_not(true_points, measured, start, clip):
    away = replace(true_points, places=true_points.places + np.array([1.2 * clip.leg_px, 0.0]))
    with pytest.raises(ForeignError, match=r"frame 2 are \d+ px from the start pose; give the file of this"):
        read_measured(measured(away), start_at(clip, 2), 2, FPS, Settings())
    read_measured(measured(exchanged(true_points, [0])), start, 0, FPS, Settings())
    gone = away.places.copy()
    gone[0] = np.nan
    read_measured(measured(replace(away, places=gone)), start, 0, FPS, Settings())


@pytest.mark.parametrize("wrong", [0.0, 0.5])
def test_jitter_is_measured_whichever_leg_is_whose(wrong, rng):
    turn = 2.0 * np.pi * np.arange(400) / 30.0
    paths = [np.stack([3.0 * np.arange(400), 9.0 * np.sin(turn)], axis=1) + 20.0 * j for j in range(5)]
    paths[2:] = [path + 25.0 * np.sin(turn + j)[:, None] for j, path in enumerate(paths[2:])]
    names = ("hip", "neck", "near_knee", "far_knee", "near_toe")
    places = np.stack(paths, axis=1) + rng.normal(0.0, 4.0, (400, 5, 2))
    swapped = rng.random(400) < wrong
    places[swapped] = places[swapped][:, [0, 1, 3, 2, 4]]
    assert jitter(names, places) == pytest.approx(4.0, rel=0.1)
    assert jitter(names, places[:3]) == 0.0


def test_points_that_jitter_more_are_trusted_less_and_never_more_than_the_setting_says(
    clip, true_points, measured, rng
):
    job = Job(clip.video, read_keypoints(clip.keypoints), model="cv", settings=Settings(point=0.02))
    spread = {}
    for px in (0.0, 6.0):
        noise = rng.normal(0.0, px, true_points.places.shape)
        path = measured(replace(true_points, places=true_points.places + noise))
        spread[px] = prepare(replace(job, measure=path)).tracker.settings.point
    assert spread[0.0] == 0.02
    assert spread[6.0] == pytest.approx(6.0 / clip.leg_px, rel=0.35)  # by the median of some hundred numbers


def test_the_left_leg_is_near_of_who_faces_left(true_points, measured, clip):
    mirror = np.array([-1.0, 1.0])
    places = {name: tuple(at[0] * mirror + [480.0, 0.0]) for name, at in clip.joints.items()}
    sides = {"near": "L", "far": "R"}
    named = [name.partition("_") for name in true_points.names]
    names = tuple(sides[side] + part.title() if side in sides else side + _ + part for side, _, part in named)
    points = Points(names, true_points.places * mirror + [480.0, 0.0], true_points.likelihood)
    found = read_measured(measured(points), start_pose(WALKER, places, -1), 0, FPS, Settings()).frames[0]
    for joint, pixels in zip(found.joint, found.pixels, strict=True):
        # The file has three decimals.
        assert_allclose(pixels, places[WALKER.joints[joint]], atol=1e-3)


def start_at(clip, frame):
    return start_pose(WALKER, {name: tuple(at[frame]) for name, at in clip.joints.items()}, 1)


def test_points_alone_carry_the_clip_both_ways_from_the_middle(clip, true_points, measured, tmp_path):
    marks = tmp_path / "middle.csv"
    write_table(marks, clip.rows([5]))
    bad = exchanged(true_points, [2, 8])
    words = ("--keypoints", marks, "--measure", measured(bad), "--out", tmp_path / "out", *ALONE)
    result = succeeds("track", clip.video, *words)
    assert f"points of {', '.join(WALKER.joints)}; legs named the wrong way round in 2 of 10" in result.stdout
    assert clip.errors(tmp_path / "out" / "keypoints.csv").max() < 0.03
    news = read_json(tmp_path / "out" / "run.json")
    assert news["measure"] == {
        "file": str(tmp_path / "p.csv"),
        "joints": list(WALKER.joints),
        "frames": 10,
        "spread": 0.03,
        "exchanged": [2, 8],
    }
    assert news["settings"]["templates"] is False
    assert (tmp_path / "out" / "overlay.mp4").is_file()


def test_points_narrow_what_templates_find(clip, true_points, measured):
    job = Job(clip.video, read_keypoints(clip.keypoints), model="cv")
    with_points = follow(replace(job, measure=measured(true_points)), QUIET)
    without = follow(job, QUIET)
    assert without.points is None
    assert with_points.points.exchanged == []
    assert with_points.track.cov[5].trace() < without.track.cov[5].trace()


def test_exchanged_names_are_told_of_each_frame_by_its_own_pose_and_picture(rng):
    track = random_track(rng, T=6, first=3, facing=-1)
    places = [dict(zip(WALKER.joints, row, strict=True)) for row in track.joints()]
    frames = {
        3 + t: Detections.of(WALKER, tuple(row), np.array(list(row.values()))) for t, row in enumerate(places)
    }
    frames[2] = frames[9] = frames[4]  # frames that were not followed
    for frame in (4, 7):
        frames[frame] = replace(frames[frame], joint=frames[frame].ways(WALKER)[EXCHANGED])
    judged = Measured(Path("p.csv"), frames, 0.0).judged(track, Settings(point=0.04))
    assert judged == Judged("p.csv", list(WALKER.joints), 6, 0.04, [4, 7])


def test_points_of_few_frames_are_warned_of(clip, true_points, measured):
    places = true_points.places.copy()
    places[4:] = np.nan
    points = replace(true_points, places=places)
    job = Job(clip.video, read_keypoints(clip.keypoints), model="cv", settings=Settings(templates=False))
    few = follow(replace(job, measure=measured(points)), QUIET)
    assert few.points.frames == 4
    assert any(text.endswith("p.csv has points in 4 of 10 frames") for text in few.warnings)
    assert few.track.outcome[4:] == ("lost",) * 6
    half = follow(replace(job, measure=measured(points), stop=7), QUIET)
    assert not any("has points in" in text for text in half.warnings)


def test_between_anchors_the_points_count_too(clip, true_points, measured, tmp_path):
    marks = tmp_path / "both ends.csv"
    write_table(marks, clip.rows([0, 9]))
    job = Job(clip.video, read_keypoints(marks), settings=Settings(templates=False), anchors=True)
    job = replace(job, measure=measured(true_points))
    found = follow(job, QUIET).track
    assert set(found.outcome) <= {"ok", "hidden"}
    truth = np.stack([clip.joints[name] for name in found.figure.joints], axis=1)
    assert np.linalg.norm(found.joints() - truth, axis=-1).mean() / clip.leg_px < 0.02


def test_without_templates_and_points_there_is_nothing_to_follow(clip):
    said = figtrack("track", clip.video, "--keypoints", clip.keypoints, "--no-templates")
    assert said.exit_code == 2
    assert "give --measure FILE" in said.stderr


def test_results_do_not_replace_the_folder_that_holds_the_points(clip, true_points, tmp_path):
    out = tmp_path / "out"
    words = ("track", clip.video, "--keypoints", clip.keypoints, "--model", "cv", "--stop", 1, "--out", out)
    assert figtrack(*words, "--quiet").exit_code == 0
    write_dlc(true_points, out / "p.csv")
    said = refused(*words, "--measure", out / "p.csv", "--overwrite")
    assert "p.csv" in said
    assert (out / "p.csv").is_file()


def test_models_are_compared_on_the_same_points(clip, true_points, measured, tmp_path):
    bad = exchanged(true_points, [4])
    words = ("--keypoints", clip.keypoints, "--measure", measured(bad), *ALONE, "--out", tmp_path / "out")
    assert figtrack("compare", clip.video, *words, "--model", "cv", "--model", "walk-run-1").exit_code == 0
    for model in ("cv", "walk-run-1"):
        news = read_json(tmp_path / "out" / model / "run.json")
        assert news["measure"]["exchanged"] == [4]
        assert news["settings"]["templates"] is False
