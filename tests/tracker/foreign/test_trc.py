"""TRC in metres and in pixels: the layout to the letter, missing markers, there and back."""

import numpy as np
import pytest

from tests.tracker.people import trc
from tests.tracker.records import FPS, FRAMES, made_record, validated
from tracker.foreign.points import HALPE, Points, named_points
from tracker.foreign.scale import Scale, scale_by_height
from tracker.foreign.text_files import ForeignError
from tracker.foreign.trc import read_people, write_trc


@pytest.fixture(params=[1, -1], ids=["right", "left"])
def record(request, rng, tmp_path):
    return made_record(rng, tmp_path / "run", facing=request.param)


def test_the_layout_to_the_letter(tmp_path):
    places = np.array([[[110.0, 10.0], [0.0, 0.0]], [[90.0, 100.0], [5.0, 5.0]]])
    points = Points(("RKnee", "RAnkle"), places, np.array([[1.0, 0.0], [0.5, 0.0]]))
    scale = Scale(pixel=0.01, origin=100.0, floor=100.0, facing=1)
    write_trc(points, np.array([0.0, 0.0334]), 30000 / 1001, scale, tmp_path / "walk.trc")
    assert (tmp_path / "walk.trc").read_bytes().decode().replace("\t", ">") == (
        "PathFileType>4>(X/Y/Z)>walk.trc\n"
        "DataRate>CameraRate>NumFrames>NumMarkers>Units>OrigDataRate>OrigDataStartFrame>OrigNumFrames\n"
        "29.970030>29.970030>2>2>m>29.970030>1>2\n"
        "Frame#>Time>RKnee>>>RAnkle>>>\n"
        ">>X1>Y1>Z1>X2>Y2>Z2>\n"
        "1>0.000000>0.100000>0.900000>0.000000>nan>nan>nan\n"
        "2>0.033400>-0.100000>0.000000>0.000000>nan>nan>nan\n"
    )


def test_the_validator_finds_nothing_wrong_with_either(record, tmp_path):
    points = named_points(record, HALPE, record.facing)
    scale = scale_by_height(record, 1.75, record.facing)
    metres, pixels = tmp_path / "w.trc", tmp_path / "w_px.trc"
    write_trc(points, record.times, FPS, scale, metres)
    write_trc(points, record.times, FPS, None, pixels)
    names = ",".join(HALPE)
    assert f"'frames': {FRAMES}" in validated("check_trc.py", metres, "--names", names, "--fps", FPS)
    validated("check_trc.py", pixels, "--names", names, "--fps", FPS, "--allow-px")


def test_a_part_of_a_film_is_read_at_its_frames(tmp_path):
    path = trc(tmp_path / "w_px.trc", [{"left_knee": (float(t), 0.0)} for t in range(60)])
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[:5] + lines[45:]))
    assert {t: person["left_knee"].x for t, (person,) in read_people(path).items()} == {
        t: t for t in range(40, 60)
    }


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda text: "", "no TRC file"),
        (lambda text: text.replace("PathFileType", "Path"), "no TRC file"),
        (lambda text: text.replace("\tpx\t", "\tm\t"), "in m units"),
        (lambda text: text.replace("OrigDataRate", "Orig").replace("Units", "Unit"), "in no units"),
        (lambda text: text.replace("\t0.000000\n", "\n", 1), "three numbers a marker"),
        (lambda text: text.replace("DataRate", "Rate"), "no DataRate"),
        (lambda text: text.replace("\n1\t0.000000", "\n1\tinf"), "three numbers a marker"),
        (lambda text: text.replace("\n1\t", "\n1\n", 1), "three numbers a marker"),
        (lambda text: text.replace("\t0.000000\n", "\tzero\n", 1), "could not convert"),
        (lambda text: "\n".join(text.splitlines()[:5]) + "\n", "hold a frame"),
    ],
)
def test_what_is_no_trc_in_pixels_is_refused(record, tmp_path, spoil, words):
    path = tmp_path / "w_px.trc"
    write_trc(named_points(record, HALPE, 1), record.times, FPS, None, path)
    path.write_text(spoil(path.read_text()))
    with pytest.raises(ForeignError, match=words):
        read_people(path)
