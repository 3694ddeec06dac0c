"""The page of what a tracked frame costs."""

from tests.benchmarks.page import Claim, claim_table, table, written
from tests.benchmarks.speed.tracking import AIM, LIMIT, LONG, MOST_MEMORY, Cost, Growth, Memory
from tracker.clip.job import Job

STRAIGHT = 0.1  # share of the greatest cost by which one may lie beside the line, at most

WHAT = """CPU time of one thread, the best of several runs, from the same clip and marks. Lucas-Kanade is the
optical flow rival of [results.md](results.md). Compare the ratios; milliseconds depend on the machine."""

GROWTH = """![Milliseconds against hypotheses, and against template points](speed.png)"""


def page(job: Job, cost: Cost, hypotheses: Growth, points: Growth, memory: Memory) -> str:
    """The whole page, Markdown."""
    lines = [
        "# Speed",
        "",
        f"{written('bench')}, on {job.video.stem} with {job.model}.",
        "",
        WHAT,
        "",
        "## What is wanted",
        "",
        *claim_table(claims(cost, hypotheses, points, memory)),
        "## A frame by stage",
        "",
        *_stages(cost),
        "## How cost grows",
        "",
        GROWTH,
        "",
        "## Memory",
        "",
        *_memory(memory),
    ]
    return "\n".join(lines)


ALONE = """\
These are of following alone. During the survey and while the overlay is encoded `track`
holds several hundred MB more."""


def claims(cost: Cost, hypotheses: Growth, points: Growth, memory: Memory) -> list[Claim]:
    """What a frame is to cost."""
    return [
        Claim("a frame against Lucas-Kanade's", cost.ratio, LIMIT),
        Claim(f"a frame against {AIM:.0f} a second", AIM / cost.rate, 1.0),
        Claim("cost beside a line in hypotheses", hypotheses.astray, STRAIGHT),
        Claim("cost beside a line in template points", points.astray, STRAIGHT),
        Claim(f"MB resident after {LONG} frames", memory.after, MOST_MEMORY),
    ]


def _stages(cost: Cost) -> list[str]:
    rows = [*cost.stages.items(), ("all, measured as a whole", cost.ours), ("Lucas-Kanade", cost.rival)]
    header = ("", "ms a frame", "times a frame of Lucas-Kanade's")
    return table(header, [[name, f"{spent:.2f}", f"{spent / cost.rival:.2f}"] for name, spent in rows])


def _memory(memory: Memory) -> list[str]:
    half = len(memory.frames) // 2
    rows = [
        [f"after {memory.frames[half]} frames", f"{memory.megabytes[half]:.0f}"],
        [f"after {memory.frames[-1]} frames", f"{memory.megabytes[-1]:.0f}"],
        ["with the track made of them", f"{memory.made:.0f}"],
        [f"expected after {LONG} frames, 20 minutes", f"{memory.after:.0f}"],
    ]
    return [*table(("", "MB resident"), rows), ALONE, ""]
