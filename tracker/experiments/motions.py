"""Walk or run: classification of spliced sequences (1999, section 4.1 and figure 3; 2000, figure 2 a to d).

The papers' inference alone: the switching state's motion, nothing told of the pose or of the noise met.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dynamics.gaussian import Array
from dynamics.hmm import HMM, HMMPosterior, hmm_all
from dynamics.motion.tasks import labelling
from dynamics.posterior import Posterior, Switching
from dynamics.slds import SLDS
from tracker.experiments.measures import ANGLES, noisy, wrong_frames
from tracker.experiments.splices import PIECES, Splice, long_enough, splice
from tracker.experiments.study import MOTIONS, Recipe, Study
from tracker.motion.tasks import INFERENCES

COUNTS = (1, 2, 4)
ORDERS = (1, 2)
NOISE = 5.0  # degrees, in learning and on the spliced sequences
SEQUENCES = 10  # a draw
DRAWS = 3
FAR = 10  # frames; further from any joint the splice itself plays no part
SURE = 0.99
SEEN, UNSEEN = "seen", "unseen"
HIDDEN = "hmm"


@dataclass(frozen=True)
class Draw:
    """Spliced sequences of some people, and who is left out of the models they are shown to."""

    people: str
    held: frozenset[str]
    splices: tuple[Splice, ...]
    ys: tuple[Array, ...]

    @property
    def labels(self) -> list[str]:
        return [label for s in self.splices for label in s.labels]


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
    seen = [(SEEN, frozenset[str]())] * (1 if study.quick else DRAWS)
    unseen = [(UNSEEN, held) for held in study.folds]
    return [_draw(study, people, held, n) for n, (people, held) in enumerate(seen + unseen)]


def missing(study: Study) -> str | None:
    """Why these captures cannot be spliced; None if they can."""
    for motion in MOTIONS:
        if motion not in study.motions:
            return f"the captures show no {motion}"
        for held in study.held_out:
            if not long_enough([c for c in study.tested(held) if c.label == motion]):
                return f"no {motion} is long enough to cut a piece from"
    return None


def counts(study: Study) -> tuple[int, ...]:
    """States a motion that are tried."""
    return COUNTS[:2] if study.quick else COUNTS


def recipe(states: int, order: int, held: frozenset[str] = frozenset()) -> Recipe:
    """A model of this experiment."""
    return Recipe(states, order, NOISE, held)


def cells(study: Study, draw: Draw, states: int) -> list[Cell]:
    """Every order and inference on one draw."""
    hmm = study.hmm(recipe(states, 0, draw.held))
    hidden = hmm_all(hmm, [y[:, ANGLES] for y in draw.ys])
    found = [_cell(draw, (states, 0, HIDDEN), hmm, hidden)]
    for order in ORDERS:
        slds = study.slds(recipe(states, order, draw.held))
        for name, infer in INFERENCES.items():
            found.append(_cell(draw, (states, order, name), slds, infer(slds, draw.ys, None)))
    return found


def _draw(study: Study, people: str, held: frozenset[str], number: int) -> Draw:
    rng = study.rng(2, number)
    captures = long_enough(study.tested(held))
    sequences, pieces = (2, 3) if study.quick else (SEQUENCES, PIECES)
    made = tuple(splice(captures, rng, pieces) for _ in range(sequences))
    return Draw(people, held, made, tuple(noisy(s.y, NOISE, rng) for s in made))


def _cell(
    draw: Draw,
    which: tuple[int, int, str],
    model: SLDS | HMM,
    posteriors: Sequence[Posterior] | Sequence[Switching] | Sequence[HMMPosterior],
) -> Cell:
    found = [label for p in posteriors for label in labelling(model.labels, p.prob, p.path).label]
    far = np.concatenate([s.far(FAR) for s in draw.splices])
    _, wrong, away = wrong_frames(found, draw.labels, far)
    soft = np.concatenate([p.prob for p in posteriors]).max(1) < SURE
    return Cell(draw.people, *which, wrong, away, 100.0 * float(soft.mean()))
