"""The keypoints table: what is read from it, and what is wrong with it in one line."""

import pytest

from tracker.tables.keypoints import KeypointsError, Mark, points, read_keypoints

HEADER = "frame,keypoint,x,y,visible\n"


@pytest.fixture
def table(tmp_path):
    def write(text, encoding="utf-8"):
        path = tmp_path / "k.csv"
        path.write_bytes(text.encode(encoding))
        return path

    return write


def test_marks_come_by_frame_and_joint(table):
    marks = read_keypoints(table(HEADER + "3,hip,1.5,-2,1\n3,neck,4,5e1,0\n0,hip,6,7,1.0\n"))
    assert marks == {
        3: {"hip": Mark(1.5, -2.0), "neck": Mark(4.0, 50.0, visible=False)},
        0: {"hip": Mark(6, 7)},
    }
    assert points(marks[3]) == {"hip": (1.5, -2.0), "neck": (4.0, 50.0)}


@pytest.mark.parametrize(
    "text",
    [
        "frame,keypoint,x,y,visible,by\n0,hip,1,2,1,me\n",
        "frame,keypoint,x,y\n0,hip,1,2\n",
        HEADER + "0,hip,1,2,\n",
        HEADER + "0,hip,1,2,1\n0,neck,,,\n5,hip,,,1\n",
    ],
    ids=["more columns", "no visible", "empty visible", "no position"],
)
def test_it_may_be_written_in_many_ways(table, text):
    assert read_keypoints(table(text)) == {0: {"hip": Mark(1.0, 2.0)}}


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ("0,,1,2,1", r"line 2: unknown joint ''"),
        ("0,hip,1,inf,1", r"line 2: y must be a finite number; got 'inf'"),
        ("0,hip,,2,1", r"line 2: x must be a finite number; got ''"),
        ("0,hip,1,,1", r"line 2: y must be a finite number; got ''"),
        ("0,hip,1", r"line 2: y must be a finite number; got ''"),
        ("0,hip,1,2,yes", r"line 2: visible must be a finite number; got 'yes'"),
        ("0,hip,1,2,2", r"line 2: visible must be 1, 0 or empty; got '2'"),
        (",hip,1,2,1", r"line 2: frame must be a finite number; got ''"),
        ("0,hip,1,-1e300,1", r"line 2: y -1e300 is out of all range; correct it"),
    ],
)
def test_a_bad_row_is_named_with_its_line(table, row, words):
    with pytest.raises(KeypointsError, match=rf"k\.csv {words}"):
        read_keypoints(table(HEADER + row + "\n"))


@pytest.mark.parametrize("text", [HEADER, HEADER + "0,hip,,,\n"])
def test_a_table_without_a_mark_is_refused(table, text):
    with pytest.raises(KeypointsError, match="has no marked joints; mark one frame at least"):
        read_keypoints(table(text))


def test_other_figures_name_other_joints(table):
    path = table(HEADER + "0,hoof,1,2,1\n")
    assert read_keypoints(path, ["hoof"]) == {0: {"hoof": Mark(1.0, 2.0)}}


def test_joints_that_are_followed_and_not_marked_are_passed_over(table):
    path = table(HEADER + "0,hoof,1,2,1\n0,belly,3,4,1\n")
    assert read_keypoints(path, ["hoof"], ["hoof", "belly"]) == {0: {"hoof": Mark(1.0, 2.0)}}
    with pytest.raises(KeypointsError, match="unknown joint 'belly'"):
        read_keypoints(path, ["hoof"])
