"""Metres: as long as the person is said to be, ahead and up from the floor."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.kinematics.figures import FOOTLESS, WALKER
from tests.tracker.records import T, made_record, made_track, write_folder
from tracker.foreign.scale import scale_by_height, scale_by_points
from tracker.run.read import RunError, read_run


@pytest.fixture(params=[1, -1], ids=["right", "left"])
def standing(request, rng, tmp_path):
    """Someone upright who moves ahead by 0.5 leg lengths a frame."""

    def make(figure=WALKER, *, bent=0.0):
        q = np.zeros((T, len(figure.freedoms)))
        q[:, 0] = 0.5 * np.arange(T)
        q[:, figure.index("knee_near")] = bent
        track = replace(made_track(rng, facing=request.param, figure=figure), q=q)
        return read_run(write_folder(track, tmp_path / "run")).in_scene()

    return make


def test_who_stands_upright_is_as_tall_as_told(standing):
    record = standing(FOOTLESS)
    head = scale_by_height(record, 1.80, record.facing).to_metres(record.place("head_top"))
    # Keypoints are written to 0.0005 px, of 70 px a leg and 0.9 m.
    assert_allclose(head[record.measured, 1], 1.80, atol=1e-4)


def test_the_lower_foot_stands_on_the_floor(standing):
    record = standing(bent=1.8)
    scale = scale_by_height(record, 1.80, record.facing)
    toes = np.stack([scale.to_metres(record.place(f"{side}_toe")) for side in ("near", "far")])
    assert_allclose(np.nanmedian(toes[..., record.measured, 1].min(0)), 0.0, atol=1e-4)
    assert (toes[0, record.measured, 1] > 0.1).all()


def test_without_toes_and_head_the_lower_ankle_tells_the_floor(standing):
    marks = tuple(name for name in FOOTLESS.marks if name not in ("head_top", "neck"))
    legs = replace(FOOTLESS, links=FOOTLESS.links[2:], marks=marks, scored=marks, panels=())
    record = standing(legs, bent=1.8)
    scale = scale_by_points(record, (0.0, 0.0, 50.0, 0.0, 1.0), record.facing)
    ankles = np.stack([scale.to_metres(record.place(f"{side}_ankle")) for side in ("near", "far")])
    assert_allclose(np.nanmedian(ankles[..., record.measured, 1].min(0)), 0.0, atol=1e-4)


def test_x_points_the_way_the_figure_faces_from_where_its_hip_was(standing):
    record = standing()
    hip = record.place("hip")[record.measured]
    hips = scale_by_height(record, 1.80, record.facing).to_metres(hip)[:, 0]
    assert hips[0] == pytest.approx(0.0, abs=1e-9)
    assert (np.diff(hips) > 0.1).all()
    backwards = scale_by_height(record, 1.80, -record.facing).to_metres(record.place("hip"))[
        record.measured, 0
    ]
    assert_allclose(backwards, -hips)


def test_two_points_give_the_scale(standing):
    record = standing()
    scale = scale_by_points(record, (10.0, 20.0, 40.0, 60.0, 2.0), record.facing)
    assert scale.pixel == pytest.approx(2.0 / 50.0)
    ends = scale.to_metres(np.array([[10.0, 20.0], [40.0, 60.0]]))
    assert np.hypot(*(ends[1] - ends[0])) == pytest.approx(2.0)


@pytest.mark.parametrize("points", [(1, 1, 1, 1, 2), (0, 0, 9, 9, 0), (0, 0, 9, 9, -1), (0, 0, np.nan, 9, 1)])
def test_points_that_give_no_scale_are_refused(standing, points):
    with pytest.raises(ValueError, match="two points apart and the metres between"):
        scale_by_points(standing(), points, 1)


def test_a_run_that_followed_nothing_has_no_scale(rng, tmp_path):
    record = made_record(rng, tmp_path / "run", outcomes=("lost",) * T)
    with pytest.raises(RunError):
        scale_by_height(record, 1.8, 1)
    with pytest.raises(RunError):
        scale_by_points(record, (0, 0, 9, 9, 1), 1)
