"""Walk or run: classification of spliced sequences (1999, section 4.1 and figure 3; 2000, figure 2 a to d).

Only the papers' inference is used: the switching state's motion, without pose likelihood or measured noise.
"""

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np

from dynamics.gaussian import Array
from dynamics.hmm import hmm_all
from dynamics.motion.tasks import labelling
from dynamics.posterior import Switching
from tracker.experiments.measures import noisy, wrong_shares
from tracker.experiments.section import (
    Claim,
    Heading,
    Plot,
    Section,
    Table,
    as_sequence,
    left_out,
    share_verdict,
    spread,
    verdict,
)
from tracker.experiments.splices import LONGEST, PIECES, SHORTEST, Splice, long_enough, splice
from tracker.experiments.study import MOTIONS, Recipe, Study
from tracker.models.centred import ANGLES
from tracker.motion.choices import Inference
from tracker.motion.label_plot import draw_labels
from tracker.motion.tasks import INFERENCES
from tracker.progress import counted

HEADING = Heading("classification", "Walk or run?", "1999, figure 3; 2000, figure 2 a to d")
COUNTS = (1, 2, 4)
ORDERS = (1, 2)
NOISE = 5.0  # degrees, in learning and on the spliced sequences
SEQUENCES = 10  # sequences in a draw
DRAWS = 3
FAR = 10  # frames from any joint, beyond which the splice has no influence
SURE = 0.99
SEEN, UNSEEN = "people learned from", "people left out"
HIDDEN = Inference.HMM
PAPER = 2.9  # wrong frames in the paper, per cent, 1999, section 4.1
ALIKE = 0.5  # largest difference between equally good inferences, per cent of the frames
NAMES = {
    Inference.VITERBI: "Viterbi",
    Inference.GPB2: "GPB2",
    Inference.VARIATIONAL: "variational",
    HIDDEN: "hidden Markov model",
}

Infer = Callable[[], Sequence[Switching]]
Key = tuple[int, int, str]  # states a motion, order (0 for the hidden Markov model), inference
Means = dict[Key, float]


@dataclass(frozen=True)
class Draw:
    """Spliced sequences of some people, and the people left out of the models tested on them."""

    people: str
    held: frozenset[str]
    splices: tuple[Splice, ...]
    ys: tuple[Array, ...]

    @property
    def labels(self) -> list[str]:
        return [label for s in self.splices for label in s.labels]


class Score(NamedTuple):
    """Shares of the frames of one draw, per cent.

    wrong, far : with the wrong motion, among all and among those far from any joint
    soft       : in which no state is nearly certain
    """

    wrong: float
    far: float
    soft: float


Found = Mapping[str, Mapping[Key, Sequence[Score]]]  # by people, a score for each draw


def run(study: Study) -> Section:
    """All scores, the claims judged by them, and one sequence segmented by every inference."""
    why = missing(study)
    if why is not None:
        return left_out(HEADING, why)
    tried = draws(study)
    found: dict[str, dict[Key, list[Score]]] = defaultdict(lambda: defaultdict(list))
    for draw, n in study.each(HEADING.key, list(product(tried, counts(study)))):
        for key, labels, infer in tries(study, n, draw.ys, held=draw.held):
            found[draw.people][key].append(score(draw, labels, infer()))
    frames = {who: sum(len(d.labels) for d in tried if d.people == who) for who in found}
    return Section(
        HEADING,
        f"Sequences spliced from pieces of {SHORTEST} to {LONGEST} frames of the captures, walk or run by "
        "a fair coin, the 4 frames on each side of a joint replaced by a least-squares cubic B-spline, "
        f"then {NOISE:g} degrees of white noise on all six angles. {_draws_told(tried)} Models are "
        "learned with the same noise and the two motions joined (1 in 1000 a frame to change). The error "
        "is the share of frames with the wrong motion; frames: "
        f"{', '.join(f'{n} of {who}' for who, n in frames.items())}.",
        claims(found),
        [_table(of, who) for who, of in found.items()],
        [_cut_plot(study, tried[0], n) for n in {1, max(counts(study))}],
    )


def draws(study: Study) -> list[Draw]:
    """Several draws of sequences of all people; then one for each group of people left out."""
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
    """Numbers of states for each motion that are tried."""
    return COUNTS[:2] if study.quick else COUNTS


def tries(
    study: Study,
    states: int,
    ys: Sequence[Array],
    orders: Sequence[int] = ORDERS,
    held: frozenset[str] = frozenset(),
) -> Iterator[tuple[Key, tuple[str, ...], Infer]]:
    """For every inference, the hidden Markov model's too: the states' labels, and what gives posteriors."""
    for order in orders:
        slds = study.slds(Recipe(states, order, NOISE, held, study.motions))
        for name, infer in INFERENCES.items():
            yield (states, order, name), slds.labels, partial(infer, slds, ys, None)
    hmm = study.hmm(Recipe(states, 0, NOISE, held, study.motions))
    yield (states, 0, HIDDEN), hmm.labels, partial(hmm_all, hmm, [y[:, ANGLES] for y in ys])


def score(draw: Draw, labels: tuple[str, ...], posteriors: Sequence[Switching]) -> Score:
    """The score on one draw of a model whose states have these labels, by one inference."""
    found = [label for p in posteriors for label in labelling(labels, p.prob, p.path).label]
    far = np.concatenate([s.far(FAR) for s in draw.splices])
    soft = np.concatenate([p.prob for p in posteriors]).max(1) < SURE
    return Score(*wrong_shares(found, draw.labels, far), 100.0 * float(soft.mean()))


def claims(found: Found) -> list[Claim]:
    """The papers' claims about classification, judged by the scores."""
    wrong = {
        who: {key: float(np.mean([s.wrong for s in each])) for key, each in of.items()}
        for who, of in found.items()
    }
    slds = {who: {key: e for key, e in means.items() if key[2] != HIDDEN} for who, means in wrong.items()}
    return [
        _papers_error(slds),
        *(_hmm_worse(wrong[who], slds[who], who) for who in wrong),
        *(_more_is_better(slds[who], who) for who in wrong),
        _inferences_alike(slds),
        _softness(found),
    ]


def _draw(study: Study, people: str, held: frozenset[str], number: int) -> Draw:
    rng = study.rng(2, number)
    captures = long_enough(study.tested(held))
    sequences, pieces = (2, 3) if study.quick else (SEQUENCES, PIECES)
    made = tuple(splice(captures, rng, pieces) for _ in range(sequences))
    return Draw(people, held, made, tuple(noisy(s.y, NOISE, rng) for s in made))


def _papers_error(slds: dict[str, Means]) -> Claim:
    multi = {key: e for key, e in slds[SEEN].items() if key[2] == Inference.VITERBI and key[0] > 1}
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
    apart = {
        (who, n, order): float(np.ptp([means[n, order, name] for name in INFERENCES]))
        for who, means in slds.items()
        for n, order, _ in means
    }
    where = max(apart, key=lambda key: apart[key])
    return Claim(
        "The three inferences give very similar errors.",
        share_verdict([gap <= ALIKE for gap in apart.values()]),
        f"They differ by {np.median(list(apart.values())):.1f} points in the median model and by "
        f"{apart[where]:.1f} at most ({where[1]} states, order {where[2]}, {where[0]}); up to "
        f"{ALIKE} is taken as similar.",
    )


def _softness(found: Found) -> Claim:
    path, full, between = (
        float(np.mean([s.soft for of in found.values() for key in of if key[2] == name for s in of[key]]))
        for name in INFERENCES
    )
    return Claim(
        "GPB2 gives soft estimates of the switching state, Viterbi none, variational something in between.",
        verdict(full > between > path, full > path),
        f"Frames in which no state is 99 % certain: GPB2 {full:.0f} %, variational {between:.1f} %, "
        f"Viterbi {path:.0f} %.",
    )


def _table(found: Mapping[Key, Sequence[Score]], people: str) -> Table:
    rows = []
    for n, order in sorted({key[:2] for key in found}):
        mine = [found[n, order, name] for name in ((HIDDEN,) if order == 0 else INFERENCES)]
        wrong = [spread([s.wrong for s in each]) for each in mine]
        far = f"{np.nanmean([s.far for s in mine[0]]):.1f}"
        name = NAMES[HIDDEN] if order == 0 else f"SLDS, order {order}"
        rows.append((f"{n}", name, *wrong, *[""] * (len(INFERENCES) - len(wrong)), far))
    return Table(
        f"{people.capitalize()}: wrong frames, %, mean (least to greatest over draws). Far: the "
        f"first of these more than {FAR} frames from any joint.",
        ("states a motion", "model", *(NAMES[name] for name in INFERENCES), "far from joints"),
        rows,
    )


def _cut_plot(study: Study, draw: Draw, n: int) -> Plot:
    """A plot of the first sequence like figures 2 a and b of the 2000 paper."""
    first, y = draw.splices[0], draw.ys[0]
    truth = np.array([MOTIONS.index(label) for label in first.labels])
    rows = {"true motion": labelling(MOTIONS, np.eye(len(MOTIONS))[truth], truth)}
    for (_, _, name), labels, infer in tries(study, n, [y], (2,), draw.held):
        [found] = infer()
        rows[NAMES[Inference(name)]] = labelling(labels, found.prob, found.path)
    sequences = [as_sequence(name, y) for name in rows]
    return Plot(
        lambda file: draw_labels(sequences, list(rows.values()), file, "True and found motion", shares=False),
        "One spliced sequence: the true motion and what each inference makes of it",
        f"One sequence of people learned from; {counted(n, 'state')} a motion, second order.",
    )


def _draws_told(tried: Sequence[Draw]) -> str:
    seen, sequences = sum(d.people == SEEN for d in tried), len(tried[0].splices)
    text = f"{seen} draws of {sequences} sequences of everybody, by models learned from everybody"
    if len(tried) == seen:
        return f"{text}; too few subjects to leave some out."
    return f"{text}; {len(tried) - seen} groups of subjects left out in turn, {sequences} sequences each."
