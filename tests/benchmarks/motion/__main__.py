"""Write docs/motion.md: what the learned models make of walks and runs on captures, beside the targets.

    python -m tests.benchmarks.motion DATA docs/motion.md [--quick]

DATA holds `mocap` and `splices`. Two processes, of one thread each where OMP_NUM_THREADS and
OPENBLAS_NUM_THREADS say so as in `make motion`; about twenty minutes. With --quick under one, but the figures
mean nothing.
"""

import argparse
import subprocess
from datetime import UTC, datetime
from pathlib import Path

from dynamics.hmm import HMM
from dynamics.slds import SLDS
from tests.benchmarks.motion import ahead, gaps, splices, synthesis
from tests.benchmarks.motion.data import SAME, SPLICED, Job, Recipe, Source, captures, learn
from tests.benchmarks.motion.page import CLAIM_HEADER, Results, table
from tests.benchmarks.processes import each, spawned
from tracker.models.learn import NOISE, STATES
from tracker.progress import Progress

SECTIONS = (splices, ahead, gaps, synthesis)


def main() -> None:
    """Measure everything and write the page."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.motion", description=__doc__)
    parser.add_argument("data", type=Path, help="folder of mocap and splices")
    parser.add_argument("out", type=Path, help="the page, Markdown")
    parser.add_argument("--quick", action="store_true", help="a try of the program; its figures mean nothing")
    asked = parser.parse_args()
    source = Source(asked.data, asked.quick)
    results = measure(source, Progress())
    asked.out.write_text("\n".join(page(source, results)), encoding="utf-8")


def measure(source: Source, progress: Progress) -> Results:
    """The answer of every job; each model is learned once, the slowest first."""
    jobs: list[Job] = list(dict.fromkeys(job for part in SECTIONS for job in part.jobs(source)))
    recipes = {job.recipe for job in jobs if job.recipe is not None}
    slowest = sorted(recipes, key=lambda recipe: -recipe.cost)
    with spawned() as pool:
        learned = each(pool, _learn, [(source, r) for r in slowest], progress, "learning")
        models = dict(zip(slowest, learned, strict=True))
        jobs.sort(key=lambda job: -job.recipe.cost if job.recipe else 0)
        handed = [(source, job, models.get(job.recipe) if job.recipe else None) for job in jobs]
        return dict(zip(jobs, each(pool, _run, handed, progress, "measuring"), strict=True))


def page(source: Source, results: Results) -> list[str]:
    """The lines of the Markdown text."""
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=False
    )
    straight = captures(source)
    subjects = sorted({s.subject for s in straight})
    lines = [
        "# Motion by itself",
        "",
        f"Written by `make motion` at commit {commit.stdout.strip()} on {datetime.now(UTC):%Y-%m-%d}.",
    ]
    if source.quick:
        lines += ["**A quick try on little data: the figures mean nothing.**"]
    lines += [
        "",
        f"Data: {len(straight) // 2} straight segments at 30 frames a second,",
        f"{sum(len(s.y) for s in straight) // 2} frames, of walks and runs of the subjects",
        f"{', '.join(subjects)}, each used a second time with near and far legs",
        "exchanged; learning also takes the jogs on a curve.",
        f"Subjects {' and '.join(SAME)} are probably one person and are left out together.",
        "",
        f"The default model, as `figtrack learn` makes it, has {STATES} states a motion, is of order 2 and",
        f"is learned at {NOISE:g}° of noise, as all models are unless told otherwise.",
        "For prediction and gaps everyone is left out in turn, and the model knows the one motion.",
        f"`The six` are the splices' subjects {', '.join(SPLICED)}, all left out together;",
        "their model knows walks and runs.",
        "",
        "## Targets",
        "",
        *table(CLAIM_HEADER, [claim.row() for part in SECTIONS for claim in part.claims(results)]),
    ]
    for part in SECTIONS:
        lines += part.section(source, results)
    return lines


def _learn(source: Source, recipe: Recipe) -> SLDS | HMM:
    return learn(source, recipe)


def _run(source: Source, job: Job, model: SLDS | HMM | None) -> object:
    return job.run(source, model)


if __name__ == "__main__":
    main()
