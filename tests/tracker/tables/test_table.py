"""The reader of all tables: what it forgives, and the line on what it does not; and the writer."""

import pytest

from kinematics.mocap import POSE_COLUMNS
from tracker.batch import jobs
from tracker.tables import keypoints, poses
from tracker.tables.table import Layout, read_lines, write_table


class WrongError(ValueError):
    """Of these tests."""


SHEEP = Layout(
    error=WrongError,
    name="table of sheep",
    header="name,legs",
    needed=("name", "legs"),
    known=("name", "legs", "wool"),
    absent="no sheep at {path}; count again",
    misfit="has {cells} cells for {columns}; quote commas",
)
LAYOUTS = {
    "keypoints": keypoints.LAYOUT,
    "poses": poses.layout_of(POSE_COLUMNS),
    "jobs": jobs.LAYOUT,
    "sheep": SHEEP,
}


@pytest.fixture
def path(tmp_path):
    return tmp_path / "t.csv"


@pytest.mark.parametrize(
    "content",
    [
        b"name,legs\nDolly,4\n",
        b"legs,name\n4,Dolly\n",
        b"\xef\xbb\xbfname,legs\r\nDolly,4\r\n",
        b" name , legs \n Dolly , 4 \n",
        b'name,legs\n\n , ,\n"Dolly",4, ,\n',
    ],
    ids=["plain", "other order", "BOM and CRLF", "spaces", "blank rows, blank cells"],
)
def test_a_table_may_be_written_in_many_ways(path, content):
    path.write_bytes(content)
    ((_, row),) = SHEEP.rows(path)
    assert row == {"name": "Dolly", "legs": "4"}


def test_a_row_is_known_by_its_line_also_after_a_cell_of_several_lines(path):
    path.write_text('name,legs,note,note\nDolly,4,"a\nb",x\n\nMolly\n', encoding="utf-8")
    assert list(SHEEP.rows(path)) == [
        (f"{path} line 3", {"name": "Dolly", "legs": "4", "note": "x"}),
        (f"{path} line 5", {"name": "Molly", "legs": "", "note": ""}),
    ]


@pytest.mark.parametrize("layout", LAYOUTS.values(), ids=LAYOUTS)
def test_each_column_is_needed_that_is_said_to_be_and_none_is_read_twice(path, layout):
    for column in layout.needed:
        path.write_text(",".join(name for name in layout.known if name != column))
        with pytest.raises(layout.error, match=rf"t\.csv is no {layout.name}: column '{column}' is missing;"):
            list(layout.rows(path))
    for column in layout.known:
        path.write_text(",".join([*layout.known, column]))
        with pytest.raises(layout.error, match=f"has two columns '{column}'; name one of them otherwise"):
            list(layout.rows(path))


def test_cells_beyond_the_header_are_a_misfit_or_left_unread(path):
    path.write_text("name,legs\nDolly,4,,and a half\n")
    with pytest.raises(WrongError, match=r"t\.csv line 2 has 4 cells for 2; quote commas"):
        list(SHEEP.rows(path))
    path.write_text("frame,keypoint,x,y\n0,hip,1,2,a note\n")
    assert keypoints.read_keypoints(path) == {0: {"hip": keypoints.Mark(1.0, 2.0)}}


def test_what_is_written_is_read_again(path):
    rows = [("Dolly, the first", 4), ('"Molly"\nthe second', 5)]
    write_table(path, ("name", "legs"), rows)
    assert [cells for _, cells in read_lines(path)][1:] == [[name, str(legs)] for name, legs in rows]
    assert [row["name"] for _, row in SHEEP.rows(path)] == [name for name, _ in rows]
