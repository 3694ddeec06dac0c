"""Outcomes of frames in order of time."""

from tracker.loop.outcome import Outcome, in_time

OK, HIDDEN, FOUND, LOST, OUTSIDE = Outcome


def test_found_is_what_follows_frames_in_which_the_figure_was_not():
    assert in_time([OUTSIDE, OK, HIDDEN, FOUND, LOST, LOST, OK, OK]) == (
        *(OUTSIDE, FOUND, HIDDEN, OK, LOST, LOST, FOUND, OK),
    )
    assert in_time([LOST, FOUND, OK, LOST, HIDDEN]) == (LOST, FOUND, OK, LOST, FOUND)
    assert in_time([FOUND, OK]) == (OK, OK)
    assert in_time([]) == ()
