"""One clip, one way: the colour band, and what two equal wishes cost."""

import numpy as np
import pytest

from tests.benchmarks.evaluation import cases
from tests.benchmarks.evaluation.cases import Ours, band_error, band_of, outcomes
from tracker.progress import Progress


def test_the_band_need_not_lie_on_the_joint_but_its_path_must_be_the_same(rng):
    path = rng.normal(size=(30, 2)) * 20.0
    band = {t: tuple(at) for t, at in enumerate(path)}
    beside = {t: {"near_knee": (at[0] + 3.0, at[1] - 7.0)} for t, at in enumerate(path)}
    assert band_error(beside, band) == pytest.approx(0.0, abs=1e-9)


def test_the_error_of_the_path_is_that_of_its_distance_in_the_plane(rng):
    errors = rng.normal(size=(4000, 2)) * (2.0, 1.0)
    found = {t: {"near_knee": tuple(error)} for t, error in enumerate(errors)}
    # sqrt(2^2 + 1^2), to a standard error of about one per cent.
    assert band_error(found, dict.fromkeys(found, (0.0, 0.0))) == pytest.approx(np.sqrt(5.0), rel=0.04)


def test_only_what_was_seen_of_the_band_counts(tmp_path):
    (tmp_path / "walk.markers.csv").write_text(
        "frame,keypoint,x,y,visible\n0,near_knee,1,2,1\n0,hip_band,5,5,1\n1,near_knee,3,4,0\n2,hip_band,5,5,1\n"
    )
    assert band_of(tmp_path / "walk.mp4") == {0: (1.0, 2.0)}


def test_a_clip_without_a_table_of_markers_has_no_band(tmp_path):
    assert band_of(tmp_path / "walk.mp4") == {}


def test_the_band_of_the_open_clip_is_seen_in_all_105_frames(data_dir):
    assert sorted(band_of(data_dir / "video" / "markers_walk_lr.mp4")) == list(range(105))


def test_equal_ways_are_measured_once_and_answers_keep_their_clips(monkeypatch, tmp_path):
    asked = []

    def measured(function, wanted, progress, name):
        asked.extend(wanted)
        return [(case.clip.name, case.way) for case in wanted]

    monkeypatch.setattr(cases, "measured", measured)
    clips = [tmp_path / "a.mp4", tmp_path / "b.mp4"]
    found = outcomes(clips, [Ours("cv"), Ours("gait"), Ours("cv")], Progress("quiet"), "")
    assert len(asked) == 4
    assert found[Ours("gait")] == [("a.mp4", Ours("gait")), ("b.mp4", Ours("gait"))]
