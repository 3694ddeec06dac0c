"""What every reader of other programs' files shares: points out of numbers, frames out of names."""

import pytest

from tests.tracker import people
from tests.tracker.people import WALKER, moved
from tracker.foreign import dlc, openpose
from tracker.foreign.people import Sighting, frame_number, sighting, triples


def test_a_point_needs_two_numbers_and_some_confidence():
    assert sighting("1.5", 2, "0.3") == Sighting(1.5, 2.0, 0.3)
    assert sighting(1, 2, 99) == Sighting(1.0, 2.0, 1.0)
    for wrong in [("", 2), ("nan", 2), (float("inf"), 2), (1, None), (1, 2, 0.0), (1, 2, "nan"), (1, 2, -1)]:
        assert sighting(*wrong) is None


def test_numbers_must_be_three_a_name():
    assert triples(["a", "b"], [1, 2, 3, 4, 5, 6]) == {"a": (1, 2, 3), "b": (4, 5, 6)}
    with pytest.raises(ValueError, match="2 points need 6 numbers; got 5"):
        triples(["a", "b"], [1, 2, 3, 4, 5])


@pytest.mark.parametrize(
    ("name", "frame"),
    [
        ("img0012.png", 12),
        ("labeled-data/v2/img3.png", 3),
        ("a\\b\\cam1_007.json", 7),
        ("walk_0012_png.rf.8d2f7a44c1.jpg", 12),
        ("start.png", None),
        ("9" * 30, None),
    ],
)
def test_a_frame_is_the_last_number_of_a_files_own_name(name, frame):
    assert frame_number(name) == frame


def test_openpose_of_eighteen_points_is_read_too(tmp_path):
    path = people.openpose(tmp_path / "a.json", [WALKER])
    numbers = [float(i) for i in range(3 * 18)]
    path.write_text(f'{{"people": [{{"pose_keypoints_2d": {numbers}}}]}}')
    assert openpose.read_people(path)[0][0]["LAnkle"] == Sighting(39.0, 40.0, 1.0)


def test_deeplabcut_individuals_are_people_of_one_frame(tmp_path):
    both = [WALKER, moved(WALKER, dx=100.0)]
    found = dlc.read_people(people.dlc(tmp_path / "a.csv", {"0": both}, individuals=["ann", "bob"]))
    assert [person["left_hip"].x for person in found[0]] == [102.0, 202.0]


@pytest.mark.parametrize("front", ["labeled-data/v/img012.png", "labeled-data,v,img012.png"])
def test_deeplabcut_labels_of_images_count_by_the_images_number(tmp_path, front):
    path = people.dlc(tmp_path / "a.csv", {"FRONT": WALKER})
    more = front.count(",")
    lines = path.read_text().replace("FRONT", front).splitlines()
    path.write_text(
        "\n".join(line.replace(",", "," * (more + 1), 1) for line in lines[:3]) + "\n" + lines[3] + "\n"
    )
    assert dlc.read_people(path)[12][0]["left_hip"] == Sighting(*WALKER["left_hip"], 0.95)
