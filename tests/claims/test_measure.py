"""What `track --measure` promises on a real clip: a network's faults are repaired, by points alone too."""

import pytest

from tests.benchmarks.evaluation.points import ASKED, BOTH, POINTS_ALONE, REPAIRS, repaired

pytestmark = pytest.mark.claims


@pytest.fixture(scope="module")
def clip(data_dir):
    return data_dir / "video" / "markers_walk_lr.mp4"


@pytest.fixture(scope="module")
def rivals(clip):
    """What filters of each joint by itself make of the points."""
    return {name: repaired(clip, name, ASKED, 0).score for name in REPAIRS}


@pytest.mark.parametrize("way", [POINTS_ALONE, BOTH])
def test_exchanged_legs_gaps_and_jitter_are_repaired(way, clip, rivals):
    found = repaired(clip, way, ASKED, 0)
    assert found.score.swaps == 0 < max(rival.swaps for rival in rivals.values())
    assert found.score.mean_error_leg < 0.04
    # At least a third less than any of them.
    assert found.score.mean_error_leg < 0.67 * min(rival.mean_error_leg for rival in rivals.values())
    assert found.exchanged is not None
    there, right, wrong = found.exchanged
    assert right >= there - 1
    assert wrong <= 1


def test_the_filters_it_is_compared_with_do_repair_something(rivals):
    raw, median, *smoothers = (rivals[name].mean_error_leg for name in REPAIRS)
    assert median < raw
    assert min(smoothers) < raw
