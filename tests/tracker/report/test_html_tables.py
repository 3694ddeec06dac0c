"""The tables of a report: what is rounded how, and nothing but words of ours goes in as HTML."""

import re
from dataclasses import replace

import pytest

from tests.tracker.report.reports import SCORE
from tests.tracker.strolls import stroll
from tracker.gait.figures import gait_of
from tracker.gait.values import Measure, Value
from tracker.report.html_tables import SCORE_COLUMNS, gait_table, html_table, in_columns, table_rows


def gait(*measures):
    return replace(gait_of(stroll()), measures=measures)


def test_the_text_table_has_a_row_a_model_in_columns():
    lost = replace(SCORE, first_failure_frame=7, frames_followed=3, angle_median_deg=None)
    rows = table_rows({"walk-run": SCORE, "cv": lost})
    head, first, second = in_columns([SCORE_COLUMNS, *rows]).splitlines()
    assert re.split(r"  +", first) == [
        "walk-run", "never", "9 of 9", "0.046", "0.031", "99 %", "0", "1.4 deg",
    ]  # fmt: skip
    assert re.split(r"  +", second)[:3] == ["cv", "7", "3 of 9"]
    assert head.index("followed") == first.index("9 of 9") == second.index("3 of 9")


def test_a_models_name_is_no_html():
    table = html_table(SCORE_COLUMNS, table_rows({"<b>&": SCORE}))
    assert "&lt;b&gt;&amp;" in table
    assert "<b>" not in table


@pytest.mark.parametrize(
    ("unit", "wanted"),
    [("s", "\u22121.235"), ("deg", "\u22121.2"), ("%", "\u22121.2"), ("steps/min", "\u22121.2")],
)
def test_seconds_have_three_decimals_and_all_else_one(unit, wanted):
    table = gait_table(gait(Measure("this", unit, near=Value(-1.2346, 0.1, 3))))
    assert f">{wanted} <" in table
    assert "\u22120" not in gait_table(gait(Measure("this", unit, near=Value(-1e-9, 0.1, 3))))


def test_what_stands_behind_a_plus_minus_is_two_standard_errors():
    table = gait_table(gait(Measure("this", "deg", far=Value(10.0, 1.5, 3))))
    assert "10.0 <small>\u00b1 3.0</small>" in table


def test_what_was_not_measured_is_a_dash():
    table = gait_table(gait(Measure("this", "deg", both=Value(10.0, 1.5, 3))))
    assert table.count("<td>\u2013</td>") == 3


def test_every_figure_of_a_gait_has_its_row():
    found = gait_of(stroll())
    table = gait_table(found)
    assert table.count("<th scope='row'>") == len(found.measures)
    for measure in found.measures:
        assert measure.name in table
