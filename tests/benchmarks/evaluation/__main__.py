"""Write docs/results.md: models, switches and rivals on the open clips.

    python -m tests.benchmarks.evaluation CLIPS docs/results.md [--quick]

CLIPS holds the videos, each with its NAME.keypoints.csv. Two processes, of one thread each where
OMP_NUM_THREADS and OPENBLAS_NUM_THREADS say so as in `make evaluate`; about twenty minutes. With --quick on
two clips and few settings, under one, but the figures mean nothing.
"""

import argparse
from pathlib import Path

from tests.benchmarks.evaluation.measure import measure
from tests.benchmarks.evaluation.page import page
from tests.benchmarks.evaluation.ways import full_plan, quick_plan
from tracker.progress import Progress

QUICK_CLIPS = ("fence_run_lr", "gym_walk_rl")


def main() -> None:
    """Measure everything and write the page."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.evaluation", description=__doc__)
    parser.add_argument("clips", type=Path, help="folder of the marked clips")
    parser.add_argument("out", type=Path, help="the page, Markdown")
    parser.add_argument("--quick", action="store_true", help="a try of the program; its figures mean nothing")
    asked = parser.parse_args()
    clips = sorted(asked.clips.glob("*.mp4"))
    if asked.quick:
        clips = [clip for clip in clips if clip.stem in QUICK_CLIPS]
    results = measure(clips, quick_plan() if asked.quick else full_plan(), Progress())
    asked.out.write_text(page(results, asked.quick), encoding="utf-8")


if __name__ == "__main__":
    main()
