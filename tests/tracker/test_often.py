import pytest

from tracker.often import often


@pytest.mark.parametrize(("fps", "frames"), [(12.0, 1.0), (30.0, 1.0), (60.0, 2.0), (240.0, 8.0)])
def test_frames_beyond_thirty_a_second_share_what_one_counts_for(fps, frames):
    assert often(fps) == frames
