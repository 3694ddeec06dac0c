"""Gaps in walks and runs of somebody whom the shipped models were not learned from."""

import numpy as np
import pytest

from kinematics.mocap import read_body, read_trials, resample, sequences
from kinematics.sagittal import project
from tests.tracker.gaits import sequence
from tracker.experiments.measures import errors, rms
from tracker.models.find import motion_model
from tracker.motion.fill import BY_STRIDE, BY_SWITCHING, fill_gaps, fillers

pytestmark = pytest.mark.claims

FPS = 30.0
SUBJECTS = {"walk": "am1", "run": "bn2"}


@pytest.fixture(scope="module")
def captures(data_dir):
    trials = read_trials(data_dir / "mocap" / "trials.csv")
    wanted = [t for t in trials if SUBJECTS.get(t.activity) == t.subject]
    return [s for trial in wanted for s in sequences(trial, FPS)]


@pytest.mark.parametrize(("label", "gap", "most"), [("walk", 25, 2.0), ("walk", 50, 2.6), ("run", 10, 4.5)])
def test_gaps_of_somebody_new_are_filled_by_the_stride(captures, label, gap, most):
    both = fillers("gait", motion_model("gait", FPS), FPS)
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


@pytest.mark.parametrize("name", ["02_04", "am1_B18", "am1_C20"])
def test_gaps_amid_jumps_are_left_to_the_switching_model(data_dir, name):
    both = fillers("gait", motion_model("gait", FPS), FPS)
    trials = read_trials(data_dir / "mocap" / "trials.csv")
    (trial,) = (t for t in trials if t.path.stem == name)
    y = resample(project(read_body(trial), curve=True), trial.fps, FPS)
    middle = len(y) // 2
    y[middle - 5 : middle + 5] = np.nan
    assert fill_gaps(both, sequence(y), np.random.default_rng(0)).by == (BY_SWITCHING,)
