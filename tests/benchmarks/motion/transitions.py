"""How far from the true frame a model of walk, run and stand finds that one motion gives way to another.

Stands are cut from captures, as a user's table does it: rows whose activity is `stand`. The subject of the
captures that are labelled is left out of learning. Between both motions of a capture, as in the steps that
brake a run, every label counts as right.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dynamics.motion.tasks import classify
from dynamics.store import Model
from kinematics.mocap import Sequence as Capture
from kinematics.mocap import Trial, read_body, read_trials, sequences
from kinematics.sagittal import project
from tests.benchmarks.motion.data import MOTIONS, TABLE, Results, both, study
from tests.benchmarks.page import Claim, table
from tracker.experiments.measures import noisy
from tracker.experiments.study import FPS, Recipe, Study
from tracker.models.centred import centred, rootless

HEADING = "Walk, run and stand"
STAND = "stand"
SUBJECT = "am1"
NOISE = 2.0  # degrees
NEAR = 5  # frames
# Source frames, first and last + 1, before the travel of a capture begins or after it has ended.
STANDS = {
    "02_04": ((395, 483),),
    "10_04": ((1, 114),),
    "29_01": ((0, 94),),
    "32_01": ((1, 72),),
    "32_02": ((1, 47),),
    "bn2_walk-normal-001": ((0, 17),),
    "wd2_walk-slow": ((0, 71),),
    "wd2_walk-normal": ((0, 64), (1361, 1407)),
    "wd2_walk-fast": ((0, 77), (1425, 1458)),
}


class Change(NamedTuple):
    """A capture that shows one motion up to the frame `first`, another from the frame `last` on."""

    capture: str
    before: str
    after: str
    first: int
    last: int

    def apart(self, frame: int) -> int:
        """Frames between this one and the nearest that is true."""
        return max(self.first - frame, frame - self.last, 0)


CHANGES = (
    Change("am1_B01", "stand", "walk", 90, 90),
    Change("am1_B02", "walk", "stand", 165, 165),
    Change("am1_C01", "stand", "run", 43, 43),
    Change("am1_C02", "run", "stand", 39, 75),
    Change("am1_C05", "walk", "run", 47, 47),
    Change("am1_C04", "run", "walk", 42, 48),
)


class Found(NamedTuple):
    """Where a change was found.

    left  : the frame after the last with the label before the change, 0 where no frame has it
    found : the first frame with the label after it, the number of frames where none has it
    wrong : frames with a wrong label more than NEAR frames from the change
    """

    left: int
    found: int
    wrong: int

    @property
    def told(self) -> str:
        """As the page has it."""
        return str(self.found) if self.left == self.found else f"{self.left} and {self.found}"


@dataclass(frozen=True)
class Labels:
    """The labels of every change, by a model that was learned without SUBJECT."""

    recipe = None  # it learns a model of its own, since no other job has stands

    def run(self, source: Path, model: Model | None) -> dict[Change, list[Found]]:
        """Of each change as captured, and with near and far legs exchanged."""
        trials = {trial.path.stem: trial for trial in read_trials(source / TABLE)}
        known = study(source)
        taught = Study(known.captures, [*known.taught, *stands(trials)], known.progress)
        slds = taught.slds(Recipe(held=frozenset([SUBJECT]), motions=(*MOTIONS, STAND)))
        captures = both([whole(trials[change.capture]) for change in CHANGES])
        rngs = [np.random.default_rng([11, n]) for n in range(len(captures))]
        ys = [rootless(noisy(centred(c.y), NOISE, rng)) for c, rng in zip(captures, rngs, strict=True)]
        labels = [found.label for found in classify(slds, ys)]
        return {
            change: [compare(change, label) for label in labels[2 * n : 2 * n + 2]]
            for n, change in enumerate(CHANGES)
        }


def jobs(source: Path) -> Iterator[Labels]:
    """All of it is one."""
    yield Labels()


def claims(results: Results) -> list[Claim]:
    """The most of all changes from or to a stand, and of each other one."""
    most: dict[str, int] = {}
    for change, found in results[Labels()].items():
        still = STAND in (change.before, change.after)
        text = "begin or end of a stand" if still else f"{change.before} to {change.after}"
        apart = [change.apart(frame) for side in found for frame in (side.left, side.found)]
        most[text] = max(most.get(text, 0), *apart)
    return [Claim(f"{text}, frames apart", float(apart), NEAR) for text, apart in most.items()]


def section(source: Path, results: Results) -> list[str]:
    rows = []
    for change, found in results[Labels()].items():
        true = str(change.first) if change.first == change.last else f"{change.first} to {change.last}"
        wrong = ", ".join(str(side.wrong) for side in found)
        rows.append(
            [change.capture, f"{change.before} to {change.after}", true, *(s.told for s in found), wrong]
        )
    return [
        f"The default model of three motions, stands from {_counted()}, on captures of {SUBJECT}",
        f"with {NOISE:g} degrees of noise and no root. Between two true frames every label is right; of two",
        f"found, one ends a motion, the other begins one. Wrong: frames more than {NEAR} from the change.",
        "",
        *table(["capture", "change", "true", "found", "legs exchanged", "wrong"], rows),
        "The last walking step leans up to 33° forward and lifts the thigh to 52° (walks: 33°): the label",
        "changes in it.",
        "",
    ]


def stands(trials: Mapping[str, Trial]) -> list[Capture]:
    """STANDS, as rows of a table of trials give them."""
    rows = [replace(trials[name], activity=STAND, segments=cut, tags=()) for name, cut in STANDS.items()]
    return [sequence for row in rows for sequence in sequences(row, FPS)]


def whole(trial: Trial) -> Capture:
    """Every frame of a capture of FPS frames a second."""
    y = project(read_body(trial))
    return Capture(y, trial.subject, trial.activity, trial.path.stem)


def compare(change: Change, labels: Sequence[str]) -> Found:
    """A change in the labels of its capture's frames."""
    left = max((t + 1 for t, label in enumerate(labels) if label == change.before), default=0)
    found = min((t for t, label in enumerate(labels) if label == change.after), default=len(labels))
    wrong = sum(label != change.before for label in labels[: change.first - NEAR])
    wrong += sum(label != change.after for label in labels[change.last + NEAR :])
    return Found(left, found, wrong)


def _counted() -> str:
    people = {name.partition("_")[0] for name in STANDS}
    return f"{sum(map(len, STANDS.values()))} pieces of {len(people)} other people"
