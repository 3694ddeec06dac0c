"""Outcomes made up for tests."""

import numpy as np

from tests.benchmarks.evaluation.cases import Outcome
from tracker.run.score import Score


def outcome(mean, *, lost=None, band=None, marks=(0.01, 0.03), links=(1.0, 2.0), distances=(1.0, 3.0)):
    """One clip's outcome with this mean error."""
    score = Score(
        first_failure_frame=lost,
        frames_followed=5,
        truth_frames=6,
        mean_error_leg=mean,
        median_error_leg=mean,
        pck_02_leg=1.0,
        swaps=0,
        angle_median_deg=2.0,
        frame_errors={5: mean},
        mark_errors=marks,
        link_errors=links,
    )
    return Outcome(score, None if distances is None else np.array(distances), band)
