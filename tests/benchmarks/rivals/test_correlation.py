"""One box a link: joints go with their boxes and scale with them; a real tracker follows what moves."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.benchmarks.rivals import correlation
from tests.benchmarks.rivals.correlation import Options, follow
from tests.benchmarks.rivals.scenes import STANDING, moved_pictures, standing_body, texture, turning

BODY = standing_body()


@pytest.fixture
def boxes(monkeypatch):
    """Stands in for the trackers: hands on what the test makes of the first boxes."""
    seen = {}

    def worker(images, start, found):
        seen["start"] = np.load(start)
        np.save(found, np.stack([seen["move"](seen["start"], t) for t in range(len(np.load(images)))]))

    monkeypatch.setattr(correlation, "_worker", worker)
    return seen


def test_joints_go_with_their_boxes(boxes, rng):
    boxes["move"] = lambda start, t: start + t * np.array([3.0, -2.0, 0.0, 0.0])
    found = follow([texture(rng)] * 3, BODY)
    assert_allclose(found, BODY.joints + np.arange(3)[:, None, None] * np.array([3.0, -2.0]), atol=1e-9)


def test_joints_scale_with_their_boxes(boxes, rng):
    hip = np.array(STANDING["hip"])

    def grown(start, t):
        size, middle = start[:, 2:] * 1.1**t, start[:, :2] + 0.5 * start[:, 2:]
        return np.concatenate([hip + (middle - hip) * 1.1**t - 0.5 * size, size], axis=1)

    boxes["move"] = grown
    found = follow([texture(rng)] * 3, BODY)
    assert_allclose(found[2], hip + (BODY.joints - hip) * 1.21, atol=1e-9)


def test_a_box_has_its_link_and_what_is_asked_around_it(boxes, rng):
    boxes["move"] = lambda start, t: start
    follow([texture(rng)], BODY, Options(around=0.0))
    tight = boxes["start"]
    corners = BODY.outlines(BODY.joints)
    assert_allclose(tight[2, :2], corners[2].min(0))
    assert_allclose(tight[2, 2:], np.ptp(corners[2], axis=0))
    follow([texture(rng)], BODY, Options(around=0.1))
    assert_allclose(boxes["start"][2, 2:] - tight[2, 2:], 0.2 * BODY.leg)


def test_the_tracker_at_hand_follows_a_picture_that_shifts(rng):
    assert correlation.kind() in ("CSRT", "MIL")
    motions = [turning(t, degrees=0.0, step=(2.0, 1.0)) for t in range(4)]
    found = follow(moved_pictures(texture(rng), motions), BODY)
    # Boxes are found to a pixel or two.
    assert np.abs(found[-1] - BODY.joints - (6.0, 3.0)).mean() < 2.0


def test_a_tracker_that_fails_says_why(rng, monkeypatch, tmp_path):
    broken = tmp_path / "broken.py"
    broken.write_text("raise SystemExit('no such tracker')")
    monkeypatch.setattr(correlation, "WORKER", broken)
    with pytest.raises(RuntimeError, match="no such tracker"):
        follow([texture(rng)], BODY)
