"""A run's folder comes back as it was written, and a damaged one is told from a complete one."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kinematics.spm import joints
from tests.kinematics.figures import FOOTLESS, WALKER
from tests.tracker.records import FIRST, FPS, FRAMES, SIZE, T, made_track, write_folder
from tracker.run import write
from tracker.run.read import RunError, read_run


@pytest.mark.parametrize("facing", [1, -1])
def test_a_run_comes_back_as_it_was_written(rng, tmp_path, facing):
    track = made_track(rng, facing=facing)
    record = read_run(write_folder(track, tmp_path / "run"))
    rows = slice(FIRST, FIRST + T)
    assert len(record) == FRAMES
    assert (record.facing, record.news.fps, record.news.size) == (facing, FPS, SIZE)
    assert record.outcome == (None, *track.outcome, None)
    assert list(record.measured) == [False, True, True, True, False, False, True, False]
    assert_allclose(record.times, np.arange(FRAMES) / FPS, atol=1e-6)
    for j, name in enumerate(WALKER.joints):
        assert_allclose(record.place(name)[rows], track.joints()[:, j], atol=1e-9)
        assert_allclose(record.covs[rows, record.names.index(name)], track.joint_covs()[:, j], atol=1e-9)
    assert_allclose(record.poses[rows], track.q[:, :10])
    assert record.freedoms == WALKER.pose_freedoms
    assert record.view == track.view
    for numbers in (record.places, record.covs, record.poses):
        assert np.isnan(numbers[[0, -1]]).all()


def test_joints_that_the_figure_has_not_are_nowhere(rng, tmp_path):
    bare = FOOTLESS
    record = read_run(write_folder(made_track(rng, figure=bare), tmp_path / "run"))
    assert np.isnan(record.place("near_toe")).all()
    assert np.isnan(record.place("tail")).all()


def test_in_the_scene_the_camera_s_own_motion_is_gone(rng, tmp_path):
    track = made_track(rng)
    record = read_run(write_folder(track, tmp_path / "run"))
    rows = slice(track.first, track.first + len(track))
    assert_allclose(record.moved[rows], track.moved)
    scene = record.in_scene()
    for t, q in enumerate(track.q):
        places = scene.places[track.first + t, [record.names.index(name) for name in track.figure.joints]]
        assert_allclose(places, track.view.to_pixels(joints(track.figure, q)), atol=1e-3)
        zoom = track.moved[t, 2]
        assert_allclose(scene.covs[track.first + t], record.covs[track.first + t] / zoom**2)
    assert_allclose(scene.in_scene().places, scene.places)


def test_a_track_of_another_version_is_said_to_be_one(rng, tmp_path, monkeypatch):
    monkeypatch.setattr(write, "VERSION", 3)
    folder = write_folder(made_track(rng), tmp_path / "run")
    with pytest.raises(RunError, match=r"it is of version 3, this program reads 2\); track the clip again"):
        read_run(folder)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"facing": "up"}, "facing input should be 'left' or 'right'"),
        ({"fps": 0}, "fps input should be greater than 0"),
    ],
)
def test_a_run_json_that_does_not_fit_is_said(rng, tmp_path, changes, words):
    folder = write_folder(made_track(rng), tmp_path / "run", **changes)
    with pytest.raises(RunError, match=words):
        read_run(folder)


def test_the_name_of_a_film_may_be_no_utf_8(rng, tmp_path):
    record = read_run(write_folder(made_track(rng), tmp_path / "run", video="l\udce4uft.mp4"))
    assert record.news.video == "l\udce4uft.mp4"
