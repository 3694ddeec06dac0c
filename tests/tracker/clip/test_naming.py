"""Which leg is the nearer one, as templates and the film tell; and the start that a person makes."""

from dataclasses import replace

import numpy as np
import pytest

from tests.tracker.clip.filmed import QUIET, as_video
from tests.tracker.clips import write_images
from tests.tracker.outline.films import FRAMES, MIDDLE, UNIT, WALKER, a_walk, film
from tracker.clip.follow import follow
from tracker.clip.job import Following
from tracker.clip.naming import as_the_film_names, borne_out, marks_of, start_from, sure_of_leg
from tracker.clip.outlines import DOUBTED
from videos.frames import Video


def near_knees(one):
    return one.outline.joints[:, WALKER.joints.index("near_knee")]


@pytest.mark.parametrize("frame", [0, MIDDLE])
def test_names_that_are_right_are_borne_out_and_wrong_ones_exchanged(video, frame):
    right = a_walk().person(frame, named=2.5)
    heard = borne_out(right, video)
    assert heard.outline.named > 3.0
    assert sure_of_leg(heard)
    np.testing.assert_array_equal(near_knees(heard), near_knees(right))
    mended = borne_out(a_walk().person(frame, named=-0.2).exchanged, video)  # sure of wrong names, a little
    assert mended.outline.named > 0.5
    np.testing.assert_array_equal(near_knees(mended), near_knees(right))


def test_what_the_outline_heard_counts_too(video):
    one, other = (borne_out(a_walk().person(named=named), video).outline.named for named in (0.5, 2.5))
    assert other - one == pytest.approx(2.0)


def test_a_film_at_a_frame_rate_without_a_learned_model_is_heard_too(tmp_path):
    slow = a_walk().part(np.repeat(np.arange(FRAMES), 4))
    heard = borne_out(slow.person(4 * MIDDLE, named=0.5), as_video(slow.images, tmp_path, fps=300))
    assert heard.outline.named > 1.0


@pytest.mark.parametrize("filmed", [15.0, 60.0])
def test_slow_motion_is_heard_as_at_the_rate_that_it_was_filmed_at(filmed, tmp_path, monkeypatch):
    film, one = write_images(tmp_path / "film", a_walk().images), a_walk().person(MIDDLE, named=0.5)
    slow = borne_out(one, Video(film, rate=30.0 / filmed)).outline.named
    monkeypatch.setattr("videos.frames.USUAL_FPS", filmed)
    assert borne_out(one, Video(film)).outline.named == slow > 0.5


def test_frames_without_the_person_tell_nothing(rng, tmp_path):
    whole, inner = a_walk().person(MIDDLE, named=0.5), slice(MIDDLE - 6, MIDDLE + 7)
    one = replace(whole, first=inner.start, outline=whole.outline.part(inner))
    images = rng.integers(0, 256, a_walk().images.shape).astype(np.uint8)
    images[inner] = a_walk().images[inner]
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    told, alone = (
        borne_out(one, as_video(images, elsewhere)),
        borne_out(one, as_video(a_walk().images, tmp_path)),
    )
    assert told.outline.named == pytest.approx(alone.outline.named, abs=0.05)


def test_legs_that_look_the_same_stay_unsure(tmp_path):
    alike = film(np.random.default_rng(4), alike=True)
    assert not sure_of_leg(borne_out(alike.person(named=0.0), as_video(alike.images, tmp_path)))


def test_a_start_has_the_marks_of_its_person():
    one = a_walk().person(MIDDLE)
    start = start_from(one, "unsure")
    assert (start.frame, start.facing, start.near_leg) == (MIDDLE, 1, "unsure")
    assert start.marks == marks_of(one)
    for name, place in zip(WALKER.joints, a_walk().joints[MIDDLE], strict=True):
        assert (start.marks[name].x, start.marks[name].y) == pytest.approx(place, abs=0.006)


def found_job(path, one, told="sure"):
    return Following(model="cv").job(path, start_from(one, told))


def test_a_start_that_contradicts_the_film_is_exchanged_and_unsure(video):
    one = a_walk().person(MIDDLE)
    job, wrong = found_job(video.path, one), found_job(video.path, one.exchanged)
    run = follow(wrong, QUIET)
    assert run.job == as_the_film_names(wrong, 0.9)
    assert run.job.marks == job.marks
    assert run.job.found.nearer is job.found.nearer
    assert run.job.found.near_leg == "unsure"
    near = run.track.joints()[:, run.track.figure.joints.index("near_knee")]
    assert np.hypot(*(near - a_walk().joints[:, WALKER.joints.index("near_knee")]).T).mean() < 0.1 * UNIT
    assert follow(job, QUIET).job is job


def test_the_film_is_heard_only_where_it_clearly_says_something_of_a_found_start():
    job = found_job("walk.mp4", a_walk().person(MIDDLE))
    given, marked = found_job("walk.mp4", a_walk().person(), "given"), replace(job, found=None)
    assert as_the_film_names(job, DOUBTED) is job
    assert as_the_film_names(given, 0.9) is given
    assert as_the_film_names(marked, 0.9) is marked
    corrected = replace(job, marks=job.marks | {MIDDLE + 9: job.marks[MIDDLE]}, anchors=True)
    assert as_the_film_names(corrected, 0.9) is corrected
    doubted = as_the_film_names(job, 0.4)
    assert (doubted.marks, doubted.found.near_leg) == (job.marks, "unsure")
