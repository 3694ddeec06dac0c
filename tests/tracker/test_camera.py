"""A moving camera: painted scenes shifted by known parts of pixels, with something that walks before them."""

from dataclasses import replace
from itertools import islice
from time import perf_counter

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.tracker.clips import read_json
from tracker import clip as clip_module
from tracker.camera import first_camera
from tracker.clip import Job, follow, write_run
from tracker.compare import places, score
from tracker.keypoints import read_keypoints
from tracker.progress import Progress
from tracker.settings import Settings
from videos.frames import Video

QUIET = Progress("quiet")
NOWHERE = (-20.0, -20.0, -10.0, -10.0)
# A tenth of a pixel of the small picture, which is 160 wide, of videos 640 wide.
NEAR = 0.4


class Waves:
    """A grey scene made of waves, which has a value at every point; a wall has none that are strong."""

    def __init__(self, rng, *, contrast=10.0, waves=40, wavelengths=(25.0, 160.0)):
        length, turn = rng.uniform(*wavelengths, waves), rng.uniform(0.0, 2.0 * np.pi, waves)
        self.number = 2.0 * np.pi / length * np.stack([np.cos(turn), np.sin(turn)])
        self.phase = rng.uniform(0.0, 2.0 * np.pi, waves)
        self.contrast = contrast

    def picture(self, shift=(0.0, 0.0), size=(640, 480)):
        """(H, W, 3) grey levels of the scene that lies this much further right and down."""
        x, y = (np.arange(n) - d for n, d in zip(size, shift, strict=True))
        across, down = (np.outer(a, k) for a, k in zip((x, y), self.number, strict=True))
        wave = np.exp(1j * (down + self.phase)) @ np.exp(1j * across).T
        return np.repeat((125.0 + self.contrast * wave.real)[..., None], 3, axis=-1)


def stored(picture, *, noise=0.0, rng=None):
    if noise > 0.0:
        picture = picture + rng.normal(scale=noise, size=picture.shape[:2])[..., None]
    return np.clip(np.round(picture), 0, 255).astype(np.uint8)


def walker(picture, t, *, x=None):
    """The picture with a chequered figure at frame t, 11 px a frame, and the box around it."""
    left = int(60 + 11 * t if x is None else x)
    squares = 230.0 * ((np.arange(260)[:, None] // 12 + np.arange(90) // 12) % 2)
    out = picture.copy()
    out[150:410, left : left + 90] = squares[..., None][:, : out.shape[1] - left]
    return out, (left - 15.0, 135.0, left + 105.0, 425.0)


def shifts(frames):
    """(T, 2) of pictures and boxes in turn."""
    (image, box), *rest = frames
    cameras = [first_camera(image, box)]
    for image, box in rest:
        cameras.append(cameras[-1].follow(image, box))
    return np.stack([camera.shift for camera in cameras])


@pytest.fixture(scope="module")
def scene():
    return Waves(np.random.default_rng(4))


def sway(T, speed, period):
    """(T, 2) back and forth at up to this many pixels a frame, a third of it up and down."""
    turn = 2.0 * np.pi * np.arange(T) / period
    reach = speed * period / (2.0 * np.pi)
    return reach * np.stack([np.sin(turn), (np.cos(turn) - 1.0) / 3.0], axis=1)


@pytest.mark.parametrize("speed", [0.3, 2.0, 8.0, 14.0], ids="{} px a frame".format)
def test_a_pan_is_measured_to_parts_of_pixels_behind_a_walker(speed, scene, rng):
    truth = sway(40, speed, 40)
    pictures = (walker(scene.picture(shift), t) for t, shift in enumerate(truth))
    found = shifts((stored(picture, noise=3.0, rng=rng), box) for picture, box in pictures)
    moved = np.maximum.accumulate(np.abs(truth).max(1)) > 1.5
    assert np.abs(found - truth)[moved].max() < NEAR
    assert np.abs(found - truth).max() < 1.5


def test_a_long_pan_goes_through_many_key_frames_without_losing_its_way(scene):
    truth = np.outer(np.arange(80), (7.3, -0.4))
    found = shifts((stored(scene.picture(shift)), NOWHERE) for shift in truth)
    # 584 px at a new key frame every half picture or so.
    assert_allclose(found[-1], truth[-1], atol=1.5)


@pytest.mark.parametrize("noise", [0.0, 3.0, 10.0])
def test_a_still_camera_reads_exactly_zero_whoever_walks_by(noise, scene, rng):
    still = scene.picture()
    pictures = (walker(still, t) for t in range(40))
    found = shifts((stored(picture, noise=noise, rng=rng), box) for picture, box in pictures)
    assert_array_equal(found, 0.0)


@pytest.mark.parametrize("noise", [0.0, 2.0, 10.0, 40.0])
def test_a_flat_wall_and_pure_noise_read_exactly_zero(noise, rng):
    wall = np.full((480, 640, 3), 150.0)
    pictures = (walker(wall, t) for t in range(40))
    assert_array_equal(shifts((stored(p, noise=noise, rng=rng), box) for p, box in pictures), 0.0)


def test_a_figure_before_a_flat_wall_is_no_camera_even_where_it_is_not_expected():
    wall = np.full((480, 640, 3), 150.0)
    assert_array_equal(shifts((stored(walker(wall, t)[0]), NOWHERE) for t in range(40)), 0.0)


def test_what_moves_within_the_box_says_nothing(scene):
    bare = Waves(np.random.default_rng(4), contrast=5.0)
    truth = sway(20, 3.0, 40)
    loud = [walker(bare.picture(shift), t, x=200 + 9 * t) for t, shift in enumerate(truth)]
    plain = [(bare.picture(shift), box) for shift, (_, box) in zip(truth, loud, strict=True)]
    for frames in (loud, plain):
        assert np.abs(shifts((stored(p), box) for p, box in frames) - truth)[3:].max() < NEAR


def test_others_who_walk_through_the_scene_do_not_carry_it_along(scene):
    truth = sway(40, 4.0, 40)
    pictures = []
    for t, shift in enumerate(truth):
        one, box = walker(scene.picture(shift), t)
        other, _ = walker(one, t, x=max(540 - 9 * t, 0))
        pictures.append((stored(other), box))
    assert np.abs(shifts(pictures) - truth)[3:].max() < NEAR


def test_a_frame_that_repeats_the_one_before_moves_nothing(scene):
    way = np.repeat(np.arange(12), 2)[:, None] * (6.5, 0.0)
    found = shifts((stored(scene.picture(shift)), NOWHERE) for shift in way)
    assert np.abs(found[1::2] - found[::2]).max() < 0.05
    assert_allclose(found[-1], way[-1], atol=NEAR)


@pytest.mark.parametrize("speed", [0.0, 5.0])
def test_light_that_halves_is_no_motion_and_hides_none(speed, scene):
    truth = sway(30, speed, 40)
    light = np.interp(np.arange(30), (5, 25), (1.0, 0.5))
    found = shifts((stored(a * scene.picture(s)), NOWHERE) for a, s in zip(light, truth, strict=True))
    if speed:
        assert np.abs(found - truth)[2:].max() < 2.0 * NEAR
    else:
        assert_array_equal(found, 0.0)


def test_while_nothing_is_seen_the_shift_stays_and_then_catches_up(scene):
    way = np.arange(20)[:, None] * (4.0, 0.0)
    frames = [(stored(scene.picture(shift)), NOWHERE) for shift in way]
    frames[10:13] = [(np.zeros_like(image), box) for image, box in frames[10:13]]
    found = shifts(frames)
    assert_array_equal(found[10:13], np.broadcast_to(found[9], (3, 2)))
    assert_allclose(found[13:], way[13:], atol=NEAR)


def test_a_cut_to_another_scene_leaves_the_shift_and_goes_on_from_there(scene):
    way = np.arange(10)[:, None] * (3.0, 0.0)
    other = Waves(np.random.default_rng(9))
    found = shifts((stored(view.picture(shift)), NOWHERE) for view in (scene, other) for shift in way)
    assert_array_equal(found[10], found[9])
    assert_allclose(found[-1] - found[10], way[-1], atol=NEAR)


@pytest.mark.parametrize("size", [(160, 120), (333, 251), (270, 480), (1280, 720), (9, 7), (3000, 40)])
def test_pictures_of_any_size_are_measured_in_their_own_pixels(size):
    factor = max(size) / 160
    wide = Waves(np.random.default_rng(1), wavelengths=(6.0 * factor, 40.0 * factor))
    truth = np.outer(np.arange(8), (0.6, -0.4)) * factor
    found = shifts((stored(wide.picture(shift, size)), NOWHERE) for shift in truth)
    if min(size) < 100:  # too few corners to believe
        assert_array_equal(found, 0.0)
    else:
        assert np.abs(found - truth)[1:].max() < 0.15 * factor


@pytest.fixture(scope="module")
def panned(clip, tmp_path_factory):
    """The rendered walk seen by a camera that pans, its job, and the scene's shift in every frame."""
    folder = tmp_path_factory.mktemp("panned")
    way = sway(len(clip), 6.0, 16)
    for t, (image, shift) in enumerate(zip(clip.images, way, strict=True)):
        cv2.imwrite(str(folder / f"{t}.png"), moved(image, shift)[..., ::-1])
    marks = {
        t: {name: carried(mark, way[t]) for name, mark in of_frame.items()}
        for t, of_frame in read_keypoints(clip.keypoints).items()
    }
    return Job(folder, marks, "walk-run", start=4), way


@pytest.fixture(scope="module")
def finished(panned):
    return follow(panned[0], QUIET)


def test_a_run_is_in_the_scene_s_frame_both_ways_from_its_start(clip, panned, finished):
    job, way = panned
    assert_allclose(finished.track.shift, way - way[job.start], atol=NEAR)
    still = follow(replace(job, video=clip.video, marks=read_keypoints(clip.keypoints)), QUIET).track
    assert_array_equal(still.shift, 0.0)
    # The picture is resampled and the shift off by parts of a pixel: a hundredth of a leg, two degrees.
    D = len(still.figure.pose_freedoms)
    assert_allclose(finished.track.q[:, :2], still.q[:, :2], atol=0.01)
    assert_allclose(finished.track.q[:, 2:D], still.q[:, 2:D], atol=np.radians(2.0))
    assert_allclose(finished.track.joints() - way[:, None], still.joints(), atol=2.0)


def test_the_run_says_how_far_the_camera_moved(panned, finished, tmp_path):
    job, way = panned
    write_run(finished, tmp_path, QUIET)
    told = read_json(tmp_path / "run.json")["camera"]
    assert told["moves"] is True
    assert told["pixels"] == pytest.approx(np.linalg.norm(way - way[job.start], axis=1).max(), abs=NEAR)


def test_a_camera_taken_for_still_is_still(panned):
    job, _ = panned
    run = follow(replace(job, settings=Settings(camera=False), stop=6), QUIET)
    assert_array_equal(run.track.shift, 0.0)


def test_a_real_run_is_followed_as_well_when_the_camera_pans(data_dir, monkeypatch):
    source = data_dir / "video" / "fence_run_lr.mp4"
    marks = read_keypoints(source.with_name("fence_run_lr.keypoints.csv"))
    way = sway(max(marks) + 1, 16.0, 40)

    class Panned(Video):
        def __iter__(self):
            for frame in islice(super().__iter__(), len(way)):
                yield replace(frame, image=moved(frame.image, way[frame.index], border=110))

    def error(job):
        return score(job.marks, places(follow(job, QUIET).track), 0).mean_error_leg

    still = Job(source, marks, "walk-run", start=0, stop=max(marks))
    settled = error(still)
    monkeypatch.setattr(clip_module, "Video", Panned)
    carry = {t: {n: carried(m, way[t] + 110.0) for n, m in of_frame.items()} for t, of_frame in marks.items()}
    panned = replace(still, marks=carry)
    assert error(panned) < settled + 0.005
    assert error(replace(panned, settings=Settings(camera=False))) > settled + 0.05


def moved(image, shift, border=0):
    """The picture with its scene further right and down by this much, within a mirrored border."""
    wide = cv2.copyMakeBorder(image, *[border] * 4, cv2.BORDER_REFLECT_101)
    way = np.float32([[1, 0, shift[0]], [0, 1, shift[1]]])
    size = wide.shape[1::-1]
    return cv2.warpAffine(wide, way, size, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)


def carried(mark, shift):
    return replace(mark, x=mark.x + shift[0], y=mark.y + shift[1])


@pytest.mark.speed
def test_it_costs_less_than_the_whole_frame_s_conversion_to_lab(scene, rng):
    images = [stored(scene.picture(shift), noise=3.0, rng=rng) for shift in sway(20, 4.0, 40)]

    def seconds(run):
        began = perf_counter()
        run()
        return perf_counter() - began

    frames = [(image, NOWHERE) for image in images]
    ours = min(seconds(lambda: shifts(frames)) for _ in range(5))
    lab = min(seconds(lambda: [cv2.cvtColor(image, cv2.COLOR_RGB2Lab) for image in images]) for _ in range(5))
    assert ours < lab
