"""Values of frames that are made when asked for."""

import pytest

from tracker.clip.lazily import Lazily, together


def test_a_value_is_made_when_it_is_asked_for_and_of_the_frames_there_are():
    made = []
    squares = Lazily(range(3, 6), lambda t: made.append(t) or t * t)
    assert (list(squares), len(squares), made) == ([3, 4, 5], 3, [])
    assert (squares[4], squares.get(6), made) == (16, None, [4])
    with pytest.raises(KeyError, match="6"):
        squares[6]


def test_of_a_frame_in_two_parts_the_first_parts_value_counts():
    both = together([{1: "a", 2: "a"}, Lazily(range(2, 4), lambda _: "b")])
    assert (both[1], both[2], both[3], both.get(4)) == ("a", "a", "b", None)
    assert (sorted(both), len(both)) == ([1, 2, 3], 3)
