"""Write docs/speed.md: how fast filters, EM rounds, a frame and the whole command are, and its memory.

    python -m tests.benchmarks.speed VIDEO docs/speed.md

VIDEO has its NAME.keypoints.csv beside it. About half an hour; nothing else should run.
"""

import argparse
import os
from importlib.util import find_spec
from pathlib import Path

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"):
    os.environ[name] = "1"  # before numpy is imported, or it is too late

from tests.benchmarks.speed import tracking  # noqa: E402
from tests.benchmarks.speed.command import command  # noqa: E402
from tests.benchmarks.speed.measure import STATES, em_rounds, filters  # noqa: E402
from tests.benchmarks.speed.page import Measured, page  # noqa: E402


def main() -> None:
    """Measure everything and write the page."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.speed", description=__doc__)
    parser.add_argument("video", type=Path, help="a marked clip")
    parser.add_argument("out", type=Path, help="the page, Markdown; a picture goes beside it")
    asked = parser.parse_args()
    if find_spec("filterpy") is None:
        parser.error("filterpy is not installed; install the extra 'bench'")
    job = tracking.job_of(asked.video)
    used = command(asked.video)  # first: what the others need is not given back
    measured = Measured(
        used,
        tracking.cost(job),
        tracking.by_hypotheses(job),
        tracking.by_points(job),
        {K: filters(K) for K in STATES},
        em_rounds(),
    )
    asked.out.write_text(page(job, measured), encoding="utf-8")
    tracking.draw(measured.hypotheses, measured.points, asked.out.with_suffix(".png"))


if __name__ == "__main__":
    main()
