"""Runs filmed by a moving camera: poses are in the scene's frame and as accurate as with a still camera."""

from dataclasses import replace
from itertools import islice

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from kinematics.spm import UNMOVED
from tests.tracker.clips import QUIET, read_json, write_images
from tests.tracker.picture.ways import NEAR, sway
from tracker.clip.follow import follow
from tracker.clip.job import Job
from tracker.picture.camera import Camera
from tracker.report.results import write_run
from tracker.run.score import places, score
from tracker.settings import Settings
from tracker.tables.keypoints import read_keypoints
from videos.frames import Video


def shake(T, deviation):
    """(T, 2) of a hand that is somewhere else in every frame."""
    way = np.random.default_rng(7).normal(scale=deviation, size=(T, 2))
    return way - way[0]


@pytest.fixture(scope="module")
def panned(clip, tmp_path_factory):
    """The rendered walk seen by a camera that pans, its job, and the scene's shift in every frame."""
    folder = tmp_path_factory.mktemp("panned")
    way = sway(len(clip), 12.0, 60)
    for t, (image, shift) in enumerate(zip(clip.images, way, strict=True)):
        cv2.imwrite(str(folder / f"{t}.png"), moved(image, shift, border=100)[..., ::-1])
    marks = {
        t: {name: carried(mark, way[t] + 100.0) for name, mark in of_frame.items()}
        for t, of_frame in read_keypoints(clip.keypoints).items()
    }
    return Job(folder, marks, start=4), way


@pytest.fixture(scope="module")
def finished(panned):
    return follow(panned[0], QUIET)


def test_a_run_is_in_the_scene_s_frame_both_ways_from_its_start(clip, panned, finished):
    job, way = panned
    assert_allclose(finished.track.moved[:, :2], way - way[job.start], atol=NEAR)
    still = follow(replace(job, video=clip.video, marks=read_keypoints(clip.keypoints)), QUIET).track
    assert_array_equal(still.moved, np.tile(UNMOVED, (len(still), 1)))
    # The picture is resampled and the shift off by parts of a pixel: a hundredth of a leg, two degrees.
    D = len(still.figure.pose_freedoms)
    assert_allclose(finished.track.q[:, :2], still.q[:, :2], atol=0.01)
    assert_allclose(finished.track.q[:, 2:D], still.q[:, 2:D], atol=np.radians(2.0))
    assert_allclose(finished.track.joints() - way[:, None] - 100.0, still.joints(), atol=2.0)


def test_where_the_camera_zooms_and_rolls_place_and_size_in_the_scene_stay(clip, tmp_path):
    T, size, edge = len(clip), clip.images[0].shape[1::-1], cv2.BORDER_REFLECT_101
    zoom, roll = np.linspace(1.0, 1.25, T), 2.0 * np.sin(np.linspace(0.0, 4.0, T))
    ways = np.array([cv2.getRotationMatrix2D((250.0, 180.0), *each) for each in zip(roll, zoom, strict=True)])
    images = [cv2.warpAffine(clip.images[t], ways[t], size, borderMode=edge) for t in range(T)]
    job = Job(clip.video, {0: read_keypoints(clip.keypoints)[0]})
    still = follow(job, QUIET).track
    track = follow(replace(job, video=write_images(tmp_path / "zoomed", images)), QUIET).track
    assert_allclose(track.moved[:, 2], zoom, rtol=0.005)
    scene = [0, 1, track.figure.index("scale")]
    assert_allclose(track.q[:, scene], still.q[:, scene], atol=0.03)
    there = np.einsum("tij,tpj->tpi", ways[..., :2], still.joints()) + ways[:, None, :, 2]
    assert_allclose(track.joints(), there, atol=4.0)


def test_the_camera_is_told_where_the_figure_is_in_the_shifted_picture(clip, panned, monkeypatch):
    job, _ = panned
    told = []

    def follow_and_tell(camera, image, box=None, place=None):
        told.append(box)
        return follow_camera(camera, image, box, place)

    follow_camera = Camera.follow
    monkeypatch.setattr(Camera, "follow", follow_and_tell)
    follow(replace(job, start=0, settings=Settings(outline=False)), QUIET)
    assert len(told) == len(clip) - 1
    for t, (x0, y0, x1, y1) in enumerate(told, 1):
        for mark in job.marks[t].values():
            assert x0 < mark.x < x1
            assert y0 < mark.y < y1


def test_the_run_says_how_far_the_camera_moved(panned, finished, tmp_path):
    job, way = panned
    write_run(finished, tmp_path, QUIET)
    told = read_json(tmp_path / "run.json")["camera"]
    assert told["moves"] is True
    assert told["pixels"] == pytest.approx(np.linalg.norm(way - way[job.start], axis=1).max(), abs=NEAR)


def test_a_camera_taken_for_still_is_still(panned):
    job, _ = panned
    run = follow(replace(job, settings=Settings(camera=False), stop=6), QUIET)
    assert_array_equal(run.track.moved, np.tile(UNMOVED, (len(run.track), 1)))


def error(job):
    """Mean error at the marks, leg lengths."""
    return score(job.marks, places(follow(job, QUIET).track), 0).mean_error_leg


@pytest.fixture(scope="module")
def still(data_dir):
    """A real run before a camera that is still, and the error there."""
    source = data_dir / "video" / "fence_run_lr.mp4"
    marks = read_keypoints(source.with_name("fence_run_lr.keypoints.csv"))
    job = Job(source, marks, start=0, stop=max(marks))
    return job, error(job)


@pytest.mark.claims
@pytest.mark.parametrize("way", [sway(22, 16.0, 40), shake(22, 5.0)], ids=["pans", "shakes"])
def test_a_real_run_is_followed_as_well_when_the_camera_moves(way, still, tmp_path):
    job, settled = still
    source, marks = job.video, job.marks
    assert max(marks) == len(way) - 1
    images = [moved(frame.image, way[frame.index], border=110) for frame in islice(Video(source), len(way))]
    carry = {t: {n: carried(m, way[t] + 110.0) for n, m in of_frame.items()} for t, of_frame in marks.items()}
    shifted = replace(job, video=write_images(tmp_path / "moved", images), marks=carry)
    assert error(shifted) < settled + 0.005
    assert error(replace(shifted, settings=Settings(camera=False, outline=False))) > settled + 0.05


def moved(image, shift, *, border):
    """The picture with its scene further right and down by this much, within a mirrored border."""
    wide = cv2.copyMakeBorder(image, *[border] * 4, cv2.BORDER_REFLECT_101)
    way = np.float32([[1, 0, shift[0]], [0, 1, shift[1]]])
    size = wide.shape[1::-1]
    return cv2.warpAffine(wide, way, size, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)


def carried(mark, shift):
    return replace(mark, x=mark.x + shift[0], y=mark.y + shift[1])
