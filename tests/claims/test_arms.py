"""The walker with arms on a rendered walk whose every joint is known."""

import numpy as np
import pytest

from tests.tracker.clips import write_table, write_video
from tracker.api import follow
from tracker.scene.film import render

pytestmark = pytest.mark.claims

SEED, FRAMES, SIZE = 1, 60, (480, 270)
TRUNK_AND_LEGS = ("head_top", "neck", "hip", "near_knee", "near_ankle", "far_knee", "far_ankle")


def errors(track, scene, names):
    """(T, J) leg lengths."""
    places, truth = track.joints(), scene.joints | scene.arms
    of_each = [places[:, track.figure.joints.index(name)] - truth[name] for name in names]
    return np.hypot(*np.stack(of_each).T).T / scene.leg_px


def test_elbows_and_wrists_are_followed_and_legs_no_worse(tmp_path):
    scene = render(SEED, frames=FRAMES, size=SIZE, shrubs=False)
    write_video(tmp_path / "walk.mp4", scene.images)
    for name, marked in (("arms", scene.joints | scene.arms), ("none", scene.joints)):
        rows = [(0, joint, *places[0], 1) for joint, places in marked.items()]
        write_table(tmp_path / f"{name}.csv", rows)
    film, arms = tmp_path / "walk.mp4", tuple(scene.arms)
    alone = errors(follow(film, tmp_path / "none.csv"), scene, TRUNK_AND_LEGS).mean()
    for name, most in (("arms", 0.05), ("none", 0.1)):
        track = follow(film, tmp_path / f"{name}.csv", figure="walker-arms")
        assert np.median(errors(track, scene, arms)) < most
        assert errors(track, scene, TRUNK_AND_LEGS).mean() < alone + 0.003  # a fifth of a pixel
