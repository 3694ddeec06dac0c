"""Print what a tracked frame costs, by stage, and how that grows; draw the growth.

python -m tests.speed.tracked VIDEO [PICTURE]    tables; status 1 if a limit is missed
python -m tests.speed.tracked VIDEO --json       the cost by stage for a program
"""

import json
import os
import sys
from pathlib import Path

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"):
    os.environ[name] = "1"  # before numpy is imported, or it is too late

from tests.processes import spawned  # noqa: E402
from tests.speed import tracking  # noqa: E402

FRAMES = 2000  # of the long run


def main() -> int:
    job = tracking.job_of(Path(sys.argv[1]))
    cost = tracking.cost(job)
    if "--json" in sys.argv:
        print(json.dumps({"stages": cost.stages, "ours": cost.ours, "rival": cost.rival}))
        return 0

    print(f"A frame of {job.video.stem} with {job.model}, ms of CPU time, one thread")
    for name, spent in cost.stages.items():
        print(f"{name:16}{spent:8.2f}")
    print(f"{'all':16}{cost.ours:8.2f}   {cost.rate:.0f} frames a second; the aim is {tracking.AIM:.0f}")
    late = "" if cost.ratio <= tracking.LIMIT else "!"
    print(f"{'Lucas-Kanade':16}{cost.rival:8.2f}   ours is {cost.ratio:.2f}{late} of it; at most ", end="")
    print(tracking.LIMIT)

    hypotheses, points = tracking.by_hypotheses(job), tracking.by_points(job)
    for name, growth in (("hypotheses", hypotheses), ("template points", points)):
        (slope, intercept), pairs = growth.line, zip(growth.sizes, growth.milliseconds, strict=True)
        print(f"\n{name}: " + ", ".join(f"{size} in {spent:.2f} ms" for size, spent in pairs))
        print(f"    {intercept:.2f} + {slope:.3g} n ms, the farthest off by {100 * growth.astray:.0f} %")
    if len(sys.argv) > 2:
        tracking.draw(hypotheses, points, Path(sys.argv[2]))

    # In a process of its own: what the runs above needed is not given back.
    with spawned(1) as pool:
        memory = pool.submit(tracking.memory, job, FRAMES).result()
    half = len(memory.frames) // 2
    print(f"\nresident: {memory.megabytes[half]:.0f} MB after {memory.frames[half]} frames, ", end="")
    print(
        f"{memory.megabytes[-1]:.0f} MB after {memory.frames[-1]}, {memory.made:.0f} MB with the track; ",
        end="",
    )
    print(f"{memory.after:.0f} MB expected of {tracking.LONG}, at most {tracking.MOST_MEMORY:.0f}")
    return 0 if cost.ratio <= tracking.LIMIT and memory.after < tracking.MOST_MEMORY else 1


if __name__ == "__main__":
    sys.exit(main())
