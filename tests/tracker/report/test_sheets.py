"""Which frames a comparison shows: evenly up to where the tracks part most, and the end."""

from dataclasses import replace

import pytest

from tests.tracker.report.reports import SCORE
from tracker.report.sheets import sheet_frames

BEST = dict.fromkeys(range(0, 70, 10), 0.1)


def scores(**worse):
    """Of a track that is good throughout, and of one with these errors at frames named f10, f20 .."""
    errors = BEST | {int(name[1:]): error for name, error in worse.items()}
    return {
        "good": replace(SCORE, frame_errors=BEST, mean_error_leg=0.1),
        "worse": replace(SCORE, frame_errors=errors, mean_error_leg=0.3),
    }


@pytest.mark.parametrize(
    ("worse", "shown"), [({"f30": 0.9, "f40": 0.5}, [0, 20, 30, 60]), ({"f60": 0.9}, [0, 20, 40, 60])]
)
def test_frames_lead_evenly_to_where_the_tracks_part_most_and_then_to_the_end(worse, shown):
    assert sheet_frames(scores(**worse)) == shown


def test_one_track_alone_is_shown_evenly():
    assert sheet_frames({"good": scores()["good"]}) == [0, 20, 40, 60]
