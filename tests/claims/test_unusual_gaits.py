"""Walks that captures hardly show, made of captured ones and rendered: knees come out as bent as they are."""

from dataclasses import replace

import numpy as np
import pytest

from kinematics.mocap import POSE_COLUMNS, read_trials
from tests.benchmarks.evaluation.cases import QUIET
from tests.benchmarks.rendered.captures import gait_of
from tests.benchmarks.rendered.filming import film
from tests.benchmarks.rendered.measure import start_frame
from tests.benchmarks.rendered.plans import MOMENTS, planned
from tracker.clip.asked import asked
from tracker.clip.follow import follow
from tracker.clip.job import Following, Job

pytestmark = pytest.mark.claims

BENT = {"hip": 15.0, "knee": 25.0}  # degrees more than captured
KNEES = [POSE_COLUMNS.index(name) for name in ("knee_near", "knee_far")]


def on_bent_knees(plan):
    walker, more = plan.walkers[0], [BENT.get(name.partition("_")[0], 0.0) for name in POSE_COLUMNS]
    motion = replace(walker.motion, y=walker.motion.y + np.radians(more))
    times = walker.zero + plan.speed / plan.fps * np.repeat(np.arange(plan.frames), MOMENTS)
    return replace(plan, walkers=(replace(walker, gait=gait_of(motion, walker.build, times)),))


@pytest.mark.parametrize("seed", [1153, 1157])
def test_bent_knees_are_measured_as_such(seed, data_dir, tmp_path):
    plan = on_bent_knees(planned(seed, read_trials(data_dir / "mocap" / "trials.csv")))
    made, path = film(plan), tmp_path / "walk.mp4"
    made.write(path)
    first = start_frame(made)
    job = Job(path, {first: made.marks[first]})
    for each, most in ((job, 6.0), (asked(Following(), path, None, None, QUIET), 12.0)):
        track = follow(each, QUIET).track
        truth = plan.walkers[0].gait.pose[MOMENTS // 2 :: MOMENTS][track.first :][: len(track)]
        less = truth[:, KNEES] - track.q[:, KNEES]
        assert abs(np.degrees(np.median(less))) < most
