"""What is said of a frame's marks: missing joints, impossible ones, and what tracking makes of them."""

from dataclasses import replace

import pytest
from numpy.testing import assert_array_equal

from kinematics.figure_file import load_figure
from kinematics.recover import PoseError
from tests.tracker.annotate.marked import MARKS, without
from tracker.annotate.session import advise
from tracker.clip.start import StartError, marked_start
from tracker.tables.keypoints import Mark

FIGURE, SIZE = load_figure(), (300, 240)


def advised(marks, facing=1):
    return advise(FIGURE, marks, SIZE, facing)


def test_a_good_frame_lacks_nothing_and_its_facing_is_said():
    advice = advised(MARKS)
    assert (advice.missing, advice.faults, advice.faces) == ((), (), "right")
    assert advised(without("hip")).faces is None


def test_what_a_start_needs_is_missing_until_it_is_marked():
    assert set(advised({}).missing) == {"hip", "neck", "head_top", "near_knee", "far_knee"}
    assert advised(without("neck", "far_toe", "far_ankle")).missing == ("neck",)
    assert advised(without("near_ankle", "near_toe", "far_toe")).missing == ()


@pytest.mark.parametrize(("x", "wrong"), [(-0.5, False), (-0.6, True), (299.5, False), (299.6, True)])
def test_a_joint_outside_the_picture_is_said(x, wrong):
    found = advised({"near_toe": Mark(x, 30)}).faults
    assert [fault.startswith("near_toe lies outside the picture of 300 x 240 px") for fault in found] == [
        True
    ] * wrong


def test_joints_in_one_place_are_said_with_the_figures_own_error():
    faults = advised(MARKS | {"neck": MARKS["hip"]}).faults
    assert faults[0] == "neck lies on the joint before it; mark the two apart"


def refusal(marks, facing):
    """What `figtrack track` says to a start, None if it accepts it."""
    try:
        marked_start({0: marks}, 0, facing, SIZE)
    except (StartError, PoseError) as error:
        return str(error)
    return None


def test_a_start_tells_the_joints_that_were_marked_though_hidden():
    marks = MARKS | {name: replace(MARKS[name], visible=False) for name in ("far_ankle", "far_toe")}
    start = marked_start({0: without("neck"), 7: marks}, 7, 1, SIZE)
    assert start.hidden == {"far_ankle", "far_toe"}
    seen = marked_start({7: MARKS}, 7, 1, SIZE)
    assert seen.hidden == frozenset()
    assert start.view == seen.view
    assert_array_equal(start.q, seen.q)  # they are marked all the same
    assert start.known.all()


def test_whatever_track_refuses_is_said_and_a_start_that_is_accepted_is_complete(rng):
    refused = 0
    for _ in range(400):
        names = rng.permutation(list(MARKS))[: rng.integers(4, 10)]
        marks = {name: MARKS[name] for name in names}
        for name in names[: rng.integers(0, 4)]:
            dx, dy = rng.normal(scale=40.0, size=2)
            marks[name] = Mark(marks[name].x + dx, marks[name].y + dy)
        advice, said = advised(marks, 1), refusal(marks, 1)
        if said is not None:
            refused += 1
            assert advice.missing or advice.faults, said
        if not advice.missing and not advice.faults:
            assert said is None
    assert 100 < refused < 390


def test_the_reasons_for_a_refusal_are_the_advice_to_the_letter():
    wrong = MARKS | {"near_ankle": MARKS["far_ankle"], "far_ankle": MARKS["near_ankle"]}
    assert refusal(wrong, 1) == f"mark the start again at frame 0: {'; '.join(advised(wrong).faults)}"
    clause = "right if that is where the figure faces"
    assert advised(MARKS, -1).faults[-1] == f"or choose Faces {clause}"
    assert refusal(MARKS, -1).endswith(f"or give --facing {clause}")
