"""Speed as ratios to a baseline in the same run: filters to filterpy's IMM, EM rounds to a one-state loop.

All contenders take turns, so that a machine that slows down does so for all; CPU time, one thread, medians of
ROUNDS turns. The problem: 16 states and 8 freedoms (second order).
"""

import time
from dataclasses import dataclass

import numpy as np

from dynamics.frames import in_batches
from dynamics.gpb2 import gpb2_all
from dynamics.gpb2_filter import gpb2_filter
from dynamics.learning.mstep import maximise
from dynamics.learning.options import Options
from dynamics.learning.prior import data_prior
from dynamics.variational import variational_all
from dynamics.viterbi import forward, viterbi_all
from tests.benchmarks.speed import rivals
from tests.oracles import random_slds, sample

ROUNDS = 7
STATES = (4, 8, 16)
FRAMES = 300
SEQUENCES, LENGTH = 18, 50

# Times as fast as the IMM at 4, 8 and 16 switching states, at least.
FILTER_LIMITS = {"viterbi": (20.0, 15.0, 12.0), "gpb2": (12.0, 8.0, 6.0)}
# Times the one-state loop that an EM round at 4 switching states takes, at most.
ROUND_LIMITS = {"viterbi": 1.0, "variational": 1.5, "gpb2": 6.0}


@dataclass(frozen=True)
class Timing:
    """CPU microseconds a frame, and how many times the baseline's they are."""

    microseconds: float
    ratio: float


def filters(K):
    """One sequence through every filter; ratios to filterpy's IMM."""
    rng = np.random.default_rng(1)
    slds = random_slds(K, d=8, order=2, rng=rng)
    y = sample(slds, FRAMES, rng)[2]
    return _timed(
        {
            "filterpy IMM": lambda: rivals.filterpy_imm(slds, y),
            "viterbi": lambda: in_batches(slds, [y], None, lambda frames: [forward(slds, frames)]),
            "gpb2": lambda: gpb2_filter(slds, y),
        },
        frames=FRAMES,
    )


def em_rounds():
    """One EM round on several sequences by every inference; ratios to the one-state loop."""
    rng = np.random.default_rng(1)
    slds = random_slds(4, d=8, order=2, rng=rng)
    ys = [sample(slds, LENGTH, rng)[2] for _ in range(SEQUENCES)]
    prior = data_prior(ys, slds.layout, Options(states=slds.K, order=slds.order))
    weights = np.ones(SEQUENCES)

    def em_round(infer):
        return lambda: maximise(slds, ys, infer(slds, ys), prior, weights)

    return _timed(
        {
            "one-state loop": lambda: [rivals.one_state_loop(slds, y) for y in ys],
            "viterbi": em_round(viterbi_all),
            "variational": em_round(variational_all),
            "gpb2": em_round(gpb2_all),
        },
        frames=SEQUENCES * LENGTH,
    )


def _timed(contenders, frames):
    """A `Timing` of each; the first is the baseline."""
    for run in contenders.values():
        run()  # caches fill, libraries load
    times = np.array([[cpu(run) for run in contenders.values()] for _ in range(ROUNDS)])
    ratios = np.median(times / times[:, :1], axis=0)
    microseconds = 1e6 * np.median(times, axis=0) / frames
    return {
        name: Timing(float(us), float(ratio))
        for name, us, ratio in zip(contenders, microseconds, ratios, strict=True)
    }


def cpu(run):
    """Seconds of CPU time that it takes."""
    start = time.process_time()
    run()
    return time.process_time() - start
