"""The limits on what a tracked frame costs, and that the costs are told rightly."""

import json
import os
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from tests.benchmarks.speed import tracking
from tests.benchmarks.speed.page import page, targets
from tests.benchmarks.speed.tracking import AIM, LIMIT, LONG, MOST_MEMORY, Cost, Growth, Memory

ROOT = Path(__file__).parents[3]
FRAMES = 1000  # of the memory test


@pytest.fixture(scope="module")
def clip():
    """The 640x480 clip."""
    data = os.environ.get("FIGTRACK_DATA")
    if not data:
        pytest.skip("needs the marked clips; set FIGTRACK_DATA to their folder")
    return Path(data) / "video" / "desert_walk_rl.mp4"


@pytest.mark.speed
def test_a_frame_costs_at_most_three_times_the_lucas_kanade_rivals(clip):
    command = [sys.executable, "-m", "tests.benchmarks.speed.tracked", str(clip), "--json"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    found = Cost(**json.loads(done.stdout))
    assert found.ratio <= LIMIT
    # What is timed apart is nearly all there is, and no stage is counted twice.
    assert 0.8 * found.ours < sum(found.stages.values()) < 1.2 * found.ours


@pytest.mark.speed
@pytest.mark.parametrize("grown", [tracking.by_hypotheses, tracking.by_points])
def test_the_cost_grows_along_a_straight_line(grown, clip):
    growth = grown(tracking.job_of(clip))
    assert growth.line[0] > 0.0
    assert growth.astray < 0.1


@pytest.mark.speed
def test_twenty_minutes_stay_within_the_memory(clip):
    memory = tracking.memory(tracking.job_of(clip), FRAMES)
    assert memory.frames[-1] == FRAMES
    assert memory.after < MOST_MEMORY


def test_a_stage_does_not_count_what_another_inside_it_spent():
    def busy(seconds):
        until = time.process_time() + seconds
        while time.process_time() < until:
            pass

    home = SimpleNamespace()
    home.inner = lambda: busy(0.05)
    home.outer = lambda: (busy(0.1), home.inner())
    spent = {"outer": 0.0, "inner": 0.0}
    with tracking._watched(spent, "inner", home, "inner"), tracking._watched(spent, "outer", home, "outer"):
        home.outer()
        home.inner()
    assert spent["outer"] == pytest.approx(0.1, abs=0.02)
    assert spent["inner"] == pytest.approx(0.1, abs=0.02)


def test_a_cost_that_grows_with_the_square_is_no_straight_line():
    sizes = (1.0, 2.0, 4.0, 8.0)
    straight = Growth(sizes, tuple(3.0 + 2.0 * n for n in sizes))
    assert straight.line == pytest.approx((2.0, 3.0))
    assert straight.astray < 1e-9
    assert Growth(sizes, tuple(n**2 for n in sizes)).astray > 0.1


def test_memory_that_grows_is_foreseen():
    frames = tuple(range(0, 1001, 200))
    steady = Memory(frames, (60.0, 90.0, 100.0, 100.0, 100.0, 100.0), 80.0)
    assert steady.after == pytest.approx(100.0)
    growing = Memory(frames, tuple(100.0 + 0.001 * np.array(frames)), 60.0)
    assert growing.after == pytest.approx(100.0 + 0.001 * LONG)
    # With the pictures gone the track may still be the larger.
    assert replace(growing, made=90.0).after == pytest.approx(90.0 + 0.002 * (LONG - 1000))


def test_a_ratio_and_a_rate_are_of_the_whole_frame():
    cost = Cost({"decode": 2.0}, ours=1e3 / AIM, rival=2.0)
    assert cost.rate == pytest.approx(AIM)
    assert cost.ratio == pytest.approx(500.0 / AIM)


def test_the_page_tells_ratios_to_the_rival_and_what_is_not_reached():
    cost = Cost({"decode": 1.0, "kernel": 5.0}, ours=8.0, rival=2.0)
    line, bent = Growth((1, 2, 4), (1.0, 2.0, 4.0)), Growth((1, 2, 4), (1.0, 2.0, 9.0))
    memory = Memory((100, 500, 1000), (80.0, 80.0, 80.0), 70.0)
    reached = {target.text: (target.value, target.reached) for target in targets(cost, line, bent, memory)}
    assert reached["a frame against Lucas-Kanade's"] == (4.0, False)
    assert reached["a frame against 150 a second"] == (pytest.approx(1.2), False)
    assert [hit for _, hit in reached.values()] == [False, False, True, False, True]
    text = page(tracking.Job(Path("a_walk.mp4"), {}, "walk-run", start=0), cost, line, bent, memory)
    assert "| kernel | 5.00 | 2.50 |" in text
    assert "| all, measured as a whole | 8.00 | 4.00 |" in text
