"""What is compared: grids hold the defaults, and every switch turns something."""

import pytest
from pydantic import ValidationError

from tests.benchmarks.evaluation.ways import (
    BOXES,
    CV,
    DEFAULT,
    FILTERED,
    FLOW,
    RIVALS,
    Plan,
    full_plan,
    quick_plan,
)
from tests.benchmarks.rivals import correlation, lucas_kanade
from tracker.settings import Settings

FULL = full_plan()
SHIPPED = {
    CV: Settings(),
    DEFAULT: Settings(),
    FLOW: lucas_kanade.Options(),
    BOXES: correlation.Options(),
}


@pytest.mark.parametrize("name", SHIPPED)
def test_the_defaults_are_among_the_values_tried(name):
    grid = FULL.grids[name]
    assert tuple(getattr(SHIPPED[name], setting) for setting in grid.names) in grid.ways


def test_a_grid_has_a_way_for_every_combination():
    grid = FULL.grids[CV]
    assert grid.names == ("cv_angle", "cv_place")
    assert len(set(grid.ways.values())) == len(grid.ways) == 20
    for (angle, place), way in grid.ways.items():
        assert (way.model, way.settings.cv_angle, way.settings.cv_place) == ("cv", angle, place)


def test_every_switch_changes_the_default_model_in_its_own_way():
    ways = FULL.switched()
    assert all(way.model == DEFAULT and way.settings != Settings() for way in ways.values())
    assert len(set(ways.values())) == len(ways)


def test_every_model_is_compared_smoothed_and_filtered_with_the_same_settings():
    rows = FULL.rows({"cv_angle": 3.0})
    smoothed = [name for name in rows if not name.endswith(FILTERED)]
    assert len(rows) == 2 * len(smoothed)
    for name in smoothed:
        way, filtered = rows[name], rows[name + FILTERED]
        assert way.smooth
        assert not filtered.smooth
        assert (way.model, way.settings) == (filtered.model, filtered.settings)


def test_constant_velocity_gets_the_noise_that_was_chosen_for_it():
    rows = FULL.rows({"cv_angle": 3.0})
    assert rows[CV].settings == Settings(cv_angle=3.0)
    assert rows[f"{CV}, classic"].settings == Settings(cv_angle=3.0, mode="classic")


def test_a_setting_that_there_is_not_is_refused():
    with pytest.raises(ValidationError, match="no_such"):
        Plan({}, {}, {"row": {"no_such": 1.0}}).switched()


def test_a_quick_plan_is_a_part_of_the_full_one():
    quick = quick_plan()
    assert quick.without.items() <= FULL.without.items()
    assert quick.compared.items() <= FULL.compared.items()
    assert set(RIVALS) & set(quick.grids)
