"""All that the page of results shows: first the grids, then what is compared at the values they chose."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tests.benchmarks.evaluation.cases import Ours, Outcome, Way, outcomes
from tests.benchmarks.evaluation.held_out import Tuned, tune
from tests.benchmarks.evaluation.ways import CV, DEFAULT, HARD, RIVALS, Grid, Plan, Values
from tracker.progress import Progress


@dataclass(frozen=True)
class Results:
    """Outcomes, one a clip.

    rows     : models and rivals by name
    switched : the default model with one setting switched off, by name
    grids    : what was tuned, and on what, by name
    hard     : the hard clips, what is compared on them, and the default from no marks on all clips
    """

    clips: tuple[Path, ...]
    rows: dict[str, list[Outcome]]
    switched: dict[str, list[Outcome]]
    grids: dict[str, "Tuning"]
    hard: "Hard"


@dataclass(frozen=True)
class Hard:
    """Outcomes of the hard clips, as in `Results`; and of all clips without marks, the hard ones last."""

    clips: tuple[Path, ...]
    rows: dict[str, list[Outcome]]
    switched: dict[str, list[Outcome]]
    unmarked: list[Outcome]


@dataclass(frozen=True)
class Tuning:
    """The outcomes of a grid by values, and what they choose."""

    grid: Grid
    outcomes: dict[Values, list[Outcome]]
    tuned: Tuned


def measure(clips: Sequence[Path], hard: Sequence[Path], plan: Plan, progress: Progress) -> Results:
    """Follow every clip every way of the plan, and the hard ones the ways of HARD, which choose nothing."""
    ways = [way for grid in plan.grids.values() for way in grid.ways.values()]
    found = outcomes(clips, ways, progress, "grids")
    grids = {}
    for name, grid in plan.grids.items():
        of_values = {values: found[way] for values, way in grid.ways.items()}
        grids[name] = Tuning(grid, of_values, tune(of_values))
    best = dict(zip(grids[CV].grid.names, grids[CV].tuned.best, strict=True))
    rows, switched = plan.rows(best), plan.switched()
    found = outcomes(clips, [*rows.values(), *switched.values()], progress, "models and switches")
    return Results(
        clips=tuple(clips),
        rows={name: found[way] for name, way in rows.items()}
        | {rival: grids[rival].tuned.tuned for rival in RIVALS if rival in grids},
        switched={name: found[way] for name, way in switched.items()},
        grids=grids,
        hard=_hard(clips, hard, {name: rows[name] for name in HARD if name in rows}, switched, progress),
    )


def _hard(
    clips: Sequence[Path],
    hard: Sequence[Path],
    rows: dict[str, Way],
    switched: dict[str, Way],
    progress: Progress,
) -> Hard:
    found = outcomes(hard, [*rows.values(), *switched.values()], progress, "hard clips")
    (unmarked,) = outcomes([*clips, *hard], [Ours(DEFAULT, marked=False)], progress, "no marks").values()
    return Hard(
        clips=tuple(hard),
        rows={name: found[way] for name, way in rows.items()},
        switched={name: found[way] for name, way in switched.items()},
        unmarked=unmarked,
    )
