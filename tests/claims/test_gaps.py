"""Gaps in walks and runs of somebody whom the shipped models were not learned from."""

from pathlib import Path

import numpy as np
import pytest

from kinematics.mocap import Sequence as Capture
from kinematics.mocap import read_trials, sequences
from tests.tracker.gaits import sequence
from tracker.experiments.measures import errors, rms
from tracker.models.find import motion_model
from tracker.motion.fill import BY_STRIDE, fill_gaps, fillers

pytestmark = pytest.mark.claims

FPS = 30.0
SUBJECT = "am1"


@pytest.fixture(scope="module")
def captures(data_dir: Path) -> list[Capture]:
    trials = [t for t in read_trials(data_dir / "mocap" / "trials.csv") if t.subject == SUBJECT]
    wanted = [t for t in trials if t.activity in ("walk", "run")]
    return [s for trial in wanted for s in sequences(trial, FPS)]


@pytest.mark.parametrize(("label", "gap", "most"), [("walk", 25, 2.0), ("walk", 50, 2.6), ("run", 10, 4.5)])
def test_gaps_of_somebody_new_are_filled_by_the_stride(
    captures: list[Capture], label: str, gap: int, most: float
) -> None:
    both = fillers("gait", motion_model("gait", FPS), FPS, recurrent=True)
    found = []
    for capture in captures:
        if capture.label != label or len(capture.y) < gap + 20:
            continue
        first = (len(capture.y) - gap) // 2
        hole = slice(first, first + gap)
        given = capture.y.copy()
        given[hole] = np.nan
        filled = fill_gaps(both, sequence(given), np.random.default_rng(0))
        assert filled.by == (BY_STRIDE,), capture.name
        found.append(errors(capture.subject, filled.y[hole], capture.y[hole]))
    assert len(found) >= 2
    assert rms(found) <= most
