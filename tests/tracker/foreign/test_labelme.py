"""labelme files: half a pixel's difference, groups, flags, and what is refused."""

import json

import pytest

from tests.tracker.people import WALKER, labelme
from tracker.foreign.labelme import read_people
from tracker.foreign.people import Sighting
from tracker.foreign.text_files import ForeignError


def write(path, shape):
    path.write_text(json.dumps({"shapes": [shape]}))
    return path


def test_the_centre_of_the_top_left_pixel_is_our_zero(tmp_path):
    point = {"label": "hip", "points": [[0.5, 0.5]], "shape_type": "point"}
    assert read_people(write(tmp_path / "a.json", point)) == {0: [{"hip": Sighting(0.0, 0.0)}]}


def test_people_are_told_apart_by_their_group(tmp_path):
    people = read_people(labelme(tmp_path / "a.json", [WALKER, {"hip": (1.0, 2.0)}]))
    assert [len(person) for person in people[12]] == [len(WALKER), 1]


def test_two_people_in_one_group_are_refused(tmp_path):
    path = labelme(tmp_path / "a.json", [WALKER, WALKER])
    path.write_text(path.read_text().replace('"group_id": 1', '"group_id": 0'))
    with pytest.raises(ForeignError, match="two points 'nose' in a group; give each person"):
        read_people(path)


def test_a_flag_hides_a_point(tmp_path):
    (person,) = read_people(labelme(tmp_path / "a.json", [WALKER], hidden=["left_knee"]))[12]
    assert [name for name, point in person.items() if not point.visible] == ["left_knee"]


@pytest.mark.parametrize(
    ("image", "name", "frame"),
    [("a_031.png", "b7.json", 31), ("a.png", "b7.json", 7), ("a.png", "b.json", 0)],
)
def test_the_frame_is_the_images_number_else_the_files(tmp_path, image, name, frame):
    assert list(read_people(labelme(tmp_path / name, [WALKER], image=image))) == [frame]


def test_boxes_and_outlines_are_no_points(tmp_path):
    box = {"label": "hip", "points": [[1, 2], [3, 4]], "shape_type": "rectangle"}
    assert read_people(write(tmp_path / "a.json", box)) == {}


@pytest.mark.parametrize(
    "shape",
    [
        {"label": "hip"},
        {"points": [[1, 2]]},
        {"label": "hip", "points": [[1]]},
        3,
        {"label": "hip", "points": []},
    ],
)
def test_a_shape_that_does_not_fit_is_refused_in_words(tmp_path, shape):
    with pytest.raises(ForeignError, match="no labelme file"):
        read_people(write(tmp_path / "a.json", shape))
