"""What `track --measure` promises on a real clip: a network's faults are repaired, by points alone too."""

from pathlib import Path

import pytest

from tests.benchmarks.evaluation.points import (
    ASKED,
    BOTH,
    MEDIAN,
    POINTS_ALONE,
    REPAIRS,
    SMOOTHER,
    Case,
    repaired,
)

pytestmark = pytest.mark.claims


@pytest.fixture(scope="module")
def clip(data_dir: Path) -> Path:
    return data_dir / "video" / "markers_walk_lr.mp4"


@pytest.mark.parametrize("way", [POINTS_ALONE, BOTH])
def test_exchanged_legs_gaps_and_jitter_are_repaired(way: str, clip: Path) -> None:
    found = repaired(Case(clip, way, ASKED, 0))
    rivals = [repaired(Case(clip, name, ASKED, 0)).score for name in REPAIRS]
    assert found.score.swaps == 0 < max(rival.swaps for rival in rivals)
    assert found.score.mean_error_leg < 0.04
    # At least a third less than any filter of each joint by itself.
    assert found.score.mean_error_leg < 0.67 * min(rival.mean_error_leg for rival in rivals)
    assert found.exchanged is not None
    there, right, wrong = found.exchanged
    assert right >= there - 1
    assert wrong <= 1


def test_the_filters_it_is_compared_with_do_repair_something(clip: Path) -> None:
    raw, *rest = (repaired(Case(clip, name, ASKED, 0)).score.mean_error_leg for name in REPAIRS)
    smoothers = [name for name in REPAIRS if name.startswith(SMOOTHER)]
    assert len(rest) == len(smoothers) + 1
    assert repaired(Case(clip, MEDIAN, ASKED, 0)).score.mean_error_leg < raw
    assert min(rest[1:]) < raw
