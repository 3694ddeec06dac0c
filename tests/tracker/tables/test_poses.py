"""Pose tables in: sequences, gaps, labels, and what is wrong with a table."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from kinematics.mocap import POSE_COLUMNS
from tests.tracker.clips import figtrack, refused, succeeds
from tests.tracker.gaits import gait, sequence
from tests.tracker.gaits import write_poses as written
from tracker.tables.poses import LARGEST, PosesError, pose_cells, read_poses, suspicions, write_poses

HEADER = "seq,frame," + ",".join(POSE_COLUMNS) + ",label"


def table(tmp_path, *rows, header=HEADER):
    path = tmp_path / "poses.csv"
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


def row(frame, label="walk", seq="a", angle=10.0):
    return f"{seq},{frame},0.1,0.2,{angle},0,30,45,-20,5,{label}"


def test_angles_come_in_degrees_and_leave_in_radians(tmp_path):
    (sequence,) = read_poses(table(tmp_path, row(3, "slow\xa0 walk")))
    assert (sequence.name, sequence.first, sequence.labels) == ("a", 3, ("slow walk",))
    assert_allclose(sequence.y[0], [0.1, 0.2, *np.radians([10, 0, 30, 45, -20, 5])], rtol=1e-15)


@pytest.mark.parametrize("label", ["cv", "free"])
def test_a_label_of_the_tracker_that_names_no_motion_is_none(tmp_path, label):
    (sequence,) = read_poses(table(tmp_path, row(0, label), row(1)))
    assert sequence.labels == ("", "walk")


def test_columns_may_stand_in_any_order_and_root_and_seq_may_be_missing(tmp_path):
    names = [*reversed(POSE_COLUMNS[2:]), "frame"]
    (sequence,) = read_poses(table(tmp_path, "1,2,3,4,5,6,0", header=",".join(names)))
    assert np.isnan(sequence.y[0, :2]).all()
    assert_allclose(np.degrees(sequence.y[0, 2:]), [6, 5, 4, 3, 2, 1])


def test_frames_left_out_are_rows_of_missing_data(tmp_path):
    (sequence,) = read_poses(table(tmp_path, row(4), row(1)))
    assert sequence.first == 1
    assert np.isnan(sequence.y).all(axis=1).tolist() == [False, True, True, False]


def test_as_many_frames_may_be_left_out_as_is_said(tmp_path):
    (sequence,) = read_poses(table(tmp_path, row(0), row(10_001)))
    assert len(sequence) == 10_002


def test_a_run_ends_at_a_gap_at_an_empty_cell_and_at_another_label(tmp_path):
    rows = [row(0), row(1), row(3), "a,4,0,0,,0,0,0,0,0,walk", row(5), row(6, "run"), row(0, seq="b")]
    first, second = read_poses(table(tmp_path, *rows))
    assert [(label, len(y)) for label, y in first.runs()] == [
        ("walk", 2),
        ("walk", 1),
        ("walk", 1),
        ("run", 1),
    ]
    assert [(label, len(y)) for label, y in second.runs()] == [("walk", 1)]


def test_a_run_ends_where_the_tracker_did_not_see_the_pose(tmp_path):
    outcomes = ("ok", "hidden", "lost", "found", "outside", "")
    rows = [f"{row(t)},{outcome}" for t, outcome in enumerate(outcomes)]
    (sequence,) = read_poses(table(tmp_path, *rows, header=f"{HEADER},outcome"))
    assert [len(y) for _, y in sequence.runs()] == [2, 1, 1]
    assert (sequence.seen.any(1).tolist(), sequence.unseen) == ([True, True, False, True, False, True], 2)
    assert (sequence.cells[2], sequence.labels[2]) == (("",) * 8, "")


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ((row(0), row(0)), "line 3: frame 0 is given twice"),
        ((row(0, angle="nan"),), "line 2: torso must be a finite number or empty; got 'nan'"),
        ((row("x"),), "frame must be a finite number"),
        ((row(""),), "frame must be a finite number; got ''"),
        ((row(1.5),), "frame must be a whole number"),
        ((row(-1),), "frame must be a whole number"),
        ((row(0, angle="1_0"),), "torso must be a finite number or empty; got '1_0'"),
        ((row(0, angle="12,5"),), "line 2 has 12 cells, the header 11; .* numbers a point"),
        ((row(0, angle=2 * LARGEST),), "torso 2000000000.0 is out of all range"),
        ((row(0), row(1, angle=-3601)), "line 3: torso -3601 is out of all range"),
        ((row(0), row(0, seq="b"), row(1)), "line 4: sequence 'a' ended before and comes again"),
        ((row(0), row(10_002)), "frame 10002 comes after frame 0; at most 10000 frames may be left out"),
        ((row(0), row(10**9)), "sequence 'a' goes from frame 0 to frame 1000000000; at most"),
    ],
)
def test_a_spoiled_table_is_refused_in_one_line(tmp_path, rows, said):
    with pytest.raises(PosesError, match=said):
        read_poses(table(tmp_path, *rows))


def test_cells_are_kept_as_they_were_written(tmp_path):
    (sequence,) = read_poses(table(tmp_path, row(0, angle="1.50e1"), row(2)))
    assert sequence.cells[0] == ("0.1", "0.2", "1.50e1", "0", "30", "45", "-20", "5")
    assert sequence.cells[1] == ("",) * 8
    assert sequence.seen[:, 2].tolist() == [True, False, True]


def test_what_is_written_is_read_again(tmp_path, rng):
    y = rng.normal(size=(5, 8))
    y[2, 4:] = np.nan
    write_poses(tmp_path / "p.csv", [("s", t + 7, *pose_cells(y[t]), t) for t in range(5)], ("state",))
    (again,) = read_poses(tmp_path / "p.csv")
    assert (again.name, again.first) == ("s", 7)
    # Cells have 5 places of a leg length and 4 of a degree.
    assert_allclose(again.y, y, atol=6e-6)


def walker(seq, scale=1.0, frames=40, travel=0.05):
    angles = [scale * value for value in (4.0, -3.0, 30.0, 45.0, -20.0, 60.0)]
    cells = ",".join(f"{angle:.4f}" for angle in angles)
    return [f"{seq},{t},{travel * t},0,{cells}," for t in range(frames)]


def test_angles_in_radians_are_suspected_and_degrees_are_not(tmp_path):
    radians = float(np.radians(1.0))
    good, bad = walker("good"), walker("bad", radians)
    assert suspicions(read_poses(table(tmp_path, *good)), 30.0) == []
    (said,) = suspicions(read_poses(table(tmp_path, *good, *bad, *walker("worse", radians))), 30.0)
    assert "sequence 'bad' and 1 more lies within 3.2 degrees" in said
    assert said.endswith("write degrees")


@pytest.mark.parametrize(
    ("frames", "travel", "suspected"),
    [(40, 0.0, True), (5, 0.1, True), (5, 0.0, False), (1, 0.0, False)],
    ids=["long", "short but travelling", "short and still", "one frame"],
)
def test_small_angles_are_suspected_only_of_a_figure_that_moves(tmp_path, frames, travel, suspected):
    rows = walker("a", float(np.radians(1.0)), frames, travel)
    assert bool(suspicions(read_poses(table(tmp_path, *rows)), 30.0)) == suspected


def test_who_goes_backwards_is_told(tmp_path):
    (ahead,) = read_poses(table(tmp_path, *walker("a", travel=0.1)))
    back = replace(ahead, y=ahead.y[::-1])
    assert_array_equal(back.y[back.order(30.0)], ahead.y[ahead.order(30.0)])
    assert suspicions([ahead], 30.0) == []
    assert suspicions([ahead, back], 30.0) == ["root_x of sequence 'a' falls, so the figure goes backwards"]


def test_another_frame_rate_than_the_tables_own_times_is_suspected(tmp_path):
    rows = [f"{line},{t / 60.0:.6f}" for t, line in enumerate(walker("a"))]
    sequences = read_poses(table(tmp_path, *rows[:3], *rows[9:], header=HEADER + ",time_s"))
    assert sequences[0].fps == pytest.approx(60.0, rel=1e-3)
    assert suspicions(sequences, 60.0) == []
    (said,) = suspicions(sequences, 30.0)
    assert "sequence 'a' says 60 frames a second, the model is taken at 30; give --fps 60 if" in said


def gait_table(path, label="walk"):
    y = gait(label, 40, np.random.default_rng(1))
    return written(path, sequence(y, labels=(label,) * 40), further=["label"])


def test_a_model_is_learned_from_pose_tables_one_motion_a_label(tmp_path):
    tables = [gait_table(tmp_path / "a.csv"), gait_table(tmp_path / "b.csv", "run")]
    found = succeeds("learn", *tables, "--states", 1, "--out", tmp_path / "m.npz")
    assert "2 states, order 2, 30 frames a second, from 2 sequences of subjects a, b" in found.stdout
    assert "\n80 frames used, 0 left out" in found.stdout
    found = figtrack("learn", *tables, "--states", 1, "--label", "walk", "--out", tmp_path / "w.npz")
    assert "\n40 frames used, 40 left out" in found.stdout
    said = refused("learn", *tables, "--label", "hop", "--out", tmp_path / "h.npz")
    assert "b.csv: no row is labelled 'hop'; labels here: run, walk" in said


def test_pose_tables_without_the_root_cannot_be_learned_from(tmp_path):
    path = gait_table(tmp_path / "a.csv")
    lines = [line.split(",") for line in path.read_text().splitlines()]
    path.write_text("\n".join(",".join(cells[:2] + cells[4:]) for cells in lines) + "\n")
    said = refused("learn", path, "--out", tmp_path / "m.npz")
    assert "leaves no sequences of 'walk'; rows need all of root_x,root_y" in said
    assert not (tmp_path / "m.npz").exists()
