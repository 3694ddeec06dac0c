"""Walk or run: classification of spliced sequences (1999, section 4.1 and figure 3; 2000, figure 2 a to d).

The papers' inference alone: the switching state's motion, nothing told of the pose or of the noise met.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np

from dynamics.gaussian import Array
from dynamics.hmm import HMM, HMMPosterior, hmm_all
from dynamics.motion.tasks import classify_hmm, labelling
from dynamics.posterior import Posterior, Switching
from dynamics.slds import SLDS
from tracker.experiments.measures import ANGLES, noisy, wrong_frames
from tracker.experiments.panels import SHADES, bars, grid, to_svg
from tracker.experiments.section import (
    Claim,
    Heading,
    Plot,
    Section,
    Table,
    left_out,
    share_verdict,
    spread,
    verdict,
)
from tracker.experiments.splices import LONGEST, PIECES, SHORTEST, Splice, long_enough, splice
from tracker.experiments.study import MOTIONS, Recipe, Study
from tracker.motion.label_plot import patches
from tracker.motion.tasks import INFERENCES

HEADING = Heading("classification", "Walk or run?", "1999, figure 3; 2000, figure 2 a to d")
COUNTS = (1, 2, 4)
ORDERS = (1, 2)
NOISE = 5.0  # degrees, in learning and on the spliced sequences
SEQUENCES = 10  # a draw
DRAWS = 3
FAR = 10  # frames; further from any joint the splice itself plays no part
SURE = 0.99
SEEN, UNSEEN = "seen", "unseen"
HIDDEN = "hmm"
PAPER = 2.9  # per cent of the frames, 1999, section 4.1
ALIKE = 0.5  # per cent of the frames; inferences no further apart are taken as alike
PEOPLE = {SEEN: "people learned from", UNSEEN: "people left out"}
TOLD = {"viterbi": "Viterbi", "gpb2": "GPB2", "variational": "variational"}

Key = tuple[int, int, str]
Means = dict[Key, float]


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


def run(study: Study) -> Section:
    """All cells, the claims they answer, a sequence cut by every inference."""
    why = missing(study)
    if why is not None:
        return left_out(HEADING, why)
    tried = draws(study)
    found: list[Cell] = []
    for draw, n in study.each(HEADING.key, list(product(tried, counts(study)))):
        found += cells(study, draw, n)
    people = [who for who in PEOPLE if any(c.people == who for c in found)]
    frames = {who: sum(len(d.labels) for d in tried if d.people == who) for who in people}
    few = min(len(d.splices) for d in tried)
    return Section(
        HEADING,
        f"Sequences spliced from pieces of {SHORTEST} to {LONGEST} frames of the captures, walk or run by "
        "a fair coin, the 4 frames on each side of a joint replaced by a least-squares cubic B-spline, "
        f"then {NOISE:g} degrees of white noise on all six angles. {_draws_told(tried, few)} Models are "
        "learned with the same noise and the two motions joined (1 in 1000 a frame to change). The error "
        "is the share of frames with the wrong motion; frames: "
        f"{', '.join(f'{n} of {PEOPLE[who]}' for who, n in frames.items())}.",
        tuple(claims(found)),
        tuple(_table(found, who) for who in people),
        tuple(_cut_plot(study, tried[0], n) for n in {1, max(counts(study))}),
    )


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


def mean_wrong(found: Iterable[Cell]) -> dict[str, Means]:
    """Per cent, mean over draws, by people and (states, order, inference)."""
    rows: dict[str, dict[Key, list[float]]] = {}
    for c in found:
        rows.setdefault(c.people, {}).setdefault((c.states, c.order, c.inference), []).append(c.wrong)
    return {who: {key: float(np.mean(each)) for key, each in of.items()} for who, of in rows.items()}


def claims(found: Sequence[Cell]) -> list[Claim]:
    """Claims of the papers about classification, judged by the measured cells."""
    wrong = mean_wrong(found)
    slds = {who: {key: e for key, e in means.items() if key[2] != HIDDEN} for who, means in wrong.items()}
    return [
        _papers_error(slds),
        *(_hmm_worse(wrong[who], slds[who], PEOPLE[who]) for who in wrong),
        *(_more_is_better(slds[who], PEOPLE[who]) for who in wrong),
        _inferences_alike(slds),
        _softness(found),
    ]


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


def _papers_error(slds: dict[str, Means]) -> Claim:
    multi = {key: e for key, e in slds[SEEN].items() if key[2] == "viterbi" and key[0] > 1}
    best = min(multi, key=lambda key: multi[key])
    here = (
        f"Here {min(multi.values()):.1f} to {max(multi.values()):.1f} % over {len(multi)} such models; "
        f"the best has {best[0]} states a motion and order {best[1]}."
    )
    if UNSEEN in slds:
        unseen = [slds[UNSEEN][key] for key in multi]
        here += f" The same models of people who were left out: {min(unseen):.1f} to {max(unseen):.1f} %, "
        here += "which the papers did not try."
    return Claim(
        f"A multi-state model with Viterbi inference errs on {PAPER} % of 8312 frames, spliced from the "
        "sequences it learned from.",
        share_verdict([e <= PAPER for e in multi.values()]),
        here,
    )


def _hmm_worse(wrong: Means, slds: Means, people: str) -> Claim:
    hidden = {states: e for (states, _, name), e in wrong.items() if name == HIDDEN}
    worse = [hidden[states] > e for (states, _, _), e in slds.items()]
    best, rival = min(slds.values()), min(hidden.values())
    return Claim(
        f"The hidden Markov model is consistently worse than every inference of the SLDS ({people}).",
        share_verdict(worse),
        f"It is worse in {sum(worse)} of {len(worse)} comparisons at the same number of states. Best of "
        f"each: SLDS {best:.1f} %, hidden Markov model {rival:.1f} %. The best "
        f"{'switching' if best < rival else 'hidden Markov'} model wins.",
    )


def _more_is_better(slds: Means, people: str) -> Claim:
    tried = sorted({key[0] for key in slds})
    steps = [
        slds[few, order, name] > slds[more, order, name]
        for (few, more), order, name in product(pairwise(tried), ORDERS, INFERENCES)
    ]
    orders = [slds[n, 1, name] > slds[n, 2, name] for n, name in product(tried, INFERENCES)]
    return Claim(
        f"Accuracy rises with the number of states and with the order ({people}).",
        share_verdict(steps + orders),
        f"More states lower the error in {sum(steps)} of {len(steps)} steps, second order in "
        f"{sum(orders)} of {len(orders)}.",
    )


def _inferences_alike(slds: dict[str, Means]) -> Claim:
    apart: dict[tuple[str, int, int], float] = {}
    for who, means in slds.items():
        for n, order in {key[:2] for key in means}:
            apart[who, n, order] = float(np.ptp([means[n, order, name] for name in INFERENCES]))
    where = max(apart, key=lambda key: apart[key])
    return Claim(
        "The three inferences give very similar errors.",
        share_verdict([gap <= ALIKE for gap in apart.values()]),
        f"They differ by {np.median(list(apart.values())):.1f} points in the median model and by "
        f"{apart[where]:.1f} at most ({where[1]} states, order {where[2]}, {PEOPLE[where[0]]}); up to "
        f"{ALIKE} is taken as similar.",
    )


def _softness(found: Sequence[Cell]) -> Claim:
    path, full, between = (
        float(np.mean([c.soft for c in found if c.inference == name])) for name in INFERENCES
    )
    return Claim(
        "GPB2 gives soft estimates of the switching state, Viterbi none, variational something in between.",
        verdict(full > between > path, full > path),
        f"Frames in which no state is 99 % certain: GPB2 {full:.0f} %, variational {between:.1f} %, "
        f"Viterbi {path:.0f} %.",
    )


def _table(found: Sequence[Cell], people: str) -> Table:
    rows = []
    for n, order in sorted({(c.states, c.order) for c in found}):
        mine = [c for c in found if (c.people, c.states, c.order) == (people, n, order)]
        name = "hidden Markov model" if order == 0 else f"SLDS, order {order}"
        shown = (HIDDEN, "", "") if order == 0 else tuple(TOLD)
        each = [spread([c.wrong for c in mine if c.inference == key]) if key else "" for key in shown]
        far = [f"{np.nanmean([c.far for c in mine if c.inference == shown[0]]):.1f}"]
        rows.append((f"{n}", name, *each, *far))
    return Table(
        f"{PEOPLE[people].capitalize()}: wrong frames, %, mean (least to greatest over draws). Far: the "
        f"first of these more than {FAR} frames from any joint.",
        ("states a motion", "model", *TOLD.values(), "far from joints"),
        tuple(rows),
    )


def _cut_plot(study: Study, draw: Draw, n: int) -> Plot:
    """The first sequence, as figures 2 a and b of the 2000 paper show theirs."""
    first, y = draw.splices[0], draw.ys[0]
    slds, hmm = study.slds(recipe(n, 2, draw.held)), study.hmm(recipe(n, 0, draw.held))
    rows = {"true motion": first.labels}
    for name, infer in INFERENCES.items():
        [found] = infer(slds, [y], None)
        rows[TOLD[name]] = labelling(slds.labels, found.prob, found.path).label
    rows["hidden Markov"] = classify_hmm(hmm, [y[:, ANGLES]])[0].label
    figure, axes = grid([0.34 * len(rows) + 0.8])
    bars(axes[0, 0], rows, SHADES)
    axes[0, 0].vlines(np.array(first.joints) - 0.5, -0.36, 0.36, color="white", linewidth=0.8)
    figure.legend(handles=patches(SHADES), loc="outside upper right", ncols=2, frameon=False)
    return Plot(
        to_svg(figure),
        "One spliced sequence: the true motion and what each inference makes of it",
        f"One sequence of people learned from; {n} state{'s' if n > 1 else ''} a motion, second order. "
        "White lines: joints.",
    )


def _draws_told(tried: Sequence[Draw], sequences: int) -> str:
    seen = sum(d.people == SEEN for d in tried)
    unseen = len(tried) - seen
    text = f"{seen} draws of {sequences} sequences of everybody, by models learned from everybody"
    if unseen:
        return f"{text}; {unseen} groups of subjects left out in turn, {sequences} sequences each."
    return f"{text}; too few subjects to leave some out."
