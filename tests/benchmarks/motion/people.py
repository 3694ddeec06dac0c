"""How many frames of each open person get the wrong motion, by a model that was learned without them.

Sequences are spliced from pieces of the one person's captures, bends too: walks and runs joined where there
are both, else the one motion. All joggers of HDM05 are left out once more together, as a class of people that
nobody learned from shows; and the shipped `gait` is tried on who may not be learned from.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dynamics.hmm import HMM
from dynamics.motion.tasks import classify
from dynamics.slds import SLDS
from tests.benchmarks.motion.data import SAME, Results, study
from tests.benchmarks.motion.splices import FAR, NOISES, TARGETS
from tests.benchmarks.page import Claim, number, table
from tracker.experiments.measures import noisy
from tracker.experiments.splices import PIECES, Splice, long_enough, splice
from tracker.experiments.study import Recipe
from tracker.models.find import from_a_stand, switching_model

HEADING = "Walk or run, everyone left out in turn"
SEQUENCES = 3
JOGGERS = ("hdbd", "hdbk", "hddg")
UNLICENSED = ("am1", "bn2", *JOGGERS)
FAR_TARGET, PERSON_TARGET, SHIPPED_TARGET = 0.3, 8.0, 3.0
LEFT_OUT, TOGETHER, SHIPPED = "left out", "left out with all joggers", "gait"

Frames = NDArray[np.bool_]  # (T, 2) whether each has the wrong motion and is more than FAR from any junction


@dataclass(frozen=True)
class Person:
    """One person, by one of both names, at one noise; `way` is LEFT_OUT, TOGETHER or SHIPPED."""

    names: tuple[str, ...]
    noise: int
    way: str = LEFT_OUT

    @property
    def recipe(self) -> Recipe | None:
        """Learned without the person, without all joggers, or not learned here."""
        if self.way == SHIPPED:
            return None
        return Recipe(held=frozenset(JOGGERS if self.way == TOGETHER else self.names))

    def run(self, source: Path, model: SLDS | HMM | None) -> Frames:
        """Label the person's splices and compare."""
        slds = switching_model(from_a_stand(SHIPPED), 30.0) if self.way == SHIPPED else model
        assert isinstance(slds, SLDS)
        made = of_person(source, self.names)
        labels = np.array([label for s in made for label in s.labels])
        rngs = (np.random.default_rng([9, self.noise, n]) for n in range(len(made)))
        found = classify(slds, [noisy(s.y, self.noise, rng) for s, rng in zip(made, rngs, strict=True)])
        far = np.concatenate([s.far(FAR) for s in made])
        wrong = labels != [label for f in found for label in f.label]
        return np.column_stack([wrong, far])


@cache
def of_person(source: Path, names: tuple[str, ...]) -> tuple[Splice, ...]:
    """The person's splices, the same for every noise and model."""
    captures = long_enough([c for c in study(source).taught if c.subject in names])
    rng = np.random.default_rng([5, *names[0].encode()])
    return tuple(splice(captures, rng, PIECES) for _ in range(SEQUENCES))


def everyone(source: Path) -> list[tuple[str, ...]]:
    """The names of every person who can be spliced."""
    found = {c.subject for c in long_enough(study(source).taught)}
    return sorted({SAME if name in SAME else (name,) for name in found})


def jobs(source: Path) -> Iterator[Person]:
    """Everyone left out; the joggers together; the shipped model on who is not in it."""
    known = everyone(source)
    for noise in NOISES:
        yield from (Person(names, noise) for names in known)
        for way, people in ((TOGETHER, JOGGERS), (SHIPPED, UNLICENSED)):
            yield from (Person((name,), noise, way) for name in people if (name,) in known)


def claims(results: Results) -> list[Claim]:
    """Against the targets: at each noise, and the worst of all."""
    out = {noise: _of(results, noise, LEFT_OUT) for noise in NOISES}
    each = [_share(frames) for of in out.values() for frames in of.values()]
    far = [_share_far(_pooled(of)) for of in out.values()]
    shipped = [_share(_pooled(_of(results, noise, SHIPPED))) for noise in NOISES]
    return [
        *(
            Claim(f"everyone left out, {noise}°", _share(_pooled(out[noise])), target, unit="%")
            for noise, target in TARGETS.items()
        ),
        Claim("the person with most", max(each), PERSON_TARGET, unit="%"),
        Claim("far from junctions", max(far), FAR_TARGET, unit="%"),
        Claim("shipped `gait`", max(shipped), SHIPPED_TARGET, unit="%"),
    ]


def section(source: Path, results: Results) -> list[str]:
    lines = [
        f"Wrong frames in per cent, those more than {FAR} frames from any junction, and the person with",
        "most. Sequences are spliced from captures of one person. The default model is learned without that",
        "one or all joggers of HDM05; the shipped `gait` classifies people whose licence forbids learning.",
        "",
    ]
    rows = []
    for way in (LEFT_OUT, TOGETHER, SHIPPED):
        for noise in NOISES:
            each = _of(results, noise, way)
            total, worst = _pooled(each), max(each, key=lambda names: _share(each[names]))
            most = f"{'/'.join(worst)} {number(_share(each[worst]))}"
            rows.append([way, f"{noise}°", number(_share(total)), number(_share_far(total)), most])
    return lines + table(["model", "noise", "all", "far", "most"], rows)


def _of(results: Results, noise: int, way: str) -> dict[tuple[str, ...], Frames]:
    return {
        job.names: found
        for job, found in results.items()
        if isinstance(job, Person) and (job.noise, job.way) == (noise, way)
    }


def _pooled(each: dict[tuple[str, ...], Frames]) -> Frames:
    return np.concatenate([np.zeros((0, 2), bool), *each.values()])


def _share(frames: Frames) -> float:
    """Per cent with the wrong motion."""
    return 100.0 * float(frames[:, 0].sum()) / max(len(frames), 1)


def _share_far(frames: Frames) -> float:
    """The same of those far from any junction."""
    return _share(frames[frames[:, 1]])
