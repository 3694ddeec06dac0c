"""What the papers say of classification, against the cells of `tracker.experiments.motions`."""

from collections.abc import Iterable, Sequence
from dataclasses import asdict
from itertools import pairwise, product

import numpy as np

from dynamics.hmm import hmm_all
from tracker.experiments.motions import (
    FAR,
    HMM,
    INFERENCES,
    NOISE,
    ORDERS,
    POSED,
    SEEN,
    UNSEEN,
    Cell,
    Draw,
    cells,
    counts,
    draws,
    missing,
    motions_of,
    recipe,
)
from tracker.experiments.panels import GREY, MOTIONS, bar, grid, to_svg
from tracker.experiments.section import Claim, Plot, Section, Table, Verdict, left_out, share_verdict, spread
from tracker.experiments.splices import LONGEST, SHORTEST
from tracker.experiments.study import ANGLES, Recipe, Study
from tracker.motion.label_plot import patches

KEY, TITLE, SOURCE = "classification", "Walk or run?", "1999, figure 3; 2000, figure 2 a to d"
PAPER = 2.9  # per cent of the frames, 1999, section 4.1
ALIKE = 0.5  # per cent of the frames; inferences no further apart are taken as alike
PEOPLE = {SEEN: "people learned from", UNSEEN: "people left out"}
MARKS = {"viterbi": "o", "gpb2": "s", "variational": "^", HMM: "x", POSED: "D"}
TOLD = {"viterbi": "Viterbi", "gpb2": "GPB2", "variational": "variational", POSED: "Viterbi with pose *"}
SHADES = {0: "#c1272d", 1: "#e69f00", 2: "#0072b2"}


def recipes(study: Study) -> list[Recipe]:
    """Orders 1, 2 and the hidden Markov model, for all and for every fold."""
    if missing(study):
        return []
    held = dict.fromkeys((frozenset[str](), *study.folds))
    return [recipe(n, order, h) for h in held for n, order in product(counts(study), (0, *ORDERS))]


def cost(study: Study) -> int:
    """For progress."""
    return 0 if missing(study) else sum(_effort(n) for n in counts(study)) * len(draws(study))


def run(study: Study) -> Section:
    """All cells, the claims they answer, a sequence cut by every inference."""
    why = missing(study)
    if why is not None:
        return left_out(KEY, TITLE, SOURCE, why)
    tried = draws(study)
    found: list[Cell] = []
    for draw, n in product(tried, counts(study)):
        found += cells(study, draw, n)
        study.spend(_effort(n))
    people = [who for who in PEOPLE if any(c.people == who for c in found)]
    frames = {who: sum(len(d.truth) for d in tried if d.people == who) for who in people}
    few = min(len(d.splices) for d in tried)
    return Section(
        KEY,
        TITLE,
        SOURCE,
        f"Sequences spliced from pieces of {SHORTEST} to {LONGEST} frames of the captures, walk or run by "
        "a fair coin, the 4 frames on each side of a joint replaced by a least-squares cubic B-spline, "
        f"then {NOISE:g} degrees of white noise on all six angles. {_draws_told(tried, few)} Models are "
        "learned with the same noise and the two motions joined (1 in 1000 a frame to change). The error "
        "is the share of frames with the wrong motion; frames: "
        f"{', '.join(f'{n} of {PEOPLE[who]}' for who, n in frames.items())}.",
        tuple(_claims(found, people)),
        tuple(_table(found, who) for who in people),
        (_errors_plot(found, people), *(_cut_plot(study, tried[0], n) for n in {1, max(counts(study))})),
        {"frames": frames, "noise_degrees": NOISE, "cells": [asdict(c) for c in found]},
    )


def mean_wrong(found: Iterable[Cell], people: str) -> dict[tuple[int, int, str], float]:
    """Per cent, mean over draws, by (states, order, inference)."""
    rows: dict[tuple[int, int, str], list[float]] = {}
    for c in found:
        if c.people == people:
            rows.setdefault((c.states, c.order, c.inference), []).append(c.wrong)
    return {key: float(np.mean(values)) for key, values in rows.items()}


def _claims(found: Sequence[Cell], people: Sequence[str]) -> list[Claim]:
    claims = [_papers_error(found, people)]
    claims += [_hmm_worse(found, who) for who in people]
    claims += [_more_is_better(found, who) for who in people]
    return [*claims, _inferences_alike(found, people), _softness(found)]


def _papers_error(found: Sequence[Cell], people: Sequence[str]) -> Claim:
    means = mean_wrong(found, SEEN)
    multi = {key: e for key, e in means.items() if key[2] == "viterbi" and key[0] > 1}
    reached = [key for key, e in multi.items() if e <= PAPER]
    verdict = share_verdict(len(reached) / len(multi)) if reached else Verdict.FAILS
    best = min(multi, key=lambda key: multi[key])
    here = (
        f"Here {min(multi.values()):.1f} to {max(multi.values()):.1f} % over {len(multi)} such models; "
        f"the best has {best[0]} states a motion and order {best[1]}."
    )
    if UNSEEN in people:
        unseen = mean_wrong(found, UNSEEN)
        here += f" The same models of people who were left out: {min(unseen[k] for k in multi):.1f} to "
        here += f"{max(unseen[k] for k in multi):.1f} %, which the papers did not try."
    return Claim(
        f"A multi-state model with Viterbi inference errs on {PAPER} % of 8312 frames, spliced from the "
        "sequences it learned from.",
        verdict,
        here,
    )


def _hmm_worse(found: Sequence[Cell], people: str) -> Claim:
    means = mean_wrong(found, people)
    pairs = [(e, means[key[0], 0, HMM]) for key, e in means.items() if key[2] in INFERENCES]
    worse = sum(rival > e for e, rival in pairs)
    slds = min((e, key) for key, e in means.items() if key[2] in INFERENCES)
    rival = min((e, key) for key, e in means.items() if key[2] == HMM)
    better = "The best switching model" if slds[0] < rival[0] else "The best hidden Markov model"
    return Claim(
        f"The hidden Markov model is consistently worse than every inference of the SLDS ({PEOPLE[people]}).",
        share_verdict(worse / len(pairs)),
        f"It is worse in {worse} of {len(pairs)} comparisons at the same number of states. Best of each: "
        f"SLDS {slds[0]:.1f} %, hidden Markov model {rival[0]:.1f} %. {better} wins.",
    )


def _more_is_better(found: Sequence[Cell], people: str) -> Claim:
    means = {key: e for key, e in mean_wrong(found, people).items() if key[2] in INFERENCES}
    tried = sorted({key[0] for key in means})
    steps = [
        means[few, order, name] - means[more, order, name]
        for few, more in pairwise(tried)
        for order, name in product(ORDERS, INFERENCES)
    ]
    orders = [means[n, 1, name] - means[n, 2, name] for n, name in product(tried, INFERENCES)]
    gains = [*steps, *orders]
    return Claim(
        f"Accuracy rises with the number of states and with the order ({PEOPLE[people]}).",
        share_verdict(float(np.mean(np.array(gains) > 0))),
        f"More states lower the error in {sum(g > 0 for g in steps)} of {len(steps)} steps, second order in "
        f"{sum(g > 0 for g in orders)} of {len(orders)}.",
    )


def _inferences_alike(found: Sequence[Cell], people: Sequence[str]) -> Claim:
    apart: dict[tuple[str, int, int], float] = {}
    for who in people:
        means = mean_wrong(found, who)
        for n, order in {key[:2] for key in means if key[1]}:
            errors = [means[n, order, name] for name in INFERENCES]
            apart[who, n, order] = max(errors) - min(errors)
    where = max(apart, key=lambda key: apart[key])
    return Claim(
        "The three inferences give very similar errors.",
        share_verdict(float(np.mean([gap <= ALIKE for gap in apart.values()]))),
        f"They differ by {np.median(list(apart.values())):.1f} points in the median model and by "
        f"{apart[where]:.1f} at most ({where[1]} states, order {where[2]}, {PEOPLE[where[0]]}); up to "
        f"{ALIKE} is taken as similar.",
    )


def _softness(found: Sequence[Cell]) -> Claim:
    soft = {name: float(np.mean([c.soft for c in found if c.inference == name])) for name in INFERENCES}
    path, full, between = soft["viterbi"], soft["gpb2"], soft["variational"]
    order = (full > between > path) + (full > path)
    verdict = (Verdict.FAILS, Verdict.PARTLY, Verdict.HOLDS)[order]
    return Claim(
        "GPB2 gives soft estimates of the switching state, Viterbi none, variational something in between.",
        verdict,
        f"Frames in which no state is 99 % certain: GPB2 {full:.0f} %, variational {between:.1f} %, "
        f"Viterbi {path:.0f} %.",
    )


def _table(found: Sequence[Cell], people: str) -> Table:
    rows = []
    for n, order in sorted({(c.states, c.order) for c in found}):
        mine = [c for c in found if (c.people, c.states, c.order) == (people, n, order)]
        name = "hidden Markov model" if order == 0 else f"SLDS, order {order}"
        shown = (HMM, "", "", "") if order == 0 else tuple(TOLD)
        each = [spread([c.wrong for c in mine if c.inference == key]) if key else "" for key in shown]
        far = [f"{np.nanmean([c.far for c in mine if c.inference == shown[0]]):.1f}"]
        rows.append((f"{n}", name, *each, *far))
    return Table(
        f"{PEOPLE[people].capitalize()}: wrong frames, %, mean (least to greatest over draws). Far: the "
        f"first of these more than {FAR} frames from any joint. * Not in the papers: the pose itself also "
        "speaks for a state.",
        ("states a motion", "model", *TOLD.values(), "far from joints"),
        tuple(rows),
    )


def _errors_plot(found: Sequence[Cell], people: Sequence[str]) -> Plot:
    figure, axes = grid([3.4], len(people), share_x=False)
    tried = sorted({c.states for c in found})
    kinds = [(0, HMM), *product(ORDERS, INFERENCES)]
    for ax, who in zip(axes[0], people, strict=True):
        for n, (order, name) in product(range(len(tried)), kinds):
            errors = [
                c.wrong
                for c in found
                if (c.people, c.states, c.order, c.inference) == (who, tried[n], order, name)
            ]
            x = n + 0.1 * (kinds.index((order, name)) - len(kinds) / 2 + 0.5)
            ax.plot([x, x], [min(errors), max(errors)], color=SHADES[order], linewidth=1.2)
            told = "hidden Markov model" if order == 0 else f"order {order}, {TOLD[name]}"
            ax.plot(
                x,
                np.mean(errors),
                MARKS[name],
                color=SHADES[order],
                markersize=6,
                label=told if n == 0 else None,
            )
        ax.axhline(PAPER, color=GREY, linestyle="--", linewidth=1, label=f"1999 paper, {PAPER} %")
        ax.set(title=PEOPLE[who], xticks=range(len(tried)), xticklabels=tried, xlabel="states a motion")
    top = 1.12 * max(c.wrong for c in found if c.inference != POSED)
    for ax in axes[0]:
        ax.set_ylim(0, max(top, 1.1 * PAPER))
    axes[0, 0].set_ylabel("wrong frames, %")
    handles, names = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=4, frameon=False)
    return Plot(
        to_svg(figure),
        "Share of wrong frames by number of states, order and inference",
        "Marks are means, lines reach from the best to the worst draw.",
    )


def _cut_plot(study: Study, draw: Draw, n: int) -> Plot:
    """The first sequence, as figures 2 a and b of the 2000 paper show theirs."""
    first = draw.splices[0]
    slds = study.slds(recipe(n, 2, draw.held))
    hmm = study.hmm(recipe(n, 0, draw.held))
    rows = {"true motion": list(first.labels)}
    for name, infer in INFERENCES.items():
        probs = [p.prob for p in infer(slds, draw.ys[:1])]
        rows[TOLD[name]] = motions_of(slds, probs).tolist()
    path = hmm_all(hmm, [draw.ys[0][:, ANGLES]])[0].path
    rows["hidden Markov"] = np.array(hmm.labels)[path].tolist()
    figure, axes = grid([0.34 * len(rows) + 0.8])
    for row, values in enumerate(rows.values()):
        bar(axes[0, 0], values, row - 0.36, 0.72, MOTIONS)
    for joint in first.joints:
        axes[0, 0].plot([joint - 0.5] * 2, [-0.36, 0.36], color="white", linewidth=0.8)
    axes[0, 0].set(ylim=(len(rows) - 0.5, -0.5), xlim=(-0.5, len(first.y) - 0.5), xlabel="frame")
    axes[0, 0].set_yticks(range(len(rows)), list(rows))
    axes[0, 0].tick_params(axis="y", length=0)
    figure.legend(handles=patches(MOTIONS), loc="outside upper right", ncols=2, frameon=False)
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


def _effort(states: int) -> int:
    """Of all inferences with this many states on one draw."""
    return 2 * states
