"""The horse that ships on a real one: followed by constant velocity, then by a model of its own stride."""

from dataclasses import replace

import pytest

from kinematics.figure_file import load_figure
from tests.tracker.clips import figtrack, read_csv
from tracker.api import follow
from tracker.run.read import read_track
from tracker.run.score import places, score
from tracker.settings import Settings
from tracker.tables.keypoints import read_keypoints

pytestmark = pytest.mark.claims

HOOVES = ("fore_hoof", "hind_hoof")


def test_a_galloping_horse_is_followed_by_constant_velocity_and_by_a_model_of_its_own_stride(
    data_dir, tmp_path
):
    clip = data_dir / "animals" / "beach_horse_lr.mp4"
    table = clip.with_name("beach_horse_lr.keypoints.csv")
    figure = load_figure("horse")
    truth = read_keypoints(table, figure.marks)
    run, model = tmp_path / "run1", tmp_path / "horse.npz"
    words = ["--keypoints", table, "--figure", "horse", "--model", "cv", "--no-overlay", "--no-report"]
    figtrack("track", clip, *words, "--out", run)
    figtrack("learn", run / "pose.csv", "--figure", "horse", "--out", model)
    assert {row["outcome"] for row in read_csv(run / "pose.csv")} == {"ok", "hidden"}
    learned = follow(clip, table, figure="horse", model=str(model))
    for track, most in ((read_track(run, Settings().mark, figure), 0.08), (learned, 0.067)):
        assert len(track) == 46
        assert track.measured.all()
        found = score(truth, places(track), 0, figure)
        assert found.mean_error_leg < most
        assert max(found.frame_errors.values()) < 0.11
        for hoof in HOOVES:
            pair = replace(figure, scored=(f"near_{hoof}", f"far_{hoof}"))
            assert score(truth, places(track), 0, pair).swaps == 0
