"""OpenPose's JSON: one file a frame of exactly 75 numbers, there and back."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.tracker import people
from tests.tracker.records import FRAMES, made_record
from tracker.foreign.formats import read_points
from tracker.foreign.openpose import NAMES, holds_frames, read_people, write_openpose
from tracker.foreign.points import named_points
from tracker.foreign.text_files import ForeignError
from tracker.tables.keypoints import KEYPOINTS


@pytest.fixture
def points(rng, tmp_path):
    return named_points(made_record(rng, tmp_path / "run"), NAMES, 1)


@pytest.fixture
def folder(points, tmp_path):
    (tmp_path / "json").mkdir()
    write_openpose(points, tmp_path / "json", "walk 1")
    return tmp_path / "json"


def test_one_file_a_frame_of_75_numbers_in_the_order_of_body_25(points, folder):
    assert sorted(path.name for path in folder.iterdir()) == [
        f"walk 1_{t:012d}_keypoints.json" for t in range(FRAMES)
    ]
    # Fixed by OpenPose's documentation.
    below = ("MidHip", "RHip", "RKnee", "RAnkle", "LHip", "LKnee", "LAnkle")
    order = {"Neck": 1} | {name: 8 + i for i, name in enumerate(below)}
    for t in range(FRAMES):
        frame = json.loads((folder / f"walk 1_{t:012d}_keypoints.json").read_text())
        (person,) = frame["people"]
        assert frame["version"] == 1.3
        assert person["person_id"] == [-1]
        numbers = np.array(person["pose_keypoints_2d"])
        assert numbers.shape == (75,)
        for name, i in order.items():
            j = points.names.index(name)
            sure = points.likelihood[t, j] > 0
            wanted = [*points.places[t, j], points.likelihood[t, j]] if sure else [0.0, 0.0, 0.0]
            assert_allclose(numbers[3 * i : 3 * i + 3], wanted, atol=1e-4)


def write_frame(folder, t, *people):
    people = [{"pose_keypoints_2d": numbers} for numbers in people]
    (folder / f"a_{t:012d}_keypoints.json").write_text(json.dumps({"people": people}))


def numbers(x, confidence):
    """A person whose points lie below each other at x."""
    return [number for i in range(25) for number in (x, float(i), confidence)]


def test_of_several_people_the_surest_is_taken_and_frames_may_be_missing(tmp_path):
    write_frame(tmp_path, 0, numbers(1.0, 0.5), numbers(3.0, 0.9))
    write_frame(tmp_path, 3)
    found = read_points(tmp_path, 1)
    assert_allclose(found.places[0, :, 0], 3.0)
    assert_allclose(found.likelihood[0], 0.9)
    assert len(found) == 4
    assert (found.likelihood[1:] == 0).all()


def test_a_clip_s_points_are_those_seen_and_a_head_s_top_above_the_ears_is_not(tmp_path):
    found = read_points(people.openpose(tmp_path / "a_000000000000_keypoints.json", [people.WALKER]), 1)
    assert found.names == tuple(name for name in KEYPOINTS if name != "head_top")


def test_hidden_files_that_a_copy_left_are_no_frames(tmp_path):
    write_frame(tmp_path, 0, numbers(1.0, 0.5))
    (frame,) = tmp_path.iterdir()
    frame.with_name(f"._{frame.name}").write_bytes(b"\x00\x05\x16\x07")
    assert list(read_people(tmp_path)) == [0]


def test_two_files_of_one_frame_are_refused(tmp_path):
    write_frame(tmp_path, 0, numbers(1.0, 0.5))
    (tmp_path / "b_0_keypoints.json").write_text('{"people": []}')
    with pytest.raises(ForeignError, match="two files of a frame"):
        read_people(tmp_path)


@pytest.mark.parametrize("seen", ["3", "[3]", '[{"pose_keypoints_2d": [1, 2]}]', "[{}]"])
def test_a_file_of_another_layout_is_refused(tmp_path, seen):
    (tmp_path / "a_000000000000_keypoints.json").write_text(f'{{"people": {seen}}}')
    with pytest.raises(ForeignError, match=r"no OpenPose file that can be read .*; export it again"):
        read_people(tmp_path)


def test_a_folder_is_openpose_s_only_if_it_holds_nothing_else(folder):
    assert holds_frames(folder)
    (folder / "notes.txt").write_text("")
    assert not holds_frames(folder)
    assert not holds_frames(folder / "notes.txt")
