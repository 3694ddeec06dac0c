"""The phases of a jog: do the switching states of a learned model follow the gait (1999, figure 2)?"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dynamics.gaussian import Array, Ints
from dynamics.viterbi import viterbi_all
from kinematics.mocap import POSE_COLUMNS
from kinematics.mocap import Sequence as Capture
from tracker.experiments.section import Claim, Heading, Plot, Section, Table, left_out, spread, verdict
from tracker.experiments.study import FPS, Recipe, Study
from tracker.models.centred import centred
from tracker.motion.plots import draw_synthesis

HEADING = Heading("phases", "Phases inside a jog", "1999, figure 2")
COUNTS = (2, 3, 4)
BINS = 12  # of a stride
CLEAR, SOME = 0.7, 0.35  # shares of the frames wrong by chance that must be right: claim holds, holds partly
TELLING = 85.0  # least share of frames with its leg ahead for a state that represents a leg, per cent
SHOWN = 60  # frames in the plot
HIPS = POSE_COLUMNS.index("hip_near"), POSE_COLUMNS.index("hip_far")


def run(study: Study) -> Section:
    """Every jog segmented by models that were learned without its subject."""
    if "run" not in study.motions:
        return left_out(HEADING, "the captures show no run or jog")
    shown = max(study.of("run"), key=lambda c: len(c.y))
    cuts = {count: Cut() for count in (COUNTS[:2] if study.quick else COUNTS)}
    path = np.zeros(0, np.intp)  # of the plotted jog, with two states
    for (count, cut), held in study.each(HEADING.key, list(product(cuts.items(), study.held_out))):
        jogs = [c for c in study.tested(held) if c.label == "run"]
        slds = study.slds(Recipe(count, 1, held=held, motions=("run",)))
        found = [p.path for p in viterbi_all(slds, [centred(c.y) for c in jogs])]
        cut.add(jogs, found)
        if count == 2:
            path = next((p for c, p in zip(jogs, found, strict=True) if c is shown), path)
    rows = [
        (
            str(n),
            spread(cut.regular, 0),
            f"{np.mean(cut.commonest):.0f}",
            spread(cut.leg, 0),
            spread(cut.switches),
        )
        for n, cut in cuts.items()
    ]
    table = Table(
        "Least to greatest over subjects in brackets; of the changes, over groups left out.",
        (
            "states",
            "usual state at that point of the stride, %",
            "by chance, %",
            "leg ahead told by the state, %",
            "changes a stride",
        ),
        rows,
    )
    return Section(
        HEADING,
        "Models of the jogs alone, first order, started by k-means on pose and velocity and learned by EM "
        f"with Viterbi inference, cut the jogs of people who were {study.unseen}. If the states are phases, "
        f"each {BINS}th of the stride has its usual state; by chance, the commonest of all would be right. A "
        "state tells the leg ahead if one leg is ahead in all of its frames; half is chance.",
        [claim(cuts)],
        [table],
        [_plot(shown, path)],
    )


@dataclass
class Cut:
    """Positions in the stride of the states of models with one number of states.

    regular   : share of each subject's frames in the usual state for that point of the stride, per cent
    leg       : share of each subject's frames with the leg ahead that is usual for the state, per cent
    commonest : share of each group's frames in the commonest state, per cent
    switches  : changes of state a stride, by group
    """

    regular: list[float] = field(default_factory=list)
    leg: list[float] = field(default_factory=list)
    commonest: list[float] = field(default_factory=list)
    switches: list[float] = field(default_factory=list)

    def add(self, jogs: Sequence[Capture], paths: Sequence[Ints]) -> None:
        """Add the jogs of one group with the states that one model gave their frames."""
        subjects = np.repeat([c.subject for c in jogs], [len(c.y) for c in jogs])
        apart = [c.y[:, HIPS[0]] - c.y[:, HIPS[1]] for c in jogs]
        turns = [turn(a) for a in apart]
        path = np.concatenate(paths)
        point = np.floor(np.concatenate(turns) * BINS).astype(int) % BINS
        self.regular += usual(point, path, subjects)
        self.leg += usual(path, np.concatenate(apart) > 0, subjects)
        self.commonest.append(100.0 * float(np.bincount(path).max()) / len(path))
        strides = sum(abs(float(t[-1] - t[0])) for t in turns)
        changes = sum(int((p[1:] != p[:-1]).sum()) for p in paths)
        self.switches.append(changes / max(strides, 1e-9))


def usual(given: NDArray[Any], what: NDArray[Any], subjects: NDArray[np.str_]) -> list[float]:
    """Per cent of each subject's frames in which `what` is the commonest value for the same `given`."""
    right = np.zeros(len(what), dtype=bool)
    for value in np.unique(given):
        here = given == value
        kinds, counts = np.unique(what[here], return_counts=True)
        right[here] = what[here] == kinds[counts.argmax()]
    return [100.0 * float(right[subjects == who].mean()) for who in np.unique(subjects)]


def turn(apart: Array) -> Array:
    """(T,) strides since the near leg was farthest ahead, by the thighs' difference and its change."""
    swing = apart - apart.mean()
    speed = np.gradient(swing)
    angle = np.arctan2(-speed * swing.std(), swing * speed.std())
    return np.asarray(np.unwrap(angle) / (2.0 * np.pi))


def claim(cuts: dict[int, Cut]) -> Claim:
    """The claim that two states are phases of the stride, and which phases."""
    two = cuts[2]
    regular, chance = float(np.mean(two.regular)), float(np.mean(two.commonest))
    leg = {count: float(np.mean(cut.leg)) for count, cut in cuts.items()}
    gained = (regular - chance) / max(100.0 - chance, 1e-9)
    here = (
        f"The two states are where they usually are in the stride in {regular:.0f} % of the frames (by "
        f"chance {chance:.0f} %) and change {np.mean(two.switches):.1f} times a stride. "
    )
    if leg[2] >= TELLING:
        here += f"They are the two legs: the state tells which is ahead in {leg[2]:.0f} % of the frames."
    else:
        here += f"They do not tell the legs apart ({leg[2]:.0f} % of the frames)"
        best = max(leg, key=lambda count: leg[count])
        here += f"; {best} states do so in {leg[best]:.0f} %." if best != 2 else "."
    return Claim(
        "A two-state model, started by clustering and refined by EM, cuts a jog into phases (shown, no "
        "number given).",
        verdict(gained >= CLEAR, gained >= SOME),
        here,
    )


def _plot(shown: Capture, path: Ints) -> Plot:
    T = min(SHOWN, len(shown.y))
    return Plot(
        lambda file: draw_synthesis(path[:T], ("state",) * 2, shown.y[:T], FPS, file, ""),
        "Stick figures, thigh and knee angles of a jog over a bar of the switching states",
        f"The longest jog ({shown.name}), {T} frames, 30 a second, and the states of the two-state model.",
    )
