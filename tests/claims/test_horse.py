"""The horse that ships on a real one: followed by constant velocity, then by a model of its own stride."""

import numpy as np
import pytest

from kinematics.figure_file import load_figure
from tests.tracker.clips import figtrack, read_csv
from tracker.api import follow
from tracker.run.read import read_track
from tracker.settings import Settings
from tracker.tables.keypoints import read_keypoints

pytestmark = pytest.mark.claims

UNIT = 100.0  # pixels
HOOVES = ("fore_hoof", "hind_hoof")


def errors(track, truth):
    """Of every marked point after the start, in units, each at most 1."""
    places, column = track.joints(), track.figure.joints.index
    return {
        (t, name): min(float(np.hypot(*(places[t, column(name)] - (mark.x, mark.y)))) / UNIT, 1.0)
        for t, marks in truth.items()
        for name, mark in marks.items()
        if t > 0
    }


def exchanged(track, truth, hoof):
    """Marked frames in which a pair of hooves fits better, by a tenth of the unit, exchanged."""
    places, column = track.joints(), track.figure.joints.index
    pair = [f"near_{hoof}", f"far_{hoof}"]
    count = 0
    for t, marks in truth.items():
        if t > 0 and set(pair) <= set(marks):
            marked = np.array([(marks[name].x, marks[name].y) for name in pair])
            found = places[t, [column(name) for name in pair]]
            off = [np.hypot(*(one - marked).T).mean() for one in (found, found[::-1])]
            count += off[0] - off[1] > 0.1 * UNIT
    return count


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
    for track, most in ((read_track(run, Settings().mark, figure), 0.12), (learned, 0.10)):
        assert len(track) == 46
        assert track.measured.all()
        of_frames = errors(track, truth)
        assert np.mean(list(of_frames.values())) < 0.6 * most
        for frame in sorted(truth)[1:]:
            assert np.mean([off for (t, _), off in of_frames.items() if t == frame]) < 0.1
        assert sum(exchanged(track, truth, hoof) for hoof in HOOVES) == 0
