"""Write docs/results.md: models, switches and rivals on the open clips.

    python -m tests.benchmarks.evaluation DATA docs/results.md

DATA holds video/ and video_hard/, of which each clip has its NAME.keypoints.csv. Two processes, of one thread
each where OMP_NUM_THREADS and OPENBLAS_NUM_THREADS say so as in `make evaluate`; about twenty minutes.
"""

import argparse
from pathlib import Path

from tests.benchmarks.evaluation.measure import measure
from tests.benchmarks.evaluation.page import page
from tracker.progress import Progress


def main() -> None:
    """Measure everything and write the page."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.evaluation", description=__doc__)
    parser.add_argument("data", type=Path, help="folder of the folders of marked clips")
    parser.add_argument("out", type=Path, help="the page, Markdown")
    asked = parser.parse_args()
    clips, hard = (sorted((asked.data / name).glob("*.mp4")) for name in ("video", "video_hard"))
    asked.out.write_text(page(measure(clips, hard, Progress())), encoding="utf-8")


if __name__ == "__main__":
    main()
