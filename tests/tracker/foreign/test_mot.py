"""MOT: OpenSim's signs, no missing numbers, and what is not measured is said."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.kinematics.figures import WALKER
from tests.tracker.records import FIRST, T, made_track, validated, write_folder
from tracker.foreign.mot import write_mot
from tracker.foreign.scale import scale_by_height
from tracker.foreign.text_files import ForeignError
from tracker.run.read import read_run


@pytest.fixture(params=[1, -1], ids=["right", "left"])
def track(request, rng):
    return made_track(rng, facing=request.param)


@pytest.fixture
def record(track, tmp_path):
    return read_run(write_folder(track, tmp_path / "run"))


def columns_of(path):
    """Header and columns by name, read as the format is described."""
    head, _, body = path.read_text().partition("\nendheader\n")
    names, *rows = [line.split("\t") for line in body.splitlines()]
    return head, {
        name: np.array(column, float) for name, column in zip(names, zip(*rows, strict=True), strict=True)
    }


def test_angles_have_the_signs_of_opensim_s_gait_models(track, record, tmp_path):
    write_mot(record, record.facing, None, tmp_path / "w.mot")
    _, found = columns_of(tmp_path / "w.mot")
    degrees = {name: np.degrees(track.q[:, WALKER.index(name)]) for name in WALKER.freedoms[2:10]}
    right, left = ("near", "far") if track.view.facing > 0 else ("far", "near")
    wanted = {
        "time": record.times[FIRST : FIRST + T],
        "trunk_angle": degrees["torso"],
        "hip_flexion_r": degrees[f"hip_{right}"],
        "knee_angle_r": -degrees[f"knee_{right}"],
        "ankle_angle_r": degrees[f"ankle_{right}"],
        "hip_flexion_l": degrees[f"hip_{left}"],
        "knee_angle_l": -degrees[f"knee_{left}"],
        "ankle_angle_l": degrees[f"ankle_{left}"],
        "lumbar_extension": -degrees["torso"],
    }
    assert list(found) == list(wanted)
    for name, numbers in wanted.items():
        assert_allclose(found[name], numbers, atol=1e-4, err_msg=name)


def test_facing_the_other_way_turns_every_angle(record, tmp_path):
    write_mot(record, record.facing, None, tmp_path / "a.mot")
    write_mot(record, -record.facing, None, tmp_path / "b.mot")
    (_, one), (_, other) = columns_of(tmp_path / "a.mot"), columns_of(tmp_path / "b.mot")
    assert_allclose(other["trunk_angle"], -one["trunk_angle"])
    for angle in ("hip_flexion", "knee_angle", "ankle_angle"):
        assert_allclose(other[f"{angle}_r"], -one[f"{angle}_l"])
        assert_allclose(other[f"{angle}_l"], -one[f"{angle}_r"])


def test_the_pelvis_is_at_the_hip_in_metres(record, tmp_path):
    scale = scale_by_height(record, 1.75, record.facing)
    write_mot(record, record.facing, scale, tmp_path / "w.mot")
    _, found = columns_of(tmp_path / "w.mot")
    assert list(found)[:4] == ["time", "pelvis_tx", "pelvis_ty", "trunk_angle"]
    hip = scale.to_metres(record.place("hip"))[FIRST : FIRST + T]
    assert_allclose(np.stack([found["pelvis_tx"], found["pelvis_ty"]], axis=1), hip, atol=1e-6)


def test_what_is_not_measured_is_left_out_and_said(record, tmp_path):
    said = write_mot(record, record.facing, None, tmp_path / "w.mot")
    head, found = columns_of(tmp_path / "w.mot")
    assert len(found["time"]) == T
    lost = ("2 frames without a pose are left out", "2 frames were lost or out of the picture")
    for words in (*lost, "no pelvis position"):
        assert words in said
        assert words in head
    assert "knee flexion -" in head


def test_nothing_is_said_where_nothing_is_missing(rng, tmp_path):
    track = made_track(rng, outcomes=("ok",) * T)
    object.__setattr__(track, "first", 0)
    record = read_run(write_folder(track, tmp_path / "run", length=T))
    assert write_mot(record, 1, scale_by_height(record, 1.75, 1), tmp_path / "w.mot") == ""


def test_the_validator_finds_nothing_wrong(record, tmp_path):
    path = tmp_path / "w.mot"
    write_mot(record, record.facing, scale_by_height(record, 1.75, 1), path)
    validated("check_trc.py", path, "--names", "pelvis_tx,pelvis_ty,knee_angle_r,knee_angle_l")


def test_a_figure_without_a_trunk_has_no_angles_for_opensim_and_no_height(record, tmp_path):
    legs = tuple("a_link" if name == "torso" else name for name in record.freedoms)
    with pytest.raises(ForeignError, match="a MOT has torso, which this run's figure has not"):
        write_mot(replace(record, freedoms=legs), 1, None, tmp_path / "w.mot")
    ends = tuple("an_end" if name == "head_top" else name for name in record.names)
    with pytest.raises(ForeignError, match="no head and trunk"):
        scale_by_height(replace(record, names=ends), 1.75, 1)
