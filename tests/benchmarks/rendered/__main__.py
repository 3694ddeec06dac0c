r"""Write docs/rendered.md: rendered films whose truth is known, followed with and without marks.

    python -m tests.benchmarks.rendered TRIALS docs/rendered.md \
        [--films N] [--first SEED]

TRIALS is the table of captures. Settings may be chosen by the films of seeds 0 to 199; those of the report,
from 200 on, are for the report alone. Two processes, of one thread each where the environment says so as in
`make rendered`; about forty seconds a film and process.
"""

import argparse
from pathlib import Path

from tests.benchmarks.evaluation.cases import measured
from tests.benchmarks.rendered.measure import case
from tests.benchmarks.rendered.page import page
from tracker.progress import Progress

FIRST, FILMS = 200, 100


def main() -> None:
    """Make and measure every film and write the page."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.rendered", description=__doc__)
    parser.add_argument("trials", type=Path, help="table of captures")
    parser.add_argument("out", type=Path, help="the page, Markdown")
    parser.add_argument("--films", type=int, default=FILMS, help="how many")
    parser.add_argument("--first", type=int, default=FIRST, help="the first one's seed")
    asked = parser.parse_args()
    seeds = range(asked.first, asked.first + asked.films)
    cases = measured(case, [(seed, asked.trials) for seed in seeds], Progress(), "rendered films")
    whole = (asked.first, asked.films) == (FIRST, FILMS)
    told = "" if whole else f"**A try: not the {FILMS} films from seed {FIRST} on.**"
    asked.out.write_text(page(cases, told), encoding="utf-8")


if __name__ == "__main__":
    main()
