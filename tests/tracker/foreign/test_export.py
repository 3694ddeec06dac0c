"""figtrack export: every format from one run, where it goes, and what keeps it from being written."""

import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kinematics.spm import UNMOVED
from tests.kinematics.figures import ARMS, WALKER
from tests.tracker import clips
from tests.tracker.clips import everything, figtrack, succeeds
from tests.tracker.records import FIRST, FRAMES, T, made_track, write_folder
from tracker.foreign import export
from tracker.foreign.export import FORMATS
from tracker.foreign.formats import read_people, read_points
from tracker.run.read import read_run

HEIGHT = {True: ("--height", 1.75), False: ()}  # of formats in which a scale counts, and others


@pytest.fixture
def run(rng, tmp_path):
    return write_folder(made_track(rng), tmp_path / "späte Läufe" / "walk-track")


def exported(run, to, *more):
    return clips.printed("export", run, "--to", to, *more)


def refused(*words):
    return clips.refused("export", *words)


def test_every_format_is_written_beside_one_unless_told(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    before = everything(run)
    for to in FORMATS:
        exported(run, to, *HEIGHT[FORMATS[to].scaled])
    endings = (".dlc.csv", ".trc", ".mot", "_px.trc", "-openpose", ".myogait.json")
    written = {path.name for path in tmp_path.iterdir()} - {"späte Läufe"}
    assert written == {f"walk-track{ending}" for ending in endings}
    assert everything(run) == before
    assert {path.name[:7] for path in (tmp_path / "walk-track-openpose").iterdir()} == {"walk 1_"}


def test_all_are_written_as_each_by_itself_and_what_cannot_be_is_said(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = succeeds("export", run, "--to", "all", *HEIGHT[True])
    assert [line.split()[0] for line in done.stdout.splitlines()] == ["wrote"] * len(FORMATS)
    every = everything(tmp_path)
    for to in FORMATS:
        exported(run, to, "--overwrite", *HEIGHT[FORMATS[to].scaled])
    assert everything(tmp_path) == every

    (tmp_path / "walk-track.trc").unlink()
    said = figtrack("export", run, "--to", "all", "--overwrite").stdout.splitlines()
    (line,) = (line for line in said if not line.startswith("wrote"))
    assert line.startswith("left out walk-track.trc: a TRC is in metres")
    together = figtrack("export", run, "--to", "all", "--overwrite", "--scale-points", "1,1,1,1,1").stdout
    assert "left out walk-track.trc: two points apart" in together
    assert "wrote walk-track_px.trc" in together
    assert not (tmp_path / "walk-track.trc").exists()
    assert figtrack("export", run, "--to", "all", "--out", tmp_path / "x").exit_code == 2


def test_where_one_of_all_cannot_be_replaced_none_is_written(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    exported(run, "myogait", "--height", 1.7)
    before = everything(tmp_path)
    left = tmp_path / f".{run.name}-openpose.deadbeef.part"
    left.mkdir()  # of a process that was killed while it wrote
    refused = figtrack("export", run, "--to", "all")
    assert not left.exists()
    assert refused.exit_code == 1
    assert "walk-track.myogait.json exists; choose another --out" in refused.stderr
    assert everything(tmp_path) == before


def test_all_readers_find_the_run_s_own_pixels(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    record = read_run(run)
    for to in ("dlc", "sports2d", "openpose"):
        exported(run, to)
    names = {"walk-track.dlc.csv": 9, "walk-track_px.trc": 9, "walk-track-openpose": 8}
    for name, joints in names.items():
        points = read_points(tmp_path / name, record.facing)
        assert (len(points), len(points.names)) == (FRAMES, joints)
        for joint in points.names:
            places = points.places[:, points.names.index(joint)]
            assert_allclose(places[record.measured], record.place(joint)[record.measured], atol=0.01)
            assert np.isnan(places[~record.measured]).all()


def test_deeplabcut_has_every_joint_of_a_person_with_further_ones(rng, tmp_path):
    heel = replace(WALKER.links[-1], name="heel", joint="far_heel", freedom=None, twin=None, learned=False)
    run = write_folder(made_track(rng, figure=replace(WALKER, links=(*WALKER.links, heel))), tmp_path / "run")
    exported(run, "dlc", "--out", tmp_path / "a.csv")
    parts = (tmp_path / "a.csv").read_text().splitlines()[1].split(",")[1::3]
    assert len(parts) == len(WALKER.marks) + 1
    assert {"Hip", "RAnkle", "far_heel"} < set(parts)


def test_elbows_and_wrists_and_their_angles_have_their_places(rng, tmp_path):
    track = made_track(rng, figure=ARMS)
    run = write_folder(track, tmp_path / "run")
    record, tips = read_run(run), {"near_elbow", "near_wrist", "far_elbow", "far_wrist"}
    for to in ("dlc", "openpose", "sports2d"):
        path = tmp_path / f"out_px.{to}"
        exported(run, to, "--out", path)
        points = read_points(path, record.facing, ARMS)
        assert tips <= set(points.names)
        wrist = points.places[:, points.names.index("near_wrist")]
        assert_allclose(wrist[record.measured], record.place("near_wrist")[record.measured], atol=0.01)
    exported(run, "trc", *HEIGHT[True], "--out", tmp_path / "m.trc")
    assert "RElbow" in (tmp_path / "m.trc").read_text()
    exported(run, "mot", "--out", tmp_path / "a.mot")
    header, first, *_ = (tmp_path / "a.mot").read_text().partition("endheader\n")[2].splitlines()
    row = dict(zip(header.split("\t"), map(float, first.split("\t")), strict=True))
    for name, freedom in (("arm_flex_r", "shoulder_near"), ("elbow_flex_l", "elbow_far")):
        assert row[name] == pytest.approx(np.degrees(track.q[0, ARMS.index(freedom)]), abs=1e-3)


def test_metres_do_not_follow_a_camera_that_moves_and_pixels_do(rng, tmp_path):
    still = replace(made_track(rng), moved=np.tile(UNMOVED, (T, 1)))
    moved = replace(still, moved=np.arange(T)[:, None] * [30.0, 20.0, 0.1] + UNMOVED)
    runs = [write_folder(track, tmp_path / name) for track, name in ((still, "still"), (moved, "moved"))]
    heads = {"m.trc": ("trc", 5), "a.mot": ("mot", -1), "p_px.trc": ("sports2d", 5)}
    found = {}
    for name, (to, head) in heads.items():
        for run in runs:
            path = tmp_path / f"{run.name} to" / name
            exported(run, to, *HEIGHT[FORMATS[to].scaled], "--out", path)
            lines = path.read_text().splitlines()
            rows = lines[head:] if head > 0 else lines[lines.index("endheader") + 2 :]
            found[run.name, to] = np.array([line.split("\t") for line in rows], dtype=float)
    for to in ("trc", "mot"):
        # Pixels are written to 0.0005, of 70 px a leg and 0.9 m.
        assert_allclose(found["moved", to], found["still", to], atol=1e-4)
    there, before = (found[way, "sports2d"][FIRST + 2, 2:4] for way in ("moved", "still"))
    middle = np.array(still.view.origin)
    assert_allclose(there - middle, [60.0, 40.0] + 1.2 * (before - middle), atol=0.01)


def test_facing_names_the_sides(run, tmp_path):
    exported(run, "dlc", "--out", tmp_path / "a.csv")
    exported(run, "dlc", "--out", tmp_path / "b.csv", "--facing", "left")
    (_, one), (_, other) = read_people(tmp_path / "a.csv"), read_people(tmp_path / "b.csv")
    for name, twin in (("RKnee", "LKnee"), ("LBigToe", "RBigToe"), ("Hip", "Hip")):
        found = [them[0][name] for them in one.values() if them]
        assert found
        assert found == [them[0][twin] for them in other.values() if them]
    exported(run, "myogait", "--out", tmp_path / "c.json", "--facing", "left")
    news = json.loads((tmp_path / "c.json").read_text())
    assert news["extraction"]["direction_detected"] == "left"


def heads(path):
    """(frames, 3) of the marker Head in a TRC."""
    rows = [line.split("\t") for line in path.read_text().splitlines()]
    i = rows[3].index("Head")
    return np.array([row[i : i + 3] for row in rows[5:]], float)


def test_a_trc_without_a_scale_is_refused(run, tmp_path):
    said = refused(run, "--to", "trc", "--out", tmp_path / "w.trc")
    assert "give --height METRES of the person, or --scale-points" in said
    assert not (tmp_path / "w.trc").exists()
    assert not list(tmp_path.rglob("*.part"))


@pytest.mark.parametrize("to", ["dlc", "openpose", "sports2d"])
@pytest.mark.parametrize("scale", [("--height", 1.75), ("--scale-points", "0,0,100,0,1")])
def test_a_scale_that_a_format_has_no_place_for_is_refused(run, tmp_path, to, scale):
    out = tmp_path / "w_px"
    assert f"{to} has no place for a height or a scale" in refused(run, "--to", to, *scale, "--out", out)
    assert not out.exists()


def test_myogait_keeps_the_height_and_takes_no_other_scale(run, tmp_path):
    exported(run, "myogait", "--height", 1.62, "--out", tmp_path / "m.json")
    assert json.loads((tmp_path / "m.json").read_text())["subject"] == {"height_m": 1.62}
    said = refused(run, "--to", "myogait", "--scale-points", "0,0,100,0,1", "--out", tmp_path / "n.json")
    assert "give --height" in said


def test_a_scale_that_the_run_has_is_taken_where_none_is_given(rng, tmp_path):
    track = made_track(rng)
    tall, scaled = (
        write_folder(track, tmp_path / name, **known)
        for name, known in (("tall", {"height": 1.8}), ("scaled", {"scale": 50.0}))
    )
    for run, same in ((tall, ("--height", 1.8)), (scaled, ("--scale-points", "0,0,50,0,1"))):
        exported(run, "trc", "--out", tmp_path / f"{run.name} a.trc")
        exported(run, "trc", *same, "--out", tmp_path / f"{run.name} b.trc")
        exported(run, "trc", "--height", 0.9, "--out", tmp_path / f"{run.name} c.trc")
        one, other, third = (heads(tmp_path / f"{run.name} {name}.trc") for name in "abc")
        assert_allclose(one, other, atol=2e-6)
        assert np.nanmax(np.abs(one - third)) > 0.1
    exported(tall, "myogait", "--out", tmp_path / "m.json")
    assert json.loads((tmp_path / "m.json").read_text())["subject"] == {"height_m": 1.8}


def test_sports2d_wants_px_in_the_name(run, tmp_path):
    assert "'_px' in its name" in refused(run, "--to", "sports2d", "--out", tmp_path / "w.trc")
    exported(run, "sports2d", "--out", tmp_path / "w_px.trc")


def test_myogait_wants_the_size_of_a_frame(rng, tmp_path):
    run = write_folder(made_track(rng), tmp_path / "run", size=None)
    assert "how large a frame is" in refused(run, "--to", "myogait", "--out", tmp_path / "m.json")


@pytest.mark.parametrize("to", ["dlc", "openpose"])
def test_what_is_there_is_replaced_only_when_asked(run, tmp_path, to):
    out = tmp_path / "out"
    exported(run, to, "--out", out)
    before = everything(tmp_path)
    assert "--overwrite" in refused(run, "--to", to, "--out", out)
    assert everything(tmp_path) == before
    exported(run, to, "--out", out, "--overwrite", "--facing", "left")
    assert everything(tmp_path).keys() == before.keys()
    assert everything(tmp_path) != before


def test_what_was_written_before_an_interrupt_is_told(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write, done = export.export_run, []

    def interrupted(*words, **more):
        if len(done) == 2:
            raise KeyboardInterrupt
        done.append(write(*words, **more))
        return done[-1]

    monkeypatch.setattr(export, "export_run", interrupted)
    said = refused(run, "--to", "all")
    written = {path.name for path in tmp_path.iterdir() if path != run.parent}
    assert len(written) == 2
    assert all(name in said for name in written)
