"""A clip followed: every frame once, both ways from the start frame, with its own times."""

import json
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.tracker.clips import QUIET, read_csv, read_json, write_images, write_video
from tracker.clip import follow as follow_module
from tracker.clip import pictures as reel_module
from tracker.clip import plan as plan_module
from tracker.clip.again import Kept
from tracker.clip.follow import follow
from tracker.clip.job import Found, Job, Nearer
from tracker.clip.plan import FOUND, Seen, prepare
from tracker.clip.start import StartError
from tracker.progress import Progress
from tracker.report.results import write_run
from tracker.run.read import read_run
from tracker.settings import Settings
from tracker.tables.keypoints import Mark, read_keypoints
from videos import recall
from videos.frames import Video


@pytest.fixture(scope="module")
def job(clip):
    return Job(clip.video, read_keypoints(clip.keypoints), model="cv")


@pytest.fixture(scope="module")
def ahead(job):
    return follow(job, QUIET)


@pytest.fixture
def frames_read(monkeypatch):
    """Index of every frame decoded from now on."""
    read = []

    class Watched(Video):
        def _recalled(self):
            for index, picture in enumerate(super()._recalled()):
                read.append(index)
                yield picture

    monkeypatch.setattr(plan_module, "Video", Watched)
    return read


def test_every_frame_is_followed_from_the_start_frame_on(clip, ahead):
    assert ahead.frames == len(ahead.track) == len(clip)
    assert ahead.track.first == 0
    assert ahead.warnings == []
    hips = ahead.track.joints()[:, ahead.track.figure.joints.index("hip")]
    # Cloth hides the joints themselves; a tenth of the leg is less than a thigh's half width.
    assert np.hypot(*(hips - clip.joints["hip"]).T).max() < 0.1 * clip.leg_px


def test_progress_goes_on_with_every_frame_that_is_tracked(job, monkeypatch):
    seen, smoother = [], follow_module.smoothed

    def watched(tracker, estimates):
        """Say how many were counted when the smoother has had all and has given none."""
        yield from smoother(tracker, (seen.append(count[0]) or one for one in estimates))

    class Counted(Progress):
        @contextmanager
        def task(self, name, total):
            count[0] = 0
            yield lambda: count.__setitem__(0, count[0] + 1)

    count = [0]
    monkeypatch.setattr(follow_module, "smoothed", watched)
    follow(job, Counted("quiet"))
    assert seen == list(range(1, 11))


def test_frames_are_read_in_order_once_to_survey_them_and_once_to_follow(clip, job, frames_read):
    follow(replace(job, start=4), QUIET)
    # Opening a video decodes its first frame to learn the size.
    assert frames_read == [0, *range(len(clip)), *range(len(clip))]


def test_frames_before_the_start_are_followed_as_a_clip_that_runs_backwards(clip, job, tmp_path):
    middle, T = 4, len(clip)
    forth = replace(
        job, video=write_images(tmp_path / "forth", clip.images), start=middle, facing=1, smooth=False
    )
    mirrored = {T - 1 - t: marks for t, marks in job.marks.items()}
    back = replace(
        forth, video=write_images(tmp_path / "back", clip.images[::-1]), marks=mirrored, start=T - 1 - middle
    )
    one, other = follow(forth, QUIET).track, follow(back, QUIET).track
    # Constant velocity knows no direction of time, so both see the same pictures in the same order.
    assert_allclose(one.q, other.q[::-1], atol=1e-12)
    assert one.outcome == other.outcome[::-1]


@pytest.mark.parametrize("rate", [None, 2.0])
def test_the_frame_rate_of_images_is_said_to_be_assumed_unless_the_speed_is_given(rate, clip, job, tmp_path):
    run = follow(replace(job, video=write_images(tmp_path / "images", clip.images), rate=rate), QUIET)
    assert any("no frame rate, 30 is taken" in warning for warning in run.warnings) is (rate is None)


def test_what_is_known_at_a_frame_after_the_start_does_not_depend_on_what_was_before(clip, job, tmp_path):
    start = 3
    whole = write_images(tmp_path / "whole", clip.images)
    late = write_images(tmp_path / "late", clip.images[start:])
    one = follow(replace(job, video=whole, start=start, smooth=False), QUIET).track
    marks = {t - start: marks for t, marks in job.marks.items() if t >= start}
    other = follow(replace(job, video=late, marks=marks, start=0, smooth=False), QUIET).track
    assert_array_equal(one.q[start:], other.q)


def test_a_smoothed_start_is_surer_than_what_either_side_of_it_tells(clip, job, tmp_path):
    start = 4
    late = write_images(tmp_path / "late", clip.images[start:])
    marks = {t - start: marks for t, marks in job.marks.items() if t >= start}
    both = follow(replace(job, start=start), QUIET).track
    before = follow(replace(job, start=start, stop=start), QUIET).track
    after = follow(replace(job, video=late, marks=marks, start=0), QUIET).track
    angles = slice(2, 10)
    spreads = [np.diag(cov)[angles] for cov in (both.cov[start], before.cov[start], after.cov[0])]
    assert (spreads[0] < 0.999 * spreads[1]).all()
    assert (spreads[0] < 0.999 * spreads[2]).all()


def test_a_start_late_in_a_long_clip_keeps_few_pictures(clip, job, frames_read, monkeypatch):
    plain = follow(replace(job, start=8, anchors=True), QUIET).track
    alone = len(frames_read)
    monkeypatch.setattr(recall, "_last", {})
    monkeypatch.setattr(recall, "HELD", 0)
    monkeypatch.setattr(reel_module, "LEAST", 3)
    monkeypatch.setattr(reel_module, "BLOCK", 1)
    held = follow(replace(job, start=8, anchors=True), QUIET).track
    assert_array_equal(held.q, plain.q)
    # Frames 0 .. 7 are read again in blocks of three and two, each from the beginning.
    assert len(frames_read) - alone >= alone + 8 + 5 + 2


def broken_off(clip, folder):
    """The clip with a jump in the film: from frame 4 on the figure stands a leg and a half further left."""
    by = int(1.5 * clip.leg_px)
    moved = [np.roll(image, -by, axis=1) for image in clip.images[4:]]
    video = write_images(folder, [*clip.images[:4], *moved])
    places = {name: at - np.outer(np.arange(len(at)) >= 4, [by, 0]) for name, at in clip.joints.items()}
    marks = {t: {name: Mark(*at[t]) for name, at in places.items()} for t in (0, len(clip) - 1)}
    return video, marks, places


@pytest.mark.parametrize(("model", "smooth"), [("cv", True), ("walk-run", False)])
def test_an_anchor_gets_a_lost_figure_back_and_the_frames_before_it_too(model, smooth, clip, job, tmp_path):
    video, marks, places = broken_off(clip, tmp_path / "jump")
    lost = replace(job, video=video, marks=marks, model=model, smooth=smooth)
    away = {}
    for anchors in (False, True):
        track = follow(replace(lost, anchors=anchors), QUIET, seen=Seen({})).track  # which tells no cut
        truth = np.stack([places[name] for name in track.figure.joints], axis=1)
        away[anchors] = np.linalg.norm(track.joints() - truth, axis=-1).mean(1) / clip.leg_px
    assert away[False][5:].min() > 0.3
    assert away[True].max() < 0.15
    assert len(away[True]) == len(clip)


def test_anchors_before_the_start_are_passed_through_as_well(clip, job):
    spoiled = {t: dict(job.marks[t]) for t in (0, 5)}
    spoiled[0] = {name: replace(mark, y=mark.y - 8.0) for name, mark in spoiled[0].items()}
    tracks = [
        follow(replace(job, marks=spoiled, start=5, anchors=anchors), QUIET).track
        for anchors in (False, True)
    ]
    hip = tracks[0].figure.joints.index("hip")
    plain, drawn = (track.joints()[:, hip, 1] for track in tracks)
    assert drawn[0] < plain[0] - 4.0
    assert_allclose(drawn[6:], plain[6:], atol=2.0)


def test_without_anchors_other_marked_frames_are_not_looked_at(clip, job):
    one = {0: job.marks[0]}
    assert_array_equal(follow(replace(job, marks=one, facing=1), QUIET).track.q, follow(job, QUIET).track.q)


@pytest.mark.parametrize(("start", "stop"), [(3, 5), (5, 5), (0, 0), (2, 999)])
def test_the_stop_frame_is_the_last_one_followed(clip, job, start, stop):
    finished = follow(replace(job, start=start, stop=stop), QUIET)
    assert finished.frames == len(finished.track) == min(stop + 1, len(clip))


def test_nothing_past_the_stop_frame_is_read(job, frames_read):
    follow(replace(job, stop=3), QUIET)
    assert max(frames_read) == 3


def test_a_run_ends_at_a_cut_though_nobody_stands_out_before_it(job):
    run = follow(job, QUIET, seen=Seen({}, shot=(None, 5)))
    assert len(run.track) == 6
    assert any("from frame 6 on another scene is shown" in warning for warning in run.warnings)


@pytest.mark.parametrize("stop", [None, 4, 1000])
def test_progress_counts_the_frames_that_there_are_once_both_ways(stop, job, clip, capsys):
    follow(replace(job, start=4, stop=stop), Progress("json"))
    news = [json.loads(line) for line in capsys.readouterr().err.splitlines()]
    whole = 5 if stop == 4 else len(clip)
    told = [each for each in news if "with cv" in each.get("task", "")]
    assert {each["total"] for each in told} == {whole} == {told[-1]["done"]}


@pytest.mark.parametrize(("start", "first"), [(5, 3), (5, 5), (None, 2)])
def test_a_part_of_the_film_is_followed_as_in_the_whole(clip, job, start, first):
    whole = follow(replace(job, start=start or 4), QUIET).track
    part = follow(
        replace(job, marks={4: job.marks[4], 0: job.marks[0], 5: job.marks[5]}, start=start, from_=first),
        QUIET,
    )
    track = part.track
    assert (track.first, part.frames, len(track)) == (first, len(clip), len(clip) - first)
    np.testing.assert_allclose(track.times, whole.times[first:])
    away = np.hypot(*np.moveaxis(track.joints() - whole.joints()[first:], -1, 0)) / track.view.unit
    assert away.max() < 0.05


def test_the_folder_of_a_part_keeps_the_films_frames(job, clip, tmp_path):
    finished = follow(replace(job, from_=3, stop=6), QUIET)
    write_run(finished, tmp_path, QUIET)
    rows = read_csv(tmp_path / "pose.csv")
    assert [(row["frame"], row["outcome"] != "") for row in rows] == [(str(t), t >= 3) for t in range(7)]
    record = read_run(tmp_path)
    assert np.isnan(record.poses[:3]).all()
    assert np.isfinite(record.poses[3:, 2:8]).all()
    assert len(list(Video(tmp_path / "overlay.mp4"))) == 4


def test_a_start_before_the_part_is_refused(job):
    with pytest.raises(StartError, match="--from 6 comes after the start frame 4; choose an earlier --from"):
        prepare(replace(job, start=4, from_=6))
    with pytest.raises(StartError, match="no frame from 90 on is marked; choose an earlier --from"):
        prepare(replace(job, from_=90))


def test_a_stop_before_the_start_is_refused(job):
    with pytest.raises(StartError, match="--stop 2 comes before the start frame 4"):
        prepare(replace(job, start=4, stop=2))


def test_frames_keep_their_own_times(clip, job, tmp_path):
    # Multiples of 1/90 s and of 1/90000 s, so that the file's clock holds them exactly.
    times = [2.0 + t / 30.0 + (t % 3) / 90.0 for t in range(len(clip))]
    write_video(tmp_path / "uneven.mp4", clip.images, times)
    finished = follow(replace(job, video=tmp_path / "uneven.mp4"), QUIET)
    assert_allclose(finished.track.times, np.array(times) - times[0], atol=2e-5)
    write_run(finished, tmp_path, QUIET)
    assert [float(row["time_s"]) for row in read_csv(tmp_path / "pose.csv")] == pytest.approx(
        finished.track.times, abs=1e-6
    )
    drawn = [frame.time for frame in Video(tmp_path / "overlay.mp4")]
    assert np.diff(drawn) == pytest.approx(np.diff(times), abs=2e-5)


def test_frames_before_the_first_that_is_followed_keep_their_own_times_too(clip, job, tmp_path):
    times = [t / 30.0 if t < 2 else 1.0 + t / 30.0 for t in range(len(clip))]
    write_video(tmp_path / "late.mp4", clip.images, times)
    write_run(follow(replace(job, video=tmp_path / "late.mp4", start=4, from_=4), QUIET), tmp_path, QUIET)
    told = [float(row["time_s"]) for row in read_csv(tmp_path / "pose.csv")]
    assert told == pytest.approx(times, abs=1e-4)
    assert_allclose(read_run(tmp_path).times, times, atol=1e-4)


def test_a_marked_frame_beyond_the_film_is_said_where_its_marks_do_not_tell_the_facing(clip, job):
    bare = {name: mark for name, mark in job.marks[0].items() if "toe" not in name and name != "far_ankle"}
    with pytest.raises(StartError, match=r"frame 500 is not in walk\.mp4, which has"):
        follow(replace(job, marks={500: bare}, start=500), QUIET)


def test_of_a_video_cut_short_what_was_read_is_followed_and_it_is_said(clip, job, tmp_path):
    write_video(tmp_path / "long.mp4", clip.images * 2)
    data = (tmp_path / "long.mp4").read_bytes()
    (tmp_path / "cut.mp4").write_bytes(data[: len(data) // 2])
    finished = follow(replace(job, video=tmp_path / "cut.mp4"), QUIET)
    (warning,) = [text for text in finished.warnings if "cut.mp4" in text]
    assert warning == f"cut.mp4 ends after {finished.frames} of about 20 frames; what was read was used"
    assert 3 < finished.frames == len(finished.track) < 18
    corrected = follow(finished.job, QUIET, Kept(finished.track, anew=(1, 1), span=(0, 1)))
    assert corrected.warnings == finished.warnings  # of all frames, though one alone is followed again


def test_the_first_marked_frame_is_the_start_unless_told(job):
    marks = {t: marked for t, marked in job.marks.items() if t in (2, 7)}
    assert prepare(replace(job, marks=marks)).start.view == prepare(replace(job, start=2)).start.view


def test_a_start_pose_may_leave_the_picture_but_not_with_its_hip(job):
    def moved(name):
        """All of it, until this joint is below the picture."""
        by = 275.0 - job.marks[0][name].y
        return {joint: replace(mark, y=mark.y + by) for joint, mark in job.marks[0].items()}

    lowest = max(job.marks[0], key=lambda name: job.marks[0][name].y)
    assert prepare(replace(job, marks={0: moved(lowest)})).start.known.all()
    with pytest.raises(StartError, match=r"lies outside the picture .* \(.*hip.*\)"):
        prepare(replace(job, marks={0: moved("hip")}))


def test_a_start_pose_that_cannot_be_right_is_refused_with_the_frame_and_the_reason(job):
    knee = job.marks[4]["near_knee"]
    wrong = job.marks[4] | {"near_knee": replace(knee, y=knee.y + 60.0)}
    with pytest.raises(StartError, match="mark the start again at frame 4: from hip to near_knee is"):
        prepare(replace(job, marks={4: wrong}))


@pytest.mark.parametrize(("asked", "want"), [(0.03, FOUND), (0.08, 0.08)])
def test_joints_that_nobody_marked_are_less_sure_than_marked_ones(job, asked, want):
    settings = Settings(mark=asked)
    found = Found(0, job.marks[0], 1, Nearer.AHEAD, "sure")
    assert prepare(replace(job, settings=settings)).tracker.settings.mark == asked
    assert prepare(replace(job, settings=settings, found=found)).tracker.settings.mark == want


@pytest.mark.parametrize("facing", [1, -1, None])
def test_facing_is_seen_from_the_marks_unless_told(job, facing):
    upright = {"head_top": (200.0, 20.0), "neck": (200.0, 40.0), "hip": (200.0, 90.0)}
    bent = {"knee": (203.0, 140.0), "ankle": (200.0, 190.0)}
    legs = {f"{side}_{joint}": place for side in ("near", "far") for joint, place in bent.items()}
    marks = {0: {name: Mark(*place) for name, place in (upright | legs).items()}}
    assert prepare(replace(job, marks=marks, facing=facing)).start.view.facing == (facing or 1)


@pytest.mark.parametrize("model", ["walk-run-1", "cv"])
def test_slow_motion_is_followed_as_at_the_rate_that_it_was_filmed_at(
    model, job, clip, tmp_path, monkeypatch
):
    images = replace(job, video=write_images(tmp_path / "images", clip.images), model=model)
    slow = follow(replace(images, rate=0.25), QUIET)
    monkeypatch.setattr("videos.frames.USUAL_FPS", 120.0)
    real = follow(replace(images, rate=1.0), QUIET)
    assert_array_equal(slow.track.q, real.track.q)
    assert_array_equal(slow.track.cov, real.track.cov)
    assert slow.track.motions == real.track.motions
    assert (slow.fps, real.fps) == (30.0, 120.0)
    assert_allclose(slow.track.times, 4.0 * real.track.times)


def test_the_overlay_shows_what_was_followed(clip, ahead, tmp_path):
    write_run(ahead, tmp_path, QUIET)
    drawn = list(Video(tmp_path / "overlay.mp4"))
    assert len(drawn) == len(clip)
    knees = ahead.track.joints()[:, ahead.track.figure.joints.index("near_knee")]
    for frame, (x, y) in zip(drawn, np.rint(knees).astype(int), strict=True):
        red, _, blue = frame.image[y, x].astype(int)
        assert red - blue > 90  # orange; trousers 45


def test_run_json_holds_the_settings_and_may_call_the_video_by_another_name(ahead, tmp_path):
    write_run(replace(ahead, job=replace(ahead.job, called="there/walk.mp4")), tmp_path, QUIET)
    written = read_json(tmp_path / "run.json")
    assert written["video"] == "there/walk.mp4"
    assert Settings(**written["settings"]) == ahead.job.settings
