"""Two runs side by side: what changed is what was changed, in the table and on the page."""

import json
import re

import numpy as np
import pytest

from kinematics.figure_file import load_figure
from kinematics.sides import OTHER, SIDES
from tests.tracker.clips import figtrack, read_json, succeeds
from tests.tracker.records import made_track, walked, write_folder
from tracker.gait.figures import Gait
from tracker.gait.values import Measure, Value
from tracker.report.before_after import Change, _changes, _walked, compare_runs
from tracker.run.read import RunError

FLOAT = r"[-\N{MINUS SIGN}]?\d+\.\d+"


@pytest.fixture
def runs(tmp_path):
    """A walk, and a quicker one."""
    return walked(tmp_path / "monday"), walked(tmp_path / "friday", period=1.0)


def rows(text):
    """Before, after and change by what they are of."""
    found = {}
    for line in text.splitlines()[1:]:
        name = re.split(r"  +", line)[0]
        numbers = re.findall(rf"({FLOAT}) \N{{PLUS-MINUS SIGN}}", line)
        found[name] = tuple(float(number.replace("\N{MINUS SIGN}", "-")) for number in numbers)
    return found


def test_what_was_changed_is_what_changed(runs, tmp_path):
    text = compare_runs(*runs, tmp_path / "page.html")
    found = rows(text)
    for side in ("near", "far"):
        assert found[f"stride time (s), {side}"] == pytest.approx((1.1, 1.0, -0.1), abs=0.01)
        assert found[f"hip range (\N{DEGREE SIGN}), {side}"][2] == pytest.approx(0.0, abs=0.3)
    assert found["cadence (steps/min)"] == pytest.approx((120 / 1.1, 120.0, 120.0 - 120 / 1.1), abs=1.0)
    assert all(after - before == pytest.approx(by, abs=0.11) for before, after, by in found.values())
    starred = [line for line in text.splitlines()[1:] if line.endswith(" *")]
    assert any("stride time (s), near" in line for line in starred)
    assert not any("hip range" in line for line in starred)


def test_errors_of_two_runs_add_in_quadrature_and_tell_a_change_from_chance():
    change = Change("stance", "%", Value(60.0, 3.0, 4), Value(70.0, 4.0, 2))
    assert (change.by.mean, change.by.error, change.by.count) == (10.0, 5.0, 2)
    assert not change.sure
    assert Change("stance", "%", Value(60.0, 3.0, 4), Value(70.1, 4.0, 2)).sure
    assert Change("stance", "%", Value(70.1, 3.0, 4), Value(60.0, 4.0, 2)).sure


def test_one_leg_is_not_compared_with_the_other():
    def gait(near, far):
        sides = Measure("stride time", "s", near, far, both=near or far)
        return Gait(
            (sides, Measure("cadence", "steps/min", both=Value(110.0, 1.0, 4))), {}, 1.0, "walk", False, None
        )

    value = Value(1.0, 0.1, 4)
    same = {side: side for side in SIDES}
    for after, pairs in ((gait(None, value), same), (gait(value, None), OTHER)):
        assert [change.name for change in _changes(gait(value, None), after, pairs)] == ["cadence"]
    for after, pairs in ((gait(value, value), same), (gait(None, value), OTHER)):
        assert [change.name for change in _changes(gait(value, None), after, pairs)] == [
            "stride time, near", "cadence",
        ]  # fmt: skip


def test_who_turned_round_is_compared_leg_by_leg(tmp_path):
    swings = np.radians([28.0, 24.0])
    right = walked(tmp_path / "right", swings=swings)
    left = walked(tmp_path / "left", swings=swings[::-1], start=0.85, facing=-1)
    text, page = compare_runs(right, left, tmp_path / "page.html"), (tmp_path / "page.html").read_text()
    found = rows(text)
    assert "face opposite ways" in text
    assert "face opposite ways" in page
    for side in SIDES:
        assert found[f"hip range (\N{DEGREE SIGN}), {side}"][2] == pytest.approx(0.0, abs=0.5)
    for plot in json.JSONDecoder().raw_decode(page, page.index('{"cycles"'))[0]["cycles"]:
        if plot["title"].startswith("Hip"):
            assert plot["legs"]["before"]["mean"] == pytest.approx(plot["legs"]["after"]["mean"], abs=1.0)


def test_what_limits_a_comparison_is_said(runs, tmp_path):
    assert compare_runs(*runs, tmp_path / "page.html").count("\n\n") == 0
    news = read_json(runs[1] / "run.json") | {"warnings": ["<nothing> matched"]}
    (runs[1] / "run.json").write_text(json.dumps(news))
    short = walked(tmp_path / "short", seconds=3.2)
    said, page = compare_runs(short, runs[1], tmp_path / "page.html"), (tmp_path / "page.html").read_text()
    assert "\n\nOf a single stride the error is that of the poses alone" in said
    assert said.endswith("\n\nfriday: <nothing> matched")
    assert '<p class="warning">friday: &lt;nothing&gt; matched' in page


def test_lengths_are_in_metres_only_where_both_are(tmp_path):
    one, other, third = (
        walked(tmp_path / name, height=height) for name, height in (("a", 1.7), ("b", None), ("c", 1.8))
    )
    mixed = compare_runs(one, other, tmp_path / "mixed.html")
    assert "speed (leg lengths/s)" in mixed
    assert "metres are known of one" in (tmp_path / "mixed.html").read_text()
    assert "speed (m/s)" in compare_runs(one, third, tmp_path / "both.html")
    assert "metres are known" not in (tmp_path / "both.html").read_text()


def test_the_page_draws_both_and_marks_what_changed(browser, runs, tmp_path):
    page = tmp_path / "page.html"
    compare_runs(*runs, page)
    browser.open(page.as_uri())
    titles = browser.each(".cycles .head", "one.innerText")
    assert [title.split("\n") for title in titles[:1]] == [
        ["Hip, near", "degrees", "before, 4 strides", "after, 5 strides"]
    ]
    assert len(browser.each(".cycles .panel:first-child path.curve", "one.id")) == 2
    assert len(browser.each(".cycles .panel:first-child path.thin", "one.id")) > 4
    bold = browser.each("tr:has(b)", "one.cells[0].innerText")
    assert any("stride time, near" in name for name in bold)
    assert not any("hip range" in name for name in bold)
    browser.open(page.as_uri(), width=390)
    assert browser.value("document.documentElement.scrollWidth <= window.innerWidth")
    assert browser.each(".wide", "one.scrollWidth <= one.clientWidth") == [True]


def test_the_command_writes_a_page_and_replaces_none(runs, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = succeeds("compare-runs", *runs)
    assert "open monday-friday.html" in done.stdout
    before = (tmp_path / "monday-friday.html").read_bytes()
    refused = figtrack("compare-runs", *runs)
    assert refused.exit_code == 1
    assert refused.stderr.startswith("error: ")
    assert (tmp_path / "monday-friday.html").read_bytes() == before
    for name in ("run.json", "gait.json"):
        refused = figtrack("compare-runs", *runs, "--overwrite", "--out", runs[1] / name)
        assert "is what the work reads" in refused.stderr


def test_a_run_without_strides_is_refused_in_one_line(runs, tmp_path):
    short = walked(tmp_path / "short", period=50.0)
    with pytest.raises(RunError, match="short has no whole stride"):
        compare_runs(runs[0], short, tmp_path / "page.html")
    (runs[1] / "gait.json").unlink()  # as of a horse
    with pytest.raises(RunError, match=r"friday has no gait\.json; only runs of people have one"):
        compare_runs(*runs, tmp_path / "page.html")
    assert not (tmp_path / "page.html").exists()


@pytest.mark.parametrize("rate", ["0", "-1", "NaN", '"half"'])
def test_damaged_gait_figures_are_told_by_their_file(rate, runs, tmp_path):
    path = runs[1] / "gait.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"rate": None}).replace("null", rate, 1))
    with pytest.raises(RunError, match=r"friday/gait\.json is damaged"):
        compare_runs(*runs, tmp_path / "page.html")
    for content in ("{", "[" * 100_000):
        path.write_text(content)
        with pytest.raises(RunError, match=r"friday/gait\.json is damaged .*; track the clip again"):
            compare_runs(*runs, tmp_path / "page.html")
    assert not (tmp_path / "page.html").exists()


def test_a_folder_s_name_is_no_html(runs, tmp_path):
    odd = runs[0].rename(tmp_path / "<i>monday")
    compare_runs(odd, runs[1], tmp_path / "page.html")
    assert "<i>monday" not in (tmp_path / "page.html").read_text()


def test_a_run_is_of_the_figure_that_it_was_followed_as(tmp_path):
    arms = load_figure("walker-arms")
    track = made_track(np.random.default_rng(0), figure=arms)
    folder = write_folder(track, tmp_path / "run", options={"figure": arms.name})
    (folder / "gait.json").write_text(json.dumps({"rate": 1.0}))
    assert _walked(folder).track.figure.joints == arms.joints
