"""DeepLabCut's CSV: the layout to the letter, there and back, and what is no such table."""

import numpy as np
import pytest

from tests.tracker.records import FRAMES, made_record, validated
from tracker.foreign.dlc import read_people, write_dlc
from tracker.foreign.formats import is_foreign, read_points
from tracker.foreign.people import Sighting
from tracker.foreign.points import JOINTS, Points, named_points
from tracker.foreign.text_files import ForeignError

NOWHERE = (np.nan, np.nan)


def test_the_layout_to_the_letter(tmp_path):
    places = np.array([[[100.512, 200.95], [140.9494, 300.312]], [[101.021, 200.871], NOWHERE]])
    points = Points(("Hip", "RKnee"), places, np.array([[0.9442, 0.8733], [0.944, 0.0]]))
    write_dlc(points, tmp_path / "p.csv")
    assert (tmp_path / "p.csv").read_bytes().decode() == (
        "scorer,figtrack,figtrack,figtrack,figtrack,figtrack,figtrack\n"
        "bodyparts,Hip,Hip,Hip,RKnee,RKnee,RKnee\n"
        "coords,x,y,likelihood,x,y,likelihood\n"
        "0,100.512,200.950,0.9442,140.949,300.312,0.8733\n"
        "1,101.021,200.871,0.9440,,,\n"
    )


def test_the_validator_finds_nothing_wrong(rng, tmp_path):
    path = tmp_path / "p.csv"
    write_dlc(named_points(made_record(rng, tmp_path / "run"), JOINTS, 1), path)
    said = validated("check_movement.py", path, "--structure-only")
    assert f"'frames': {FRAMES}" in said
    assert "warning" not in said


@pytest.mark.parametrize(
    ("text", "rows"),
    [
        ("scorer,a,a\nbodyparts,k,k\ncoords,x,y\n0,1,2\n2,3,4\n", {0: (1, 2), 2: (3, 4)}),
        ("scorer,a,a\nindividuals,i,i\nbodyparts,k,k\ncoords,x,y\n0,1,nan\n1,3,4\n", {0: None, 1: (3, 4)}),
        ("scorer,a,a,a\nbodyparts,k,k,k\ncoords,x,y,likelihood\n0,1,2,\n1,3,4,0\n", {0: (1, 2), 1: None}),
        ("\ufeffscorer,a,a\r\nbodyparts,k,k\r\ncoords,y,x\r\n0,2,1\r\n", {0: (1, 2)}),
    ],
)
def test_other_tables_of_the_kind_are_read(tmp_path, text, rows):
    (tmp_path / "p.csv").write_text(text)
    wanted = {frame: [{"k": Sighting(*place)}] if place else [] for frame, place in rows.items()}
    found = {
        frame: [one for one in people if one] for frame, people in read_people(tmp_path / "p.csv").items()
    }
    assert found == wanted


def test_a_table_is_known_however_long_its_first_row(tmp_path):
    row = ",".join(["a_long_name_of_a_network"] * 900)
    (tmp_path / "p.csv").write_text(f"scorer,{row}\nbodyparts,k,k\n")
    assert is_foreign(tmp_path / "p.csv")
    (tmp_path / "p.csv").write_text("scorer,frame,keypoint,x,y\nme,0,hip,1,2\n")
    assert not is_foreign(tmp_path / "p.csv")


HEAD = "scorer,a,a\nbodyparts,k,k\ncoords,x,y\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("scorer,a,a\n0,1,2\n", "no DeepLabCut table"),
        ("frame,keypoint,x,y\n0,hip,1,2\n", "none of the files"),
        (HEAD, "nobody is marked"),
        (HEAD + "0,1,2\n0,1,2\n", "two rows of frame 0"),
        (HEAD + "-1,1,2\n", "names no frame"),
        (HEAD + "abc,1,2\n", "names no frame"),
        ("scorer,a,a\nbodyparts,k,k\ncoords,x\n0,1,2\n", "differ in length"),
        (HEAD + "999999999,1,2\n", "to 999999999"),
        (HEAD + "0,1,two\n", "frame 0: could not convert"),
        (HEAD + "0,1\n", "frame 0: "),
        (HEAD + "0,1,2,3\n", "frame 0: "),
        ("scorer,a,a\nbodyparts,k,k\ncoords,x,x\n0,1,2\n", "one column x and one y"),
        (HEAD + "0,1,2\n", "no point of ours"),
    ],
)
def test_what_is_no_such_table_or_holds_nothing_of_ours_is_refused(tmp_path, text, words):
    (tmp_path / "p.csv").write_text(text)
    with pytest.raises(ForeignError, match=words):
        read_points(tmp_path / "p.csv", 1)
