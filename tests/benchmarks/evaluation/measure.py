"""All that the page of results shows: first the grids, then what is compared at the values they chose."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tests.benchmarks.evaluation import ways
from tests.benchmarks.evaluation.cases import Ours, Outcome, Way, outcomes
from tests.benchmarks.evaluation.held_out import Tuned, tune
from tests.benchmarks.evaluation.ways import CV, DEFAULT, GRIDS, HARD, RIVALS
from tracker.progress import Progress


@dataclass(frozen=True)
class Results:
    """Outcomes, one a clip.

    rows     : models and rivals by name
    switched : the default model with one setting switched off, by name
    tuned    : what was chosen from each grid
    hard     : the hard clips, what is compared on them, and the default from no marks on all clips
    """

    clips: tuple[Path, ...]
    rows: dict[str, list[Outcome]]
    switched: dict[str, list[Outcome]]
    tuned: dict[str, Tuned]
    hard: "Hard"


@dataclass(frozen=True)
class Hard:
    """Outcomes of the hard clips, as in `Results`; and of all clips without marks, the hard ones last."""

    clips: tuple[Path, ...]
    rows: dict[str, list[Outcome]]
    switched: dict[str, list[Outcome]]
    unmarked: list[Outcome]


def measure(clips: Sequence[Path], hard: Sequence[Path], progress: Progress) -> Results:
    """Follow every clip every way, and the hard ones the ways of HARD, which choose nothing."""
    tried = [way for grid in GRIDS.values() for way in grid.ways.values()]
    found = outcomes(clips, tried, progress, "grids")
    tuned = {
        name: tune({values: found[way] for values, way in grid.ways.items()}) for name, grid in GRIDS.items()
    }
    rows = ways.rows(dict(zip(GRIDS[CV].tried, tuned[CV].best, strict=True)))
    switched = ways.switched()
    found = outcomes(clips, [*rows.values(), *switched.values()], progress, "models and switches")
    return Results(
        clips=tuple(clips),
        rows={name: found[way] for name, way in rows.items()} | {name: tuned[name].tuned for name in RIVALS},
        switched={name: found[way] for name, way in switched.items()},
        tuned=tuned,
        hard=_hard(clips, hard, {name: rows[name] for name in HARD}, switched, progress),
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
