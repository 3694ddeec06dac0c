"""All that docs/motion.md shows, measured in processes of their own."""

from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

from dynamics.store import Model
from tests.benchmarks.motion import ahead, gaps, people, splices, synthesis, transitions
from tests.benchmarks.motion.data import Job, Results, learn
from tests.benchmarks.processes import each, spawned
from tracker.experiments.study import Recipe
from tracker.progress import Progress

# Each has jobs(source), claims(results) against its targets, and section(source, results), its tables.
SECTIONS: tuple[ModuleType, ...] = (splices, people, transitions, ahead, gaps, synthesis)


def measure(source: Path, progress: Progress, parts: Sequence[ModuleType] = SECTIONS) -> Results:
    """The answer of every job of these parts; each model is learned once, the slowest first."""
    jobs: list[Job] = list(dict.fromkeys(job for part in parts for job in part.jobs(source)))
    recipes = {job.recipe for job in jobs if job.recipe is not None}
    slowest = sorted(recipes, key=cost, reverse=True)
    with spawned() as pool:
        learned = each(pool, learn, [(source, recipe) for recipe in slowest], progress, "learning")
        models = dict(zip(slowest, learned, strict=True))
        jobs.sort(key=lambda job: cost(job.recipe), reverse=True)
        handed = [(source, job, models.get(job.recipe) if job.recipe else None) for job in jobs]
        return dict(zip(jobs, each(pool, run, handed, progress, "measuring"), strict=True))


def cost(recipe: Recipe | None) -> int:
    """How long learning takes beside others."""
    return max(recipe.states, 1) * max(recipe.order, 1) * len(recipe.motions) if recipe else 0


def run(source: Path, job: Job, model: Model | None) -> object:
    """The answer of one job."""
    return job.run(source, model)
