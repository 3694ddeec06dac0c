"""The page on spoiled points: what is counted, which smoother is shown, and one real clip all the way."""

import numpy as np
import pytest

from tests.benchmarks.evaluation.outcomes import outcome
from tests.benchmarks.evaluation.points import (
    ASKED,
    BOTH,
    FOLLOWED,
    MEDIAN,
    POINTS_ALONE,
    REPAIRS,
    SMOOTHER,
    Case,
    Found,
    cases,
    page,
    repaired,
)


def row(*means, exchanged=None, lost=None):
    return [Found(outcome(mean, lost=lost).score, exchanged) for mean in means]


@pytest.fixture
def asked():
    """Two draws of two clips for every way."""
    found = {way: row(0.2, 0.4, 0.1, 0.3) for way in (*REPAIRS, *FOLLOWED)}
    found[f"{SMOOTHER}, 3"] = row(0.1, 0.1, 0.1, 0.1)
    found[BOTH] = row(0.02, 0.04, 0.06, 0.08, exchanged=(3, 2, 1))
    return found


def test_a_row_has_every_clip_s_mean_over_its_draws_and_all_that_was_found(asked, tmp_path):
    clips = [tmp_path / "a.mp4", tmp_path / "b.mp4"]
    worse = {"rain": {MEDIAN: row(0.5, 0.3, lost=7), BOTH: row(0.1, 0.2)}}
    lines = page(clips, 2, asked, worse).splitlines()
    ours = next(line for line in lines if line.startswith(f"| {BOTH} "))
    assert ours == f"| {BOTH} | 0.030 | 0.070 | 0.050 | 1.5 | 0 of 4 | 0 | 8 of 12, 4 falsely |"
    assert "| rain | 0.400 (2) | 0.150 |" in lines
    assert sum(line.startswith(f"| {SMOOTHER}") for line in lines) == 1
    assert any("3 px a frame squared, is the best" in line for line in lines)


def test_every_clip_is_drawn_as_often_as_asked(tmp_path):
    drawn = cases([tmp_path / "a", tmp_path / "b"], MEDIAN, ASKED, 2)
    assert [(case.clip.name, case.draw) for case in drawn] == [("a", 0), ("a", 1), ("b", 0), ("b", 1)]


def test_all_ways_get_the_same_points_and_ours_repairs_them_on_a_real_clip(data_dir):
    clip = data_dir / "video" / "fence_run_lr.mp4"
    found = {way: repaired(Case(clip, way, ASKED, 1)) for way in (MEDIAN, POINTS_ALONE, BOTH)}
    means = {way: each.score.mean_error_leg for way, each in found.items()}
    assert max(means[POINTS_ALONE], means[BOTH]) < 0.06 < means[MEDIAN]
    assert found[MEDIAN].exchanged is None
    there, right, wrong = found[POINTS_ALONE].exchanged
    assert (there, right, wrong) == (2, 2, 0)
    assert np.isfinite(found[BOTH].score.link_errors).all()
