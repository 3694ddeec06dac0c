"""The papers' experiments: what they cut, hold out and measure, what they say of it, and the page."""

import json
import re
from functools import partial
from itertools import pairwise, product
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kinematics.mocap import Sequence as Capture
from tests.dynamics.hmms import density, random_hmm
from tests.tracker import gaits
from tests.tracker.clips import QUIET
from tests.tracker.models.captures import write_trials
from tracker.experiments import ahead, classify, gaps, measures, phases, runtime
from tracker.experiments import study as studies
from tracker.experiments.classify import SEEN, UNSEEN, Draw, Score
from tracker.experiments.reproduce import reproduce
from tracker.experiments.section import (
    INKS,
    Claim,
    Heading,
    Plot,
    Section,
    Table,
    Verdict,
    share_verdict,
    spread,
    write_findings,
)
from tracker.experiments.splices import LONGEST, SHORTEST, SIDE, Splice, splice
from tracker.experiments.study import Recipe, Study
from tracker.models.centred import centred

pytestmark = pytest.mark.whole

KEYS = ["phases", "classification", "prediction", "synthesis", "interpolation", "runtime"]
PEOPLE = "abcdef"


def gait(label, subject, frames=100):
    """A capture of somebody's gait."""
    rng = np.random.default_rng([*subject.encode()])
    y = gaits.gait(label, frames, rng, phase=2.0 * np.pi * rng.random())
    return Capture(y, subject, label, f"{subject}_{label}")


def study(**changes):
    """Everybody walks, every second one runs too."""
    captures = [gait("walk", who) for who in PEOPLE] + [gait("run", who) for who in PEOPLE[::2]]
    return Study(captures, captures, QUIET, **changes)


def run(folder, rows):
    """The page's text, what is for programs and what is said in a terminal."""
    out = folder / "out"
    said = reproduce(write_trials(folder, rows), out, overwrite=False, progress=QUIET, quick=True)
    assert sorted(path.name for path in out.iterdir()) == ["reproduce.html", "reproduce.json"]
    news = json.loads((out / "reproduce.json").read_text(encoding="utf-8"))
    return (out / "reproduce.html").read_text(encoding="utf-8"), news, said


def left_out(news):
    """The experiments that were left out."""
    return [key for key, claims in news["claims"].items() if claims[0]["verdict"] == Verdict.OPEN]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A quick run on two people who walk and run."""
    rows = [(who, "walk", 31.0 + i) for i, who in enumerate("ab")]
    rows += [(who, "run", 20.0 + i) for i, who in enumerate("ab")]
    return run(tmp_path_factory.mktemp("whole"), rows)


@pytest.fixture(scope="module")
def walks(tmp_path_factory):
    """A quick run on one person who walks."""
    return run(tmp_path_factory.mktemp("walks"), [("a", "walk", 33.0)])


def test_every_experiment_leaves_a_part_of_the_page_and_its_claims(whole):
    page, news, said = whole
    assert list(news["claims"]) == KEYS
    assert re.findall(r'<section id="(\w+)"', page) == KEYS
    assert not left_out(news)
    assert said.endswith("out/reproduce.html")


def test_the_page_loads_nothing_and_takes_its_ink_from_the_reader(whole):
    page, _, _ = whole
    assert page.count('role="img"') == 5
    assert not re.findall(r"""(?:src|href)=["'](?!#|data:)[^"']*""", page.replace("xlink:", ""))
    assert "@import" not in page
    assert "url(http" not in page
    assert "currentColor" in page
    assert not any(ink in page for ink in INKS)


def test_every_claim_stands_on_the_page(whole):
    page, news, _ = whole
    for claims in news["claims"].values():
        assert claims
        for claim in claims:
            assert claim["verdict"] in set(Verdict)
            assert page.count(claim["paper"].replace("'", "&#39;")) >= 2  # in short, and in its part


def test_captures_of_one_walker_leave_out_what_needs_runs_and_say_so(walks):
    page, news, said = walks
    assert left_out(news) == ["phases", "classification"]
    assert "no run" in news["claims"]["classification"][0]["here"]
    assert news["claims"]["classification"][0]["here"] in page
    assert "not tested" in said
    assert "Too few subjects to leave some out" in page


def test_a_table_without_walk_or_run_is_refused(tmp_path):
    with pytest.raises(ValueError, match="no walk or run"):
        run(tmp_path, [("a", "other", 33.0)])
    assert not (tmp_path / "out").exists()


def test_folds_have_every_motion_and_leave_every_motion(rng):
    tried = study()
    assert len(tried.folds) == 3
    for fold in tried.folds:
        for motion in ("walk", "run"):
            doing = {c.subject for c in tried.of(motion)}
            assert doing & fold
            assert doing - fold


def test_whom_a_recipe_holds_out_is_not_learned_from(monkeypatch):
    shown = []
    monkeypatch.setattr(studies, "learn_motions", lambda data, **_: shown.append(data))
    tried = study()
    held = tried.folds[0]
    tried.learn(Recipe(1, held=held))
    tried.learn(Recipe(1, held=held))
    assert len(shown) == 1  # each model once
    assert {subject for subject, _, _ in shown[0]} == set(PEOPLE) - held
    assert {c.subject for c in tried.tested(held)} == held


def test_bends_are_learned_from_but_never_measured_on(monkeypatch):
    shown = []
    monkeypatch.setattr(studies, "learn_motions", lambda data, **_: shown.append(data))
    straight = [gait("walk", "a"), gait("walk", "b")]
    tried = Study(straight, [*straight, gait("walk", "z")], QUIET)
    tried.learn(Recipe(1, motions=("walk",)))
    assert {subject for subject, _, _ in shown[0]} == {"a", "b", "z"}
    assert {c.subject for c in tried.captures} == {"a", "b"}


def flat(value, label, subject):
    """A capture that stands at one angle, by which its pieces are known again."""
    y = np.full((120, 8), float(value))
    return Capture(y, subject, label, subject)


def test_a_splice_is_pieces_of_the_right_length_and_label_smoothed_only_at_joints(rng):
    made = splice([flat(1, "walk", "a"), flat(2, "run", "b")], rng, pieces=30)
    lengths = np.diff([0, *made.joints, len(made.y)])
    assert lengths.min() >= SHORTEST
    assert lengths.max() <= LONGEST
    assert len(lengths) == 30
    torso, run_ = made.y[:, 2], np.array(made.labels) == "run"
    calm = made.far(SIDE)
    assert_allclose(torso[calm], np.where(run_, 2.0, 1.0)[calm], atol=1e-12)
    assert 0.2 < run_.mean() < 0.8
    changes = np.flatnonzero(run_[1:] != run_[:-1]) + 1
    assert set(changes) <= set(made.joints)
    assert len(changes)
    # Unsmoothed, the angle would jump by 1 from one frame to the next.
    assert np.abs(np.diff(torso)).max() < 0.5
    assert np.isnan(made.y[:, :2]).all()


def test_people_left_out_of_a_model_are_the_only_ones_it_is_shown(monkeypatch):
    shown = []

    def spy(captures, rng, pieces):
        shown.append({c.subject for c in captures})
        return splice(captures, rng, pieces)

    monkeypatch.setattr(classify, "splice", spy)
    tried = study()
    for draw in classify.draws(tried):
        wanted = set(draw.held) if draw.people == UNSEEN else set(PEOPLE)
        for _ in draw.splices:
            assert shown.pop(0) == wanted
    assert not shown


def test_a_score_counts_wrong_frames_far_ones_and_unsure_ones():
    made = Splice(np.zeros((60, 8)), ("walk",) * 30 + ("run",) * 30, (30,))
    draw = Draw(SEEN, frozenset(), (made,), (made.y,))
    walks = np.r_[np.ones(35), np.zeros(24), 1.0]  # five late, and one far from the joint
    walks[:15] = 0.9
    found = SimpleNamespace(prob=np.c_[walks, 1.0 - walks], path=None)
    assert_allclose(classify.score(draw, ("walk", "run"), [found]), [10.0, 2.5, 25.0])


def scores(hmm, slds):
    """Two states a motion: an error for the hidden Markov model, and one by order and inference."""
    found = {(2, order, name): [Score(e, 0.0, 0.0)] for order, (name, e) in product((1, 2), slds.items())}
    return {SEEN: found | {(2, 0, "hmm"): [Score(hmm, 0.0, 0.0)]}}


ALIKE = {"viterbi": 3.0, "gpb2": 3.0, "variational": 3.0}


@pytest.mark.parametrize(
    ("hmm", "verdict", "winner"), [(4.0, Verdict.HOLDS, "switching"), (2.0, Verdict.FAILS, "hidden Markov")]
)
def test_the_better_model_is_named_whichever_it_is(hmm, verdict, winner):
    claim = classify.claims(scores(hmm, ALIKE))[1]
    assert claim.verdict is verdict
    assert f"The best {winner} model wins" in claim.here


def test_inferences_that_differ_are_not_called_alike():
    assert classify.claims(scores(4.0, ALIKE))[3].verdict is Verdict.HOLDS
    apart = classify.claims(scores(4.0, ALIKE | {"gpb2": 5.0}))[3]
    assert apart.verdict is Verdict.FAILS
    assert "2.0 at most" in apart.here


def test_a_cut_by_the_leg_ahead_is_regular_and_tells_the_leg_and_a_random_one_does_not(rng):
    jogs = [gait("run", who, 220) for who in "ab"]
    legs = [(c.y[:, 4] > c.y[:, 6]).astype(int) for c in jogs]
    by_leg, by_chance = phases.Cut(), phases.Cut()
    by_leg.add(jogs, legs)
    by_chance.add(jogs, [rng.integers(2, size=220) for _ in jogs])
    assert min(by_leg.leg) == 100.0
    assert min(by_leg.regular) > 90.0
    assert_allclose(by_leg.switches, 2.0, atol=0.15)  # ten strides, cut at their ends
    assert max(by_chance.leg) < 65.0
    assert max(by_chance.regular) < 70.0
    assert phases.claim({2: by_leg}).verdict is Verdict.HOLDS
    assert phases.claim({2: by_chance}).verdict is Verdict.FAILS
    one_state_alone = phases.Cut([100.0], [50.0], [100.0], [0.0])
    assert phases.claim({2: one_state_alone}).verdict is Verdict.FAILS


def test_the_hidden_markov_forecast_is_the_mean_over_all_paths(rng):
    K, M, frames, horizon = 3, 2, 4, 2
    hmm = random_hmm(K, rng, M=M)
    y = rng.normal(size=(frames, M))
    total, mean = 0.0, np.zeros(M)
    for path in product(range(K), repeat=frames + horizon):
        p = hmm.pi0[path[0]] * np.prod([hmm.Pi[i, j] for i, j in pairwise(path)])
        p *= np.exp(sum(density(hmm, path[t], y[t]) for t in range(frames)))
        total, mean = total + p, mean + p * hmm.mean[path[-1]]
    found = ahead.hmm_forecast(hmm, y, horizon)
    assert_allclose(found[-1], mean / total, rtol=1e-10)
    assert np.isnan(found[:horizon]).all()
    assert np.isfinite(found[horizon:]).all()


def test_forecasts_are_scored_against_the_clean_pose_of_their_own_frame():
    capture = gait("walk", "a", 40)
    means = np.vstack([centred(capture.y), np.zeros((3, 8))])
    [exact] = measures.forecast_errors([capture, gait("walk", "b", 10)], [means, means], 10)
    assert (exact.count, exact.squares.max()) == (30, 0.0)
    [late] = measures.forecast_errors([capture], [np.roll(means, 1, axis=0)], 10)
    assert late.squares.max() > 0.05


def test_captures_without_a_frame_that_every_forecast_reaches_are_told_and_not_judged(monkeypatch):
    found = {name: {("walk", 1): [measures.Errors("a", np.ones(6), 1)]} for name in ahead.NAMES}
    monkeypatch.setattr(ahead, "_errors", lambda study, keys: found)
    for frames, text in (([40, 10], "are not judged; there are 1"), ([9], "is longer than")):
        captures = [gait("walk", who, T) for who, T in zip("ab", frames, strict=False)]
        assert text in str(ahead.run(Study(captures, captures, QUIET, quick=True)))


def test_errors_are_pooled_over_frames_and_kept_apart_by_person():
    cases = (("a", 3, 0.1), ("a", 1, 0.3), ("b", 4, 0.2))
    of = [measures.errors(who, np.full((n, 8), e), np.zeros((n, 8))) for who, n, e in cases]
    assert measures.rms(of) == pytest.approx(np.degrees(np.sqrt((3 * 0.01 + 0.09 + 4 * 0.04) / 8)))
    assert measures.by_person(of)["b"] == pytest.approx(np.degrees(0.2))


@pytest.mark.parametrize(("better", "verdict"), [(1.0, Verdict.HOLDS), (3.0, Verdict.FAILS)])
def test_prediction_is_called_better_only_where_its_error_is_lower(better, verdict):
    total = {"slds": {("walk", 1): better}, "kalman": {("walk", 1): 2.0}, "hmm": {("walk", 1): 2.0}}
    for rival in ("kalman", "hmm"):
        claim = ahead._against(total, rival)
        assert claim.verdict is verdict
        assert ("50 % less" if better < 2.0 else "50 % more") in claim.here


@pytest.mark.parametrize("degree", [1, 3])
def test_lines_and_splines_fill_lines_and_cubics_exactly(degree):
    capture = Capture(np.outer((np.arange(31.0) / 10.0) ** degree, np.ones(8)), "a", "walk", "a")
    found = measures.gap_errors(partial(measures.across, degree), capture, 10)
    assert_allclose(found.squares, 0.0, atol=1e-15)  # a not-a-knot spline of a cubic is the cubic
    assert found.count == 10


def test_a_gap_lies_in_the_middle_and_the_rest_is_shown_without_the_neck_s_mean():
    capture = gait("walk", "a", 60)
    shown = []
    found = measures.gap_errors(lambda y: shown.append(y) or np.zeros(y.shape), capture, 20)
    hidden = np.isnan(shown[0]).all(1)
    assert np.flatnonzero(hidden).tolist() == list(range(20, 40))
    assert np.isfinite(shown[0][~hidden]).all()
    assert shown[0][~hidden, 3].mean() == pytest.approx(0.0, abs=1e-12)
    assert_allclose(found.squares[2:], (capture.y[20:40, 4:] ** 2).sum(0))
    assert measures.spans(capture.y, 40)
    assert not measures.spans(capture.y, 41)


@pytest.mark.parametrize(
    ("path", "verdict"), [(5.0, Verdict.HOLDS), (19.0, Verdict.PARTLY), (21.0, Verdict.FAILS)]
)
def test_filling_is_judged_by_what_knows_nothing_of_walking(path, verdict):
    total = {(gaps.LINEAR, 50): 20.0, (gaps.SPLINE, 50): 25.0, (gaps.PATH, 50): path}
    assert gaps._quality(total, 50).verdict is verdict


def test_the_range_is_widened_on_both_sides_and_no_number_is_out_of_it():
    known, made = np.zeros((2, 8)), np.zeros((5, 8))
    known[1, 2:] = 1.0
    known[:, 3] = -0.5, 0.5
    made[:, 4] = -0.04, -0.06, 1.04, 1.06, np.nan
    assert measures.out_of_range(made, [known], 0.05).tolist() == [False, True, False, True, True]


@pytest.mark.parametrize(
    ("others", "verdict"),
    [((3.0, 2.0), Verdict.HOLDS), ((3.0, 1.2), Verdict.PARTLY), ((0.5, 0.8), Verdict.FAILS)],
)
def test_viterbi_is_the_clear_winner_only_if_all_others_take_half_as_long_again(others, verdict):
    micro = {4: {"viterbi": 10.0, "gpb2": 10.0 * others[0], "variational": 10.0 * others[1]}}
    assert runtime.claim(micro).verdict is verdict


def test_a_claim_of_all_cases_holds_in_part_from_half_of_them():
    found = [share_verdict([True] * n + [False] * (9 - n)) for n in (9, 8, 5, 4)]
    assert found == [Verdict.HOLDS, Verdict.PARTLY, Verdict.PARTLY, Verdict.FAILS]
    assert spread([1.0, 3.0]) == "2.0 (1.0 to 3.0)"
    assert spread([2.0]) == "2.0"
    assert spread([]) == "-"


def test_words_on_the_page_are_text_not_markup(tmp_path):
    claim = Claim("<b>papers</b>", Verdict.PARTLY, "5 < 6 & so on")
    table = Table("caption", ("<i>",), (("a<b",),))
    plot = Plot(lambda file: file.write(b"<svg><metadata>now</metadata></svg>"), "it's", "c")
    section = Section(Heading("key", "<title>", "s"), "m", (claim,), (table,), (plot,))
    write_findings([section], "<about>", ["<note>"], tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    for raw in ("<b>papers", "<i>", "a<b", "5 < 6", "<about>", "<note>", "it's'"):
        assert raw not in page
    assert "<svg></svg>" in page
    assert "holds in part" in page


def test_real_captures_give_every_part(data_dir, tmp_path):
    mocap = data_dir / "mocap"
    head, *rows = (mocap / "trials.csv").read_text(encoding="utf-8").splitlines()
    some = [
        row.replace("open/", f"{mocap}/open/", 1) for row in rows if re.match("open/(bn2_.*-normal|02)", row)
    ]
    (tmp_path / "trials.csv").write_text("\n".join([head, *some]), encoding="utf-8")
    said = reproduce(tmp_path / "trials.csv", tmp_path / "out", overwrite=False, progress=QUIET, quick=True)
    news = json.loads((tmp_path / "out" / "reproduce.json").read_text(encoding="utf-8"))
    assert not left_out(news)
    assert [claim["verdict"] for claim in news["claims"]["prediction"]] == [Verdict.HOLDS] * 2
    assert "holds" in said
