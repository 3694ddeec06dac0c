"""Write docs/motion.md: what the learned models make of walks and runs on captures, beside the targets.

    python -m tests.benchmarks.motion DATA docs/motion.md [--part people]

DATA holds `mocap` and `splices`. Two processes, of one thread each where OMP_NUM_THREADS and
OPENBLAS_NUM_THREADS say so as in `make motion`; about half an hour. With --part only
the section of that module is measured; the page keeps the others.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

from tests.benchmarks.motion.data import SAME, Results, study
from tests.benchmarks.motion.measure import SECTIONS, measure
from tests.benchmarks.page import chapter, claim_table, written
from tracker.models.learn import NOISE, STATES
from tracker.progress import Progress


def main() -> None:
    """Measure everything and write the page."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.motion", description=__doc__)
    parser.add_argument("data", type=Path, help="folder of mocap and splices")
    parser.add_argument("out", type=Path, help="the page, Markdown")
    sections = {part.__name__.rpartition(".")[2]: part for part in SECTIONS}
    parser.add_argument("--part", choices=sections, help="only this section; the page keeps the others")
    asked = parser.parse_args()
    parts = [sections[asked.part]] if asked.part else SECTIONS
    results = measure(asked.data, Progress(), parts)
    before = asked.out.read_text(encoding="utf-8") if asked.part and asked.out.exists() else ""
    asked.out.write_text(page(asked.data, results, parts, before), encoding="utf-8")


def page(source: Path, results: Results, parts: Sequence[ModuleType], before: str = "") -> str:
    """The Markdown text: the sections of these parts, and of the others those that the page had before."""
    captures = study(source).captures
    subjects = {capture.subject for capture in captures}
    intro = [
        "# Motion without video",
        "",
        f"{len(captures)} straight segments ({sum(len(c.y) for c in captures)} frames at 30 a second)",
        f"of walks and runs by {len(subjects)} subjects ({' and '.join(SAME)} are probably one",
        "person and are left out together), each used again with near and far legs exchanged. The",
        f"default model has K={STATES} states a motion and order 2, learned with {NOISE:g}° of noise. For",
        "forecasts and gaps each subject is left out in turn.",
        "",
    ]
    sections = {text.partition("\n")[0]: text for text in before.split("\n## ")[1:]}
    for part in parts:
        wanted, found = claim_table(part.claims(results)), part.section(source, results)
        sections[part.HEADING] = "\n".join(chapter(part.HEADING, f"{written('motion')}.", wanted, found))
    shown = [sections[part.HEADING] for part in SECTIONS if part.HEADING in sections]
    return "\n## ".join(["\n".join(intro), *shown])


if __name__ == "__main__":
    main()
