"""Walk or run: classification of spliced sequences (1999, section 4.1 and figure 3; 2000, figure 2 a to d).

The papers' inference alone: the switching state's motion, nothing told of the pose or of the noise met. One
column goes beyond them: Viterbi with the pose's own term of `dynamics.region`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dynamics.gaussian import Array
from dynamics.gpb2 import gpb2_all
from dynamics.hmm import hmm_all
from dynamics.posterior import Posterior
from dynamics.region import pose_hints
from dynamics.slds import SLDS
from dynamics.variational import variational_all
from dynamics.viterbi import viterbi_all
from kinematics.mocap import Sequence as Capture
from tracker.experiments.splices import PIECES, Splice, long_enough, splice
from tracker.experiments.study import ANGLES, Recipe, Study, noisy

COUNTS = (1, 2, 4)
ORDERS = (1, 2)
NOISE = 5.0  # degrees, in learning and on the spliced sequences
SEQUENCES = 10  # a draw
DRAWS = 3
FAR = 10  # frames; further from any joint the splice itself plays no part
SURE = 0.99
SEEN, UNSEEN = "seen", "unseen"
HMM = "hmm"
POSED = "viterbi+pose"
INFERENCES: dict[str, Callable[[SLDS, Sequence[Array]], list[Posterior]]] = {
    "viterbi": viterbi_all,
    "gpb2": gpb2_all,
    "variational": variational_all,
}


@dataclass(frozen=True)
class Draw:
    """Spliced sequences of some people, and who is left out of the models they are shown to."""

    people: str
    held: frozenset[str]
    splices: tuple[Splice, ...]
    ys: tuple[Array, ...]

    @property
    def truth(self) -> NDArray[np.str_]:
        """The motion of every frame."""
        return np.concatenate([np.array(s.labels) for s in self.splices])


@dataclass(frozen=True)
class Cell:
    """One model by one inference on one draw.

    people, states, order, inference : which; order 0 for the hidden Markov model
    wrong, far : per cent of the frames with the wrong motion: all, those far from any joint
    soft       : per cent of the frames in which no state is as good as certain
    """

    people: str
    states: int
    order: int
    inference: str
    wrong: float
    far: float
    soft: float


def draws(study: Study) -> list[Draw]:
    """Sequences of everybody, several times; then of those left out, a group at a time."""
    found = []
    for n in range(1 if study.quick else DRAWS):
        found.append(_draw(study, SEEN, frozenset(), n))
    for n, held in enumerate(study.folds, len(found)):
        found.append(_draw(study, UNSEEN, held, n))
    return found


def missing(study: Study) -> str | None:
    """Why these captures cannot be spliced; None if they can."""
    for motion in ("walk", "run"):
        if motion not in study.motions:
            return f"the captures show no {motion}"
        for held in study.held_out:
            if not long_enough([c for c in study.tested(held) if c.label == motion]):
                return f"no {motion} is long enough to cut a piece from"
    return None


def counts(study: Study) -> tuple[int, ...]:
    """States a motion that are tried."""
    return COUNTS[:2] if study.quick else COUNTS


def recipe(states: int, order: int, held: frozenset[str]) -> Recipe:
    """A model of this experiment."""
    return Recipe(states, order, NOISE, held)


def cells(study: Study, draw: Draw, states: int) -> list[Cell]:
    """Every order and inference on one draw."""
    found = []
    hmm = study.hmm(recipe(states, 0, draw.held))
    posteriors = hmm_all(hmm, [y[:, ANGLES] for y in draw.ys])
    labels = np.array(hmm.labels)[np.concatenate([p.path for p in posteriors])]
    found.append(_cell(draw, (states, 0, HMM), labels, [p.prob for p in posteriors]))
    for order in ORDERS:
        slds = study.slds(recipe(states, order, draw.held))
        for name, infer in INFERENCES.items():
            answers = infer(slds, draw.ys)
            probs = [p.prob for p in answers]
            found.append(_cell(draw, (states, order, name), motions_of(slds, probs), probs))
        hinted = viterbi_all(slds, draw.ys, [pose_hints(slds, y) for y in draw.ys])
        probs = [p.prob for p in hinted]
        found.append(_cell(draw, (states, order, POSED), motions_of(slds, probs), probs))
    return found


def motions_of(slds: SLDS, probs: Sequence[Array]) -> NDArray[np.str_]:
    """The most probable motion of every frame, all sequences in a row."""
    names = sorted(set(slds.labels))
    belongs = np.array([[label == name for name in names] for label in slds.labels], dtype=float)
    found: NDArray[np.str_] = np.array(names)[(np.concatenate(probs) @ belongs).argmax(1)]
    return found


def _draw(study: Study, people: str, held: frozenset[str], number: int) -> Draw:
    rng = study.rng(2, number)
    captures: list[Capture] = long_enough(study.tested(held))
    sequences, pieces = (2, 3) if study.quick else (SEQUENCES, PIECES)
    made = tuple(splice(captures, rng, pieces) for _ in range(sequences))
    return Draw(people, held, made, tuple(noisy(s.y, NOISE, rng) for s in made))


def _cell(draw: Draw, which: tuple[int, int, str], labels: NDArray[np.str_], probs: Sequence[Array]) -> Cell:
    wrong = labels != draw.truth
    far = np.concatenate([s.far(FAR) for s in draw.splices])
    soft = np.concatenate(probs).max(1) < SURE
    share = float(100.0 * wrong[far].mean()) if far.any() else float("nan")
    return Cell(draw.people, *which, float(100.0 * wrong.mean()), share, float(100.0 * soft.mean()))
