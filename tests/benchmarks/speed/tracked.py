"""Print what a tracked frame costs, by stage, and how that grows.

python -m tests.benchmarks.speed.tracked VIDEO [PAGE]   tables, also written to PAGE, with a picture; status 1
                                              if a limit is missed
python -m tests.benchmarks.speed.tracked VIDEO --json    the cost by stage for a program
"""

import json
import os
import sys
from pathlib import Path

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"):
    os.environ[name] = "1"  # before numpy is imported, or it is too late

from tests.benchmarks.processes import spawned  # noqa: E402
from tests.benchmarks.speed import tracking  # noqa: E402
from tests.benchmarks.speed.page import page  # noqa: E402

FRAMES = 2000  # of the long run


def main() -> int:
    job = tracking.job_of(Path(sys.argv[1]))
    cost = tracking.cost(job)
    if "--json" in sys.argv:
        print(json.dumps({"stages": cost.stages, "ours": cost.ours, "rival": cost.rival}))
        return 0
    hypotheses, points = tracking.by_hypotheses(job), tracking.by_points(job)
    # In a process of its own: what the runs above needed is not given back.
    with spawned(1) as pool:
        memory = pool.submit(tracking.memory, job, FRAMES).result()
    text = page(job, cost, hypotheses, points, memory)
    print(text)
    if len(sys.argv) > 2:
        out = Path(sys.argv[2])
        out.write_text(text, encoding="utf-8")
        tracking.draw(hypotheses, points, out.with_suffix(".png"))
    return 0 if cost.ratio <= tracking.LIMIT and memory.after < tracking.MOST_MEMORY else 1


if __name__ == "__main__":
    sys.exit(main())
