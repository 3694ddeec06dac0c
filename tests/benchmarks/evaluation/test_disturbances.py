"""Disturbances do what their names say, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.benchmarks.evaluation.disturbances import (
    DISTURBANCES,
    Film,
    behind_hedge,
    compressed,
    dimmed,
    every_second,
    guessed,
    moved,
    noisy,
    read_film,
    write_film,
)
from tracker.tables.keypoints import Mark
from videos.frames import Video


@pytest.fixture
def film(rng):
    """Thirty grey pictures with a little grain."""
    images = [
        np.full((50, 61, 3), 120, np.uint8) + rng.integers(0, 9, (50, 61, 3), np.uint8) for _ in range(30)
    ]
    return Film(images, 29.97, {t: {"hip": Mark(10.0 + t, 20.0)} for t in (0, 5, 10, 15)})


def test_a_film_comes_back_from_its_file_pixel_by_pixel_at_its_own_rate(film, tmp_path):
    for name, one in (("whole", film), ("half", every_second(film))):
        write_film(one, tmp_path / f"{name}.mov")
        back = read_film(tmp_path / f"{name}.mov", {len(one.images) - 1: {}})
        assert_array_equal(back.images, one.images)
        assert back.fps == pytest.approx(one.fps, rel=1e-3)
        times = [frame.time for frame in Video(tmp_path / f"{name}.mov")]
        assert_allclose(np.diff(times), 1.0 / one.fps, atol=1e-3)


def test_a_film_ends_at_the_last_marked_frame(film, tmp_path):
    write_film(film, tmp_path / "film.mov")
    assert len(read_film(tmp_path / "film.mov", film.marks).images) == 16


def test_of_every_second_frame_the_marks_stay_on_their_pictures(film):
    half = every_second(film)
    assert half.fps == film.fps / 2
    assert sorted(half.marks) == [0, 5]
    for frame, row in half.marks.items():
        assert half.images[frame] is film.images[2 * frame]
        assert row == film.marks[2 * frame]


def test_light_falls_evenly_to_a_half_and_stays(film):
    dark = dimmed(film)
    shares = [after.mean() / before.mean() for after, before in zip(dark.images, film.images, strict=True)]
    # Rounding to whole grey levels.
    assert_allclose(shares[:21], np.linspace(1.0, 0.5, 21), atol=0.005)
    assert_allclose(shares[21:], 0.5, atol=0.005)


def test_noise_has_ten_grey_levels_and_no_mean_and_is_new_in_every_frame(film):
    added = np.stack(noisy(film).images).astype(float) - np.stack(film.images)
    assert added.std() == pytest.approx(10.0, rel=0.02)
    assert added.mean() == pytest.approx(0.0, abs=0.1)
    assert abs(np.corrcoef(added[0].ravel(), added[1].ravel())[0, 1]) < 0.05


def test_noise_is_the_same_in_every_run(film):
    assert_array_equal(noisy(film).images, noisy(film).images)


def test_jpeg_loses_detail_and_keeps_colours(film):
    film.images[0][:25] = (200, 40, 90)
    seen = compressed(film).images[0].astype(int)
    assert not np.array_equal(seen, film.images[0])
    assert_allclose(seen[5:15, 5:55].mean((0, 1)), (200, 40, 90), atol=4.0)


@pytest.mark.parametrize("name", [name for name in DISTURBANCES if name != "every second frame"])
def test_no_other_disturbance_touches_marks_or_rate(film, name):
    done = DISTURBANCES[name](film)
    assert (done.fps, done.marks, len(done.images)) == (film.fps, film.marks, len(film.images))


def test_marks_move_by_three_pixels_either_way_and_stay_seen_or_hidden(rng):
    row = {str(i): Mark(50.0, 80.0, visible=i % 2 == 0) for i in range(4000)}
    after = moved(row, rng)
    x, y = np.array([(mark.x - 50.0, mark.y - 80.0) for mark in after.values()]).T
    assert_allclose([x.std(), y.std()], 3.0, rtol=0.04)
    assert abs(np.corrcoef(x, y)[0, 1]) < 0.05
    assert [mark.visible for mark in after.values()] == [mark.visible for mark in row.values()]


def walk(film, *, hip, last):
    """The film with a leg 10 px long and a hip that goes from one column to the other."""
    first = {
        "hip": Mark(hip, 20.0),
        "near_knee": Mark(hip, 25.0),
        "near_ankle": Mark(hip, 30.0),
        "far_knee": Mark(hip - 6.0, 20.0),
        "far_ankle": Mark(hip - 6.0, 24.0),
    }
    return replace(film, marks={0: first, 15: {"hip": Mark(last, 20.0)}})


@pytest.mark.parametrize(("last", "columns"), [(50.0, (20, 36)), (10.0, (24, 40))])
def test_a_hedge_hides_the_feet_and_more_behind_than_ahead_and_nothing_else(film, last, columns):
    hidden = behind_hedge(walk(film, hip=30.0, last=last))
    there = np.zeros((50, 61), bool)
    there[28:, columns[0] : columns[1] + 1] = True  # from 7.2 px below the hip, 11 px behind, 7 px ahead
    for before, after in zip(film.images, hidden.images, strict=True):
        assert_array_equal(after[~there], before[~there])
        assert_array_equal(after[there], hidden.images[0][there])
    red, green, blue = hidden.images[0][there].T.astype(int)
    assert ((green > red) & (red > blue)).all()
    assert green.std() > 10.0


def test_a_hedge_is_the_same_in_every_run_and_leaves_marks_and_rate(film):
    walker = walk(film, hip=30.0, last=50.0)
    hidden = behind_hedge(walker)
    assert_array_equal(hidden.images, behind_hedge(walker).images)
    assert (hidden.fps, hidden.marks) == (walker.fps, walker.marks)


def test_a_guess_is_four_pixels_off_either_way_and_not_visible(rng):
    row = {str(i): Mark(50.0, 80.0) for i in range(8000)}
    joints = [str(i) for i in range(4000)]
    after = guessed(row, joints, rng)
    assert list(after) == list(row)
    x, y = np.array([(after[name].x - 50.0, after[name].y - 80.0) for name in joints]).T
    assert_allclose([x.std(), y.std()], 4.0, rtol=0.04)
    assert abs(np.corrcoef(x, y)[0, 1]) < 0.05
    assert not any(after[name].visible for name in joints)
    assert all(after[name] is row[name] for name in row.keys() - set(joints))
