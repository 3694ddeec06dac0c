"""myogait's JSON: its keys, shares of the frame, nothing where nothing is sure."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.tracker.records import FPS, FRAMES, SIZE, made_record
from tracker.foreign.myogait import NAMES, write_myogait
from tracker.foreign.points import near_far


@pytest.fixture(params=[1, -1], ids=["right", "left"])
def record(request, rng, tmp_path):
    return made_record(rng, tmp_path / "run", facing=request.param)


@pytest.fixture
def table(record, tmp_path):
    write_myogait(record, SIZE, record.facing, None, tmp_path / "m.json")

    def no_constants(name):
        raise AssertionError(f"{name} is no JSON")

    return json.loads((tmp_path / "m.json").read_text(), parse_constant=no_constants)


def test_the_keys_that_myogait_reads(record, table):
    assert list(table) == [
        "myogait_version", "meta", "subject", "extraction", "frames", "normalization", "angles", "events",
    ]  # fmt: skip
    assert table["meta"] == {
        "source": "video",
        "video_path": record.news.video,
        "fps": FPS,
        "width": SIZE[0],
        "height": SIZE[1],
        "n_frames": FRAMES,
        "duration_s": FRAMES / FPS,
    }
    way = "right" if record.facing > 0 else "left"
    assert table["extraction"] == {"model": "slds", "direction_detected": way}
    assert [table[key] for key in ("subject", "normalization", "angles", "events")] == [None] * 4


def test_landmarks_are_shares_of_the_frame_where_the_figure_was_seen(record, table):
    assert [frame["frame_idx"] for frame in table["frames"]] == list(range(FRAMES))
    for t, frame in enumerate(table["frames"]):
        assert frame["time_s"] == pytest.approx(record.times[t], abs=1e-6)
        if not record.measured[t]:
            assert frame["landmarks"] == {}
            assert frame["confidence"] == 0.0
            continue
        assert set(frame["landmarks"]) == set(NAMES)
        for name, landmark in frame["landmarks"].items():
            place = record.place(near_far(NAMES[name], record.facing))[t]
            assert_allclose([landmark["x"] * SIZE[0], landmark["y"] * SIZE[1]], place, atol=1e-3)
            assert 0.0 < landmark["visibility"] <= 1.0
        seen = np.mean([landmark["visibility"] for landmark in frame["landmarks"].values()])
        assert frame["confidence"] == pytest.approx(seen, abs=1e-3)
