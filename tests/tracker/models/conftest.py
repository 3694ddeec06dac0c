"""A few made walks and runs, and the models learned from them."""

from dataclasses import replace

import numpy as np
import pytest

from tests.tracker.models.made import ONE, gait, learned


@pytest.fixture(scope="module")
def sequences():
    rng = np.random.default_rng(20)
    walks = [(subject, "walk", gait(rng)) for subject in ("a", "a", "b")]
    runs = [(subject, "run", gait(rng, period=22.0, speed=0.1, size=1.4)) for subject in ("a", "c")]
    return walks + runs


@pytest.fixture(scope="module")
def two_states(sequences):
    """Learned with two states a motion."""
    return learned(sequences, replace(ONE, states=2))
