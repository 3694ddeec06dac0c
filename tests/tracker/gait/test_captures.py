"""Captured people, seen as a tracker sees them, against when their feet are on the ground."""

import numpy as np
import pytest

from kinematics.mocap import read_trials
from tests.benchmarks.gait.learn import captures, in_error, shown_at
from tests.benchmarks.gait.truth import contacts
from tracker.gait.figures import runs
from tracker.gait.strides import strides_of

FPS = 25.0
EVERY = 4  # row of the table


@pytest.fixture(scope="module")
def shown(data_dir):
    """Motions of the table of captures, a walk or run each."""
    return [motion for _, motion in captures(read_trials(data_dir / "mocap" / "trials.csv")[::EVERY])]


@pytest.mark.parametrize(("label", "least"), [("walk", 60), ("run", 9)])
def test_moments_and_stances_of_captured_people_are_where_their_feet_say(shown, label, least, rng):
    late, stances, right = {"strike": [], "off": []}, [], []
    for motion in (motion for motion in shown if motion.label == label):
        exact, build, gait = shown_at(motion, FPS, rng)
        track = in_error(exact, FPS, rng)
        truth = contacts(gait, build)
        right.append(runs(track) == (label == "run"))
        for side, strides in strides_of(track, label == "run").items():
            true = truth[side]
            for stride in strides.sound:
                start, off, end = (
                    np.interp(event.at, np.arange(len(track)), track.times)
                    for event in (stride.strike, stride.off, stride.end)
                )
                near = [i for i in range(len(true) - 1) if abs(true[i].strike - start) < 0.2]
                if near:
                    contact, after = true[near[0]], true[near[0] + 1]
                    late["strike"].append(start - contact.strike)
                    late["off"].append(off - contact.off)
                    share = (contact.off - contact.strike) / (after.strike - contact.strike)
                    stances.append((off - start) / (end - start) - share)
    assert np.mean(right) > 0.95
    assert len(stances) > least
    for found in late.values():
        assert np.median(np.abs(found)) < 0.02
    assert np.quantile(np.abs(late["strike"]), 0.9) < 0.045
    assert np.median(np.abs(stances)) < (0.05 if label == "run" else 0.03)
