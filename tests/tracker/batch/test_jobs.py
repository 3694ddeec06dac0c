"""The table of jobs: what it says of each clip, and what cannot be."""

import pytest

from tests.tracker.clips import QUIET, write_table
from tracker.batch.jobs import JobsError, read_jobs
from tracker.clip.job import Following
from tracker.tables.keypoints import KEYPOINTS, Mark, write_marks

HEADER = ("video", "keypoints", "start", "model", "out")
MARKED = dict.fromkeys(KEYPOINTS, Mark(1.0, 2.0))


@pytest.fixture
def table(tmp_path):
    def write(*rows, header=HEADER):
        (tmp_path / "Läufe").mkdir(exist_ok=True)
        write_table(tmp_path / "Läufe" / "jobs.csv", rows, header)
        return tmp_path / "Läufe" / "jobs.csv"

    return write


def test_files_are_relative_to_the_table_and_results_to_their_place(table, tmp_path, clip):
    beside = tmp_path / "Läufe"
    path = table(
        ("a b.mp4", "k.csv", "", "", ""),
        (clip.video, clip.keypoints, 6, "mine.npz", "out é", "dog.toml"),
        ("", "", "", "", ""),
        header=(*HEADER, "figure"),
    )
    one, other = read_jobs(path, tmp_path / "place", QUIET)
    assert (one.video, one.keypoints) == (beside / "a b.mp4", beside / "k.csv")
    assert (one.how, one.out) == (Following(), tmp_path / "place" / "a b-track")
    assert (other.video, other.how.model) == (clip.video, str(beside / "mine.npz"))
    assert other.how.figure == str(beside / "dog.toml")
    assert (other.out, other.how.start) == (tmp_path / "place" / "out é", 6)


def test_short_rows_have_empty_cells_and_columns_any_order(table, tmp_path):
    path = table(("k.csv", " a.mp4 "), header=("keypoints", " video ", "start"))
    (row,) = read_jobs(path, tmp_path, QUIET)
    assert row.video.name == "a.mp4"
    assert row.how.start is None


def test_a_column_that_is_not_read_is_said(table, tmp_path, capsys):
    read_jobs(table(("a", "b", "left"), header=("video", "keypoints", "facng")), tmp_path, QUIET)
    assert "column 'facng' of jobs.csv is not read" in capsys.readouterr().err


ROW = ("a.mp4", "k.csv", "", "", "")


@pytest.mark.parametrize(
    ("header", "rows", "words"),
    [
        (HEADER, (("", "k.csv", "", "", ""),), "line 2: video is empty"),
        (HEADER, (ROW, ("b.mp4", "k.csv", "-1", "", "")), "line 3: start must be a whole number from 0"),
        (HEADER, (("b.mp4", "k.csv", "٣", "", ""),), "start must be a whole number"),
        (HEADER, ((*ROW, "x"),), "line 2 has more cells than the header"),
        ((*HEADER, "rate"), ((*ROW, "9"),), "rate must be from 0.25 to 4, or empty; got '9'"),
        ((*HEADER, "person"), ((*ROW, "0"),), "line 2: person must be at least 1"),
        ((*HEADER, "height", "scale"), ((*ROW, "1.7", "300"),), "line 2: give either height or scale"),
        ((*HEADER, "facing"), ((*ROW, "up"),), "facing must be left, right or empty; got 'up'"),
        ((*HEADER, "smooth"), ((*ROW, "no"),), "smooth must be 1, 0 or empty"),
        ((*HEADER, "anchors"), ((*ROW, "2"),), "anchors must be 1, 0 or empty"),
        (HEADER, (ROW, ROW), "two rows have the same out, .*a-track; give each its own"),
        (HEADER, (("a", "k", "", "", "x"), ("b", "k", "", "", "y/../x")), "two rows have the same out"),
        (HEADER, [(*ROW[:4], name) for name in ("x", "x/y")], "lie in one another"),
        # Whatever sorts between.
        (HEADER, [(*ROW[:4], name) for name in ("b", "a", "b/c")], "lie in one another"),
        (HEADER, [(*ROW[:4], name) for name in ("a/b/c", "a!", "a")], "lie in one another"),
        (HEADER, [(*ROW[:4], name) for name in ("a", "a b", "a/b")], "lie in one another"),
        (HEADER, (("a", "k", "", "", "."),), "would hold the whole batch"),
    ],
)
def test_what_cannot_be_is_said_before_any_work(table, tmp_path, header, rows, words):
    with pytest.raises(JobsError, match=words):
        read_jobs(table(*rows, header=header), tmp_path, QUIET)


def test_a_folder_of_films_has_a_row_for_each_with_the_marks_beside_it(tmp_path):
    for name in ("b.mp4", "a b.MOV", "c.keypoints.csv", "notes.txt"):
        (tmp_path / name).touch()
    write_marks(tmp_path / "b.keypoints.csv", {0: MARKED})
    one, other = read_jobs(tmp_path, tmp_path / "place", QUIET)
    assert (one.video, one.keypoints) == (tmp_path / "a b.MOV", None)
    assert (other.video, other.keypoints) == (tmp_path / "b.mp4", tmp_path / "b.keypoints.csv")
    assert [row.out for row in (one, other)] == [
        tmp_path / "place" / f"{name}-track" for name in ("a b", "b")
    ]
    assert one.how == other.how == Following()
    write_marks(tmp_path / "b.keypoints.csv", {0: MARKED, 7: MARKED})
    assert [row.how.anchors for row in read_jobs(tmp_path, tmp_path / "place", QUIET)] == [False, True]


def test_films_of_one_name_have_results_of_their_own(tmp_path):
    for name in ("walk.mp4", "walk.avi", "run.mp4"):
        (tmp_path / name).touch()
    rows = read_jobs(tmp_path, tmp_path / "place", QUIET)
    assert [row.out.name for row in rows] == ["run-track", "walk.avi-track", "walk.mp4-track"]
    (tmp_path / "walk.keypoints.csv").touch()
    with pytest.raises(JobsError, match=r"walk.keypoints.csv may be of any film walk; rename these films"):
        read_jobs(tmp_path, tmp_path / "place", QUIET)


def test_files_that_are_not_there_are_told_before_any_work(table, tmp_path, clip, capsys):
    path = table(("gone.mp4", "", "", "", ""), (clip.video, "k.csv", "", "", "b"))
    read_jobs(path, tmp_path, QUIET)
    said = capsys.readouterr().err
    beside = tmp_path / "Läufe"
    assert f"there is no {beside / 'gone.mp4'}; gone.mp4 will fail" in said
    assert f"there is no {beside / 'k.csv'}; {clip.video.name} will fail" in said


def test_rows_are_kept_apart_without_comparing_each_with_each(table, tmp_path, clip, monkeypatch):
    asked = []
    inside = type(tmp_path).is_relative_to
    monkeypatch.setattr(type(tmp_path), "is_relative_to", lambda *two: asked.append(two) or inside(*two))
    rows = [(clip.video, clip.keypoints, "", "cv", f"{n}") for n in range(300)]
    monkeypatch.setattr("tracker.clip.job.get_type_hints", None)  # the options' types are known by now
    assert len(read_jobs(table(*rows), tmp_path, QUIET)) == 300
    assert len(asked) < 3 * 300
