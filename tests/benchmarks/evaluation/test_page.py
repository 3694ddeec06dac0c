"""The page of results: its figures are those measured, on two real clips and on outcomes made up."""

import re

import numpy as np
import pytest

from tests.benchmarks.evaluation.__main__ import QUICK_CLIPS
from tests.benchmarks.evaluation.held_out import tune
from tests.benchmarks.evaluation.measure import Results, Tuning, measure
from tests.benchmarks.evaluation.outcomes import outcome
from tests.benchmarks.evaluation.page import page, targets
from tests.benchmarks.evaluation.ways import (
    ALONE,
    BOXES,
    CV,
    DEFAULT,
    FILTERED,
    FLOW,
    MANY_STATES,
    ONE_STATE,
    RIVALS,
    Grid,
    quick_plan,
)
from tracker.progress import Progress


def rows_under(text, title):
    """Cells (strings) of the first table under a heading, by the first of each row."""
    part = re.split(r"^#+ ", text, flags=re.MULTILINE)
    section = next(lines for lines in part if lines.startswith(title + "\n"))
    lines = [line for line in section.splitlines() if line.startswith("|")]
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    return {row[0]: row[1:] for row in cells[2:]}


def made_up(clips, **means):
    """Results with these mean errors (clips) by row; what is not named has 0.1 throughout."""
    names = [DEFAULT, DEFAULT + FILTERED, MANY_STATES, ONE_STATE, ALONE, CV, *RIVALS]
    rows = {name: [outcome(m) for m in means.get(name, [0.1] * len(clips))] for name in names}
    # With the other value cv is better on the first clip and worse on the rest.
    others = {DEFAULT: [0.5] * len(clips), CV: [0.05] + [0.9] * (len(clips) - 1)}
    grids = {name: tuned(rows[name], [outcome(m) for m in other]) for name, other in others.items()}
    return Results(tuple(clips), rows, {}, grids)


def tuned(*found):
    """A setting tuned over the values 0, 1, ..., with which this was found (clips)."""
    grid = {(float(value),): outcomes for value, outcomes in enumerate(found)}
    return Tuning(Grid(("inflation",), {}), grid, tune(grid))


@pytest.fixture
def clips(tmp_path):
    return [tmp_path / f"{name}.mp4" for name in ("a_walk_lr", "b_run_rl")]


def test_two_real_clips_make_a_page_with_real_rows(data_dir):
    folder = data_dir / "video"
    clips = [folder / f"{name}.mp4" for name in QUICK_CLIPS]
    results = measure(clips, quick_plan(), Progress("quiet"))
    text = page(results, quick=True)
    found = rows_under(text, "Models and rivals")
    assert set(found) == set(results.rows)
    assert {DEFAULT, DEFAULT + FILTERED, ONE_STATE, CV, FLOW} <= set(found)
    for cells in found.values():
        errors = [float(cell.split()[0]) for cell in cells[: len(clips)]]
        assert np.mean(errors) == pytest.approx(float(cells[len(clips)]), abs=0.0011)
        assert 0.01 < min(errors) < 1.0
    assert len({tuple(cells) for cells in found.values()}) == len(found)
    best = min(float(row[-2]) for row in _grid_rows(text, CV))
    assert float(found[CV][len(clips)]) == pytest.approx(best, abs=0.0006)
    assert 0.5 < float(rows_under(text, "Calibration")[DEFAULT][len(clips)]) < 100.0


def _grid_rows(text, name):
    section = text.split(f"### {name}\n")[1].split("\n### ")[0]
    return [line.strip("| ").split(" | ") for line in section.splitlines() if line.startswith("|")][2:]


def test_ratios_are_of_means_over_clips_and_the_best_rival_counts(clips):
    means = {DEFAULT: [0.02, 0.06], CV: [0.1, 0.3], FLOW: [0.4, 0.4], BOXES: [0.5, 0.1]}
    reached = {target.text: target for target in targets(made_up(clips, **means))}
    assert reached["mean error against constant velocity's"].value == pytest.approx(0.2)
    # By the second clip alone the first value is better, by the first clip alone the other.
    assert reached["the same, each clip held out"].value == pytest.approx(0.04 / 0.5)
    assert reached["mean error against the best rival's without weights"].value == pytest.approx(0.04 / 0.3)


def test_walks_and_runs_are_judged_by_their_worst(clips):
    clips += [clip.with_name(f"c_{clip.name}") for clip in clips]
    reached = {t.text: t.value for t in targets(made_up(clips, **{DEFAULT: [0.04, 0.05, 0.03, 0.09]}))}
    assert reached["mean error of the worst walk"] == 0.04
    assert reached["mean error of the worst run"] == 0.09


def test_many_states_are_judged_in_the_mean_and_on_the_worst_clip(clips):
    means = {MANY_STATES: [0.06, 0.03], ALONE: [0.05, 0.10]}
    reached = {target.text: target for target in targets(made_up(clips, **means))}
    assert reached[f"{MANY_STATES} against {ALONE}, mean error"].value == pytest.approx(0.6)
    worst = reached[f"{MANY_STATES} against {ALONE}, worst clip"]
    assert worst.value == pytest.approx(1.2)
    assert not worst.reached


def test_marks_of_all_clips_share_one_median_and_two_sigma_counts_marks(clips):
    results = made_up(clips)
    results.rows[DEFAULT][:] = [
        outcome(0.1, marks=(0.01,), distances=(8.0,), band=2.5),
        outcome(0.1, marks=(0.05, 0.06, 0.07), distances=(1.0, 1.0, 2.0), lost=15),
    ]
    reached = {target.text: target.value for target in targets(results)}
    assert reached["median error of all marks"] == pytest.approx(0.055)
    assert reached[f"NEES, {DEFAULT}"] == pytest.approx(3.0)
    assert reached[f"share inside two sigma, {DEFAULT}"] == pytest.approx(0.75)
    assert reached["knee against the colour band, px"] == 2.5
    assert reached["clips lost"] == 1


def test_a_lost_clip_shows_where(clips):
    results = made_up(clips)
    results.rows[CV][1] = outcome(0.4, lost=15)
    cells = rows_under(page(results, quick=False), "Models and rivals")[CV]
    assert cells[:2] == ["0.100", "0.400 (15)"]
    assert "1 of 2" in cells
