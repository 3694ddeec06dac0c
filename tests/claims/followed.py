"""What claims about followed clips share."""

from tests.benchmarks.evaluation.cases import QUIET
from tracker.clip.follow import follow
from tracker.run.score import places, score


def scored(job, truth, seen=None):
    """The errors of the job's track in every frame of the truth after frame 0."""
    return score(truth, places(follow(job, QUIET, seen=seen).track), 0)


def assert_followed(found, most):
    """To the end, by the right legs, with a mean error below this many leg lengths."""
    assert found.first_failure_frame is None, found.first_failure_frame
    assert found.swaps == 0, found.swaps
    assert found.mean_error_leg < most, found.mean_error_leg
