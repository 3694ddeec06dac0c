"""COCO's two layouts: whose frame, which names, what is left out, what is refused."""

import json

import pytest

from tests.tracker.people import WALKER, coco, coco_numbers
from tracker.foreign.coco import read_people
from tracker.foreign.people import Sighting
from tracker.foreign.text_files import ForeignError


def write(path, content):
    path.write_text(json.dumps(content), encoding="utf-8")
    return path


def test_frames_are_the_numbers_in_the_images_names(tmp_path):
    people = read_people(coco(tmp_path / "a.json", {"img0007.jpg": [WALKER], "sub/2_img0009.jpg": [WALKER]}))
    assert sorted(people) == [7, 9]


def test_images_of_two_films_are_refused(tmp_path):
    files = [coco(tmp_path / "a.json", {"monday/0001.jpg": [WALKER], "friday/0001.jpg": [WALKER]})]
    results = [{"image_id": image, "keypoints": coco_numbers(WALKER)} for image in ("left.jpg", "right.jpg")]
    for path in (*files, write(tmp_path / "b.json", results)):
        with pytest.raises(ForeignError, match="two images of a frame; give a file of one video"):
            read_people(path)
    assert list(read_people(write(tmp_path / "c.json", results[:1]))) == [0]


def test_flags_say_what_is_there_and_what_is_hidden(tmp_path):
    flags = {"nose": 0, "left_knee": 1}
    (person,) = read_people(coco(tmp_path / "a.json", {"1.jpg": [WALKER]}, flags))[1]
    assert "nose" not in person
    assert person["left_knee"] == Sighting(*WALKER["left_knee"], 1.0, visible=False)
    assert person["right_knee"] == Sighting(*WALKER["right_knee"], 1.0, visible=True)


def test_a_category_names_its_own_points(tmp_path):
    content = {
        "images": [{"id": 1, "file_name": "3.png"}],
        "annotations": [{"image_id": 1, "category_id": 5, "keypoints": [1, 2, 2, 3, 4, 2]}],
        "categories": [{"id": 5, "keypoints": ["hip", "near_toe"]}],
    }
    (person,) = read_people(write(tmp_path / "a.json", content))[3]
    assert person == {"hip": Sighting(1.0, 2.0), "near_toe": Sighting(3.0, 4.0)}


def test_crowds_and_boxes_without_points_are_nobody(tmp_path):
    path = coco(tmp_path / "a.json", {"1.jpg": [WALKER, WALKER, WALKER]})
    content = json.loads(path.read_text())
    content["annotations"][0]["iscrowd"] = 1
    content["annotations"][1]["keypoints"] = [0] * 51
    del content["annotations"][2]["keypoints"]
    assert read_people(write(path, content)) == {}


def test_a_detectors_results_come_by_image_with_confidence(tmp_path):
    numbers = [0.7 if i % 3 == 2 and n else n for i, n in enumerate(coco_numbers(WALKER))]
    results = [{"image_id": image, "keypoints": numbers, "score": 2.0} for image in (4, "f_005.png", 4)]
    people = read_people(write(tmp_path / "a.json", results))
    assert {frame: len(them) for frame, them in people.items()} == {4: 2, 5: 1}
    assert people[4][0]["left_knee"] == Sighting(*WALKER["left_knee"], 0.7)


@pytest.mark.parametrize(
    "content",
    [
        {"annotations": [{"image_id": 1, "keypoints": [1, 2]}]},
        {"annotations": [{"image_id": 1, "keypoints": 7}]},
        {"annotations": [{"keypoints": [1, 2, 2] * 17}]},
        {"annotations": [{"image_id": [1], "keypoints": [1, 2, 2] * 17}]},
        {"annotations": [{"image_id": "the seventh", "keypoints": [1, 2, 2] * 17}]},
        {"annotations": [None]},
        [{"image_id": float("inf"), "keypoints": [1, 2, 2] * 17}],
    ],
)
def test_an_annotation_that_does_not_fit_is_refused_in_words(tmp_path, content):
    with pytest.raises(ForeignError, match="is no COCO keypoints file that can be read"):
        read_people(write(tmp_path / "a.json", content))


@pytest.mark.parametrize("number", ["1" + 400 * "0", "Infinity"])
def test_points_beyond_all_bounds_are_left_out(tmp_path, number):
    path = coco(tmp_path / "a.json", {"img0007.jpg": [WALKER]})
    content = json.loads(path.read_text())
    content["annotations"][0]["keypoints"][0] = "N"
    path.write_text(json.dumps(content).replace('"N"', number))
    ((person,),) = read_people(path).values()
    assert "nose" not in person
    assert "left_ear" in person


def test_images_may_be_known_by_words_and_points_by_numbers(tmp_path):
    path = coco(tmp_path / "a.json", {"img0007.jpg": [WALKER]})
    content = json.loads(path.read_text())
    content["images"][0]["id"] = content["annotations"][0]["image_id"] = "the seventh"
    for category in content["categories"]:
        category["keypoints"] = list(range(17))
    ((frame, (person,)),) = read_people(write(path, content)).items()
    assert frame == 7
    assert {"0", "16"} <= set(person)
