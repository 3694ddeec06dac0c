r"""Write docs/gait.md: when feet strike and leave the ground, and gait figures, against what is known.

    python -m tests.benchmarks.gait DATA docs/gait.md --tracks FOLDER \
        [--films N] [--first SEED]

DATA is the folder of captures and open clips. Films of seeds 0 to 199 are for choices, those from 200 on for
the report alone. About twenty seconds a film and process; what has been followed is kept in FOLDER, so that
figures can be measured again without, as long as nothing that follows has changed.
"""

import argparse
from pathlib import Path

from tests.benchmarks.evaluation.cases import measured
from tests.benchmarks.gait.measure import TALL, case, clip
from tests.benchmarks.gait.page import page
from tracker.gait.figures import gait_of
from tracker.gait.lengths import Known
from tracker.progress import Progress

FIRST, FILMS = 200, 140


def main() -> None:
    """Make and measure every film, follow the clips and write the page."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.gait", description=__doc__)
    parser.add_argument("data", type=Path, help="folder of mocap/, video/ and video_hard/")
    parser.add_argument("out", type=Path, help="the page, Markdown")
    parser.add_argument("--tracks", type=Path, required=True, help="folder in which tracks are kept")
    parser.add_argument("--films", type=int, default=FILMS, help="how many")
    parser.add_argument("--first", type=int, default=FIRST, help="the first one's seed")
    asked = parser.parse_args()
    seeds = range(asked.first, asked.first + asked.films)
    walks = [
        path for name in ("video", "video_hard") for path in sorted((asked.data / name).glob("*walk*.mp4"))
    ]
    trials = asked.data / "mocap" / "trials.csv"
    cases = measured(case, [(seed, trials, asked.tracks) for seed in seeds], Progress(), "rendered films")
    tracks = measured(clip, [(path, asked.tracks) for path in walks], Progress(), "open clips")
    gaits = {
        path.stem: gait_of(track, known=Known(height=TALL)) for path, track in zip(walks, tracks, strict=True)
    }
    clips = {name: gait for name, gait in gaits.items() if gait is not None}
    whole = (asked.first, asked.films) == (FIRST, FILMS)
    told = "" if whole else "**A try: not the films of the report.**"
    asked.out.write_text(page(cases, clips, told), encoding="utf-8")


if __name__ == "__main__":
    main()
