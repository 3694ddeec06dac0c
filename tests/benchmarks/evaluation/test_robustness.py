"""Robustness: what is refused is lost, draws repeat, and a real clip goes through every disturbance."""

import numpy as np
import pytest

from tests.benchmarks.evaluation import robustness
from tests.benchmarks.evaluation.cases import START, marks_of
from tests.benchmarks.evaluation.disturbances import behind_hedge, read_film
from tests.benchmarks.evaluation.feet import FEET
from tests.benchmarks.evaluation.outcomes import outcome
from tests.benchmarks.evaluation.robustness import (
    DRAWS,
    DROPPED,
    SHOTS,
    WAYS,
    Disturbed,
    Moved,
    Unmarked,
    followed,
    lost,
    page,
    past_shrubs,
    targets,
)
from tracker.clip.start import StartError
from videos.frames import Video


def score(mean, lost=None):
    return outcome(mean, lost=lost).score


@pytest.fixture
def clips(tmp_path):
    return [tmp_path / f"{name}.mp4" for name in ("a_walk_lr", "b_run_rl", "c_walk_lr", "d_run_lr")]


def made_up(**rows):
    """Scores by disturbance; what is not named is followed."""
    return {name: rows.get(name, [score(0.05)] * 4) for name in SHOTS}


def test_only_walks_count_where_walks_are_wanted(clips):
    noise = "noise of 10 grey levels"
    pictures = made_up(**{noise: [score(0.3, lost=5), score(0.3, lost=5), None, score(0.1)]})
    reached = {target.text: target for target in targets(clips, pictures, {"a": [score(0.1)]})}
    assert reached[f"walks lost, {noise}"].value == 2
    assert not reached[f"walks lost, {noise}"].reached
    assert reached["walks lost, JPEG quality 30"].reached


def test_three_of_four_clips_at_half_the_frames_are_enough(clips):
    for missed, enough in ((1, True), (2, False)):
        row = [score(0.3, lost=5)] * missed + [score(0.1)] * (4 - missed)
        found = targets(clips, made_up(**{DROPPED: row}), {"a": [score(0.1)]})
        assert {t.text: t.reached for t in found}[f"clips followed, {DROPPED}"] is enough


def test_lost_runs_are_a_share_of_all_draws_and_a_refusal_is_one(clips):
    starts = {"a": [score(0.1)] * 3, "b": [score(0.1), None, score(0.4, lost=10)]}
    found = targets(clips, made_up(), starts)[0]
    assert found.value == pytest.approx(2 / 6)
    text = page(clips, made_up(), starts, {}, {"cv": [score(0.2), score(0.9, lost=7)]})
    assert "| b | 3 | 2 | 0.400 | 1.000 |" in text
    assert "A try with 3 draws" in text
    assert "| cv | 2 | 1 | 0.550 | 0.900 |" in text


def test_a_page_of_all_draws_is_no_try(clips):
    assert "A try" not in page(clips, made_up(), {"a": [score(0.1)] * DRAWS}, {}, {})


def test_a_refusal_counts_one_in_the_mean_of_a_row_of_feet(clips):
    row = [score(0.1), None, score(0.3, lost=5), score(0.1)]
    text = page(clips, made_up(), {"a": [score(0.1)] * DRAWS}, {"no toes": row}, {})
    assert "| no toes | 0.100 | refused | 0.300 (5) | 0.100 | 2 of 4 | 0.375 |" in text


def test_a_start_that_is_refused_is_an_answer(data_dir, monkeypatch):
    def refuse(job, progress):
        raise StartError("no")

    monkeypatch.setattr(robustness, "follow", refuse)
    assert followed(Moved(data_dir / "video" / "fence_run_lr.mp4", 0)) is None
    assert lost(None)


def test_draws_differ_and_repeat(data_dir):
    clip = data_dir / "video" / "fence_run_lr.mp4"
    first, second, again = (followed(Moved(clip, draw)).mean_error_leg for draw in (0, 1, 0))
    assert first == again
    assert first != second


def test_a_real_clip_goes_through_every_disturbance(data_dir):
    clip = data_dir / "video" / "fence_run_lr.mp4"
    found = {name: followed(Disturbed(clip, name)) for name in SHOTS}
    frames = {name: max(one.frame_errors) for name, one in found.items()}
    assert frames == dict.fromkeys(SHOTS, 21) | {DROPPED: 9, "double speed": 9, "half speed": 42}
    errors = [one.mean_error_leg for one in found.values()]
    assert len(set(errors)) == len(errors)
    assert np.max(errors) < 1.0


@pytest.mark.parametrize("name", FEET)
def test_only_the_start_lacks_feet_and_a_hedge_is_in_the_film(name, data_dir, monkeypatch):
    clip = data_dir / "video" / "fence_run_lr.mp4"
    marks, given = marks_of(clip), []

    def refuse(job, progress):
        given.append((job.marks, next(iter(Video(job.video))).image))
        raise StartError("no")

    monkeypatch.setattr(robustness, "follow", refuse)
    assert followed(Unmarked(clip, name)) is None
    [(job_marks, image)] = given
    start, film = job_marks[START], read_film(clip, marks)
    assert {**job_marks, START: marks[START]} == marks
    assert marks[START].keys() - start.keys() == set(FEET[name].unmarked)
    assert {joint for joint in start if start[joint] != marks[START][joint]} == set(FEET[name].guessed)
    hidden = behind_hedge(film).images[0]
    np.testing.assert_array_equal(image, hidden if "hedge" in name else film.images[0])


@pytest.mark.parametrize(("name", "feet"), FEET.items())
def test_a_row_of_feet_is_what_its_name_says(name, feet):
    assert ("near_toe" in feet.unmarked) == ("far_toe" in feet.unmarked) == ("no toes" in name)
    assert ("near_ankle" in feet.unmarked) == ("no ankles" in name)
    assert ("far_ankle" in feet.unmarked) == ("no ankles" in name or "no far ankle" in name)
    assert len(feet.guessed) == (4 if "guessed" in name else 0)
    assert feet.hedge == ("hedge" in name)


def test_a_start_without_feet_is_scored_against_all_marks(data_dir):
    clip = data_dir / "video" / "fence_run_lr.mp4"
    whole, without = (followed(Unmarked(clip, name)) for name in ("all marked", "no ankles, no toes"))
    assert len(without.mark_errors) == len(whole.mark_errors)
    assert without.mark_errors != whole.mark_errors


def test_a_rendered_walk_is_followed_every_way():
    found = past_shrubs(100)
    errors = [found[name].mean_error_leg for name in WAYS]
    assert len(set(errors)) == len(errors)
    assert errors[0] < errors[-1]
