"""Write docs/results.md: models, switches and rivals on the open clips.

    python -m tests.benchmarks.evaluation DATA docs/results.md [--quick]

DATA holds video/ and video_hard/, of which each clip has its NAME.keypoints.csv. Two processes, of one thread
each where OMP_NUM_THREADS and OPENBLAS_NUM_THREADS say so as in `make evaluate`; about twenty minutes. With
--quick on three clips and few settings, but the figures mean nothing.
"""

import argparse
from pathlib import Path

from tests.benchmarks.evaluation.measure import measure
from tests.benchmarks.evaluation.page import page
from tests.benchmarks.evaluation.ways import full_plan, quick_plan
from tracker.progress import Progress

QUICK_CLIPS = ("fence_run_lr", "gym_walk_rl", "room_walk_rl")


def main() -> None:
    """Measure everything and write the page."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.evaluation", description=__doc__)
    parser.add_argument("data", type=Path, help="folder of the folders of marked clips")
    parser.add_argument("out", type=Path, help="the page, Markdown")
    parser.add_argument("--quick", action="store_true", help="a try of the program; its figures mean nothing")
    asked = parser.parse_args()
    clips, hard = (
        [
            clip
            for clip in sorted((asked.data / name).glob("*.mp4"))
            if not asked.quick or clip.stem in QUICK_CLIPS
        ]
        for name in ("video", "video_hard")
    )
    results = measure(clips, hard, quick_plan() if asked.quick else full_plan(), Progress())
    asked.out.write_text(page(results, asked.quick), encoding="utf-8")


if __name__ == "__main__":
    main()
