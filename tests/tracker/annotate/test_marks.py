"""The table of a marking session: what a save writes, keeps and refuses."""

import pytest

from tests.tracker.clips import everything
from tracker.annotate.marks import Table
from tracker.run.folder import FolderError
from tracker.tables.keypoints import KeypointsError, Mark, read_keypoints

OLD = (
    "by,frame,keypoint,x,y,visible\r\n"
    'me,"0",hip,1.50,2.000,1\r\n'
    "me,0,neck,3,4,\r\n"
    "you,7,hip,5,6,0,more\r\n"
    ",9,head_top,,,\r\n"
)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "k.csv"


@pytest.fixture
def old(path):
    path.write_text(OLD, encoding="utf-8", newline="")
    return path


def test_a_new_table_holds_the_marks_in_the_order_of_frames_and_joints(path):
    table = Table(path)
    later = {"neck": Mark(1.25, -2.0), "head_top": Mark(3.999, 0.1, visible=False)}
    table.save({5: later, 0: {"hip": Mark(-0.001, 7)}})
    assert path.read_text() == (
        "frame,keypoint,x,y,visible\n0,hip,-0.001,7,1\n5,head_top,3.999,0.1,0\n5,neck,1.25,-2,1\n"
    )
    assert read_keypoints(path)[5]["neck"] == Mark(1.25, -2.0)


def test_frames_that_are_not_touched_stay_to_the_letter(old):
    Table(old).save({3: {"hip": Mark(1, 1)}})
    lines = old.read_text().splitlines()
    assert lines == [
        "by,frame,keypoint,x,y,visible",
        "me,0,hip,1.50,2.000,1",
        "me,0,neck,3,4,",
        ",3,hip,1,1,1",
        "you,7,hip,5,6,0,more",
        ",9,head_top,,,",
    ]


def test_a_table_with_spaces_and_blank_rows_keeps_its_marks(path):
    path.write_text("\n,,,\nframe, keypoint, x, y, visible\n0, hip, 1, 2, 1\n , ,,,\n", encoding="utf-8")
    Table(path).save({3: {"hip": Mark(4, 5)}})
    assert path.read_text() == "frame,keypoint,x,y,visible\n0, hip, 1, 2, 1\n3,hip,4,5,1\n"
    assert read_keypoints(path) == {0: {"hip": Mark(1, 2)}, 3: {"hip": Mark(4, 5)}}


def test_in_a_touched_frame_only_what_changed_loses_its_further_columns(old):
    table = Table(old)
    table.save({0: {"neck": table.marks[0]["neck"], "hip": Mark(1.5, 2.25)}})
    assert old.read_text().splitlines()[1:3] == ["me,0,neck,3,4,", ",0,hip,1.5,2.25,1"]


def test_a_joint_that_is_gone_loses_its_row_and_a_frame_without_joints_all(old):
    table = Table(old)
    table.save({0: {"neck": Mark(3.0, 4.0)}, 7: {}})
    assert read_keypoints(old) == {0: {"neck": Mark(3.0, 4.0)}}
    assert table.marks == {0: {"neck": Mark(3.0, 4.0)}}


@pytest.mark.parametrize("beyond", ["", ",checked"], ids=["as it is", "with a cell beyond the header"])
def test_a_table_without_visible_gets_the_column_below_which_no_other_cell_comes_to_stand(path, beyond):
    path.write_text(f"frame,keypoint,x,y\n0,hip,1,2{beyond}\n")
    Table(path).save({1: {"hip": Mark(3, 4, visible=False)}})
    assert read_keypoints(path) == {0: {"hip": Mark(1, 2)}, 1: {"hip": Mark(3, 4, visible=False)}}


def test_a_table_that_is_not_there_yet_may_begin_with_marks(path):
    begin = {4: {"hip": Mark(1.0, 2.0)}, 0: {"neck": Mark(3.0, 4.0, visible=False)}}
    table = Table(path, begin=begin)
    assert (table.marks, path.exists()) == (begin, False)
    table.save({4: {"hip": Mark(5.0, 6.0)}})
    assert path.read_text() == "frame,keypoint,x,y,visible\n0,neck,3,4,0\n4,hip,5,6,1\n"
    assert Table(path, begin=begin).marks[4] == {"hip": Mark(5.0, 6.0)}


def test_marks_that_nobody_touches_stay_exactly_the_same(path):
    begin = {4: {"hip": Mark(100.12345, 0.1 + 0.2)}}
    Table(path, begin=begin).save({9: {"hip": Mark(5.0, 6.25)}})
    hip = read_keypoints(path)[4]["hip"]
    assert (hip.x, hip.y) == (100.12345, 0.3)
    again = Table(path, begin=begin)
    again.save({9: {"hip": Mark(5.0, 6.0)}})
    assert read_keypoints(path)[4]["hip"] == hip


def test_with_overwrite_the_old_table_is_there_until_the_first_save_and_then_gone(old):
    table = Table(old, overwrite=True)
    assert table.marks == {}
    assert old.read_text(encoding="utf-8") == OLD.replace("\r\n", "\n")
    table.save({2: {"hip": Mark(1, 2)}})
    assert read_keypoints(old) == {2: {"hip": Mark(1, 2)}}


def test_with_overwrite_even_a_broken_table_can_be_replaced(path):
    path.write_bytes(b"\xff\xfe rubbish")
    with pytest.raises(KeypointsError, match="--overwrite"):
        Table(path)
    Table(path, overwrite=True).save({0: {"hip": Mark(1, 2)}})
    assert read_keypoints(path)


@pytest.mark.parametrize("start", ["new", "old"])
def test_what_another_program_wrote_meanwhile_is_not_overwritten(path, start):
    if start == "old":
        path.write_text(OLD, encoding="utf-8", newline="")
    table = Table(path)
    path.write_text("frame,keypoint,x,y\n0,hip,9,9\n")
    with pytest.raises(FolderError, match="changed by another program"):
        table.save({0: {"hip": Mark(1, 2)}})
    assert path.read_text() == "frame,keypoint,x,y\n0,hip,9,9\n"
    path.unlink()
    table.save({0: {"hip": Mark(1, 2)}})
    assert read_keypoints(path)[0]["hip"] == Mark(1, 2)


def test_a_save_of_nothing_is_refused(old):
    with pytest.raises(FolderError, match="no joint is marked"):
        Table(old).save({0: {}, 7: {}})
    assert old.read_text(encoding="utf-8") == OLD.replace("\r\n", "\n")


def test_a_save_that_fails_leaves_the_old_table_and_nothing_else(old, monkeypatch):
    table, before = Table(old), everything(old.parent)

    def full(self, content):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pathlib.Path.write_bytes", full)
    with pytest.raises(OSError, match="No space"):
        table.save({0: {"hip": Mark(8, 8)}})
    monkeypatch.undo()
    assert everything(old.parent) == before
    table.save({0: {"hip": Mark(8, 8)}})
    assert read_keypoints(old)[0] == {"hip": Mark(8, 8)}
