"""The people of a film as a table, a line each and a picture."""

import cv2
import numpy as np
import pytest

from tests.tracker.clips import read_csv, write_video
from tests.tracker.outline.films import MIDDLE, UNIT, a_walk
from tracker.clip.naming import nearer
from tracker.report.walkers import COLUMNS, HEIGHT, SURENESS, box, listed, write_people, write_picture
from videos.frames import Video


@pytest.fixture
def two():
    """One who walks to the right, and one who goes backwards, faces left, and whose legs look alike."""
    walk = a_walk()
    return [walk.person(), walk.mirrored().person(frame=5, named=0.5, turned=0.123).in_film(7, 1)]


def test_the_table_has_a_row_a_person_with_box_ways_and_how_sure_they_are(two, tmp_path):
    write_people(tmp_path / "p.csv", two)
    one, other = read_csv(tmp_path / "p.csv")
    assert tuple(one) == COLUMNS + SURENESS
    left, top, right, bottom = (int(one[name]) for name in ("x0", "y0", "x1", "y1"))
    low, high = a_walk().joints[MIDDLE].min(0), a_walk().joints[MIDDLE].max(0)
    assert np.all(np.abs([left, top] - low) <= 0.5)
    assert np.all(np.abs([right, bottom] - high) <= 0.5)
    last = len(a_walk().q) - 1
    numbers = ("person", "first", "last", "frame", "near_sure")
    assert [int(one[name]) for name in numbers] == [1, 0, last, MIDDLE, 1]
    assert [int(other[name]) for name in numbers] == [2, 7, last + 7, 12, 0]
    assert (one["facing"], one["direction"], one["motion"]) == ("right", "right", "walk")
    assert (other["facing"], other["direction"]) == ("left", "right")
    assert (other["margin"], other["score"], other["near_leg"]) == ("0.12", "1.00", str(nearer(two[1])))


def test_nobody_is_a_table_without_rows_and_a_line(tmp_path):
    write_people(tmp_path / "p.csv", [])
    assert (tmp_path / "p.csv").read_text(encoding="utf-8").splitlines() == [",".join(COLUMNS + SURENESS)]
    assert listed([], "film.mp4") == "nobody walks through film.mp4"


def test_a_line_says_when_how_and_which_leg_and_what_is_not_sure(two):
    last = len(a_walk().q) - 1
    one, other = listed(two, "film.mp4").splitlines()
    assert one == (
        f"person 1: frames 0 to {last}, walk, faces right; "
        f"in frame {MIDDLE} the nearer leg is {nearer(two[0])}"
    )
    assert other == (
        f"person 2: frames 7 to {last + 7}, walk backwards, faces left; "
        f"in frame 12 the nearer leg is {nearer(two[1])} (not sure)"
    )


@pytest.mark.parametrize(("direction", "words"), [(1, "walk,"), (0, "walk,"), (-1, "walk backwards,")])
def test_only_who_goes_against_the_facing_walks_backwards(direction, words):
    assert words in listed([a_walk().person(direction=direction)], "film.mp4")


def test_the_picture_shows_each_in_the_frame_to_start_from(tmp_path):
    walk = a_walk()
    write_video(tmp_path / "film.mp4", walk.images)
    people = [walk.person(), walk.person(frame=5)]
    write_picture(tmp_path / "p.png", people, Video(tmp_path / "film.mp4"))
    drawn = cv2.imread(str(tmp_path / "p.png"))
    width = round(walk.images.shape[2] * HEIGHT / walk.images.shape[1])
    assert drawn.shape == (HEIGHT, 2 * width, 3)
    for tile, one in enumerate(people):
        plain = cv2.resize(walk.images[one.frame][..., ::-1], (width, HEIGHT), interpolation=cv2.INTER_AREA)
        off = np.abs(drawn[:, tile * width : (tile + 1) * width].astype(float) - plain).max(2) > 60.0
        by = HEIGHT / walk.images.shape[1]
        left, top, right, bottom = (int(by * each) for each in box(one))
        inside = off[top:bottom, left:right]
        assert inside.sum() > 0.02 * (by * UNIT) ** 2
        assert off[top:, : left - 20].sum() == 0
