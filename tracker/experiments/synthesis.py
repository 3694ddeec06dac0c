"""A walk of the model's own."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dynamics.gaussian import Array
from dynamics.motion.tasks import synthesise
from tracker.experiments.measures import WIDER, out_of_range
from tracker.experiments.panels import INK, grid, legend_below, legs, to_svg
from tracker.experiments.section import Claim, Heading, Plot, Section, Table, left_out, spread, verdict
from tracker.experiments.study import FPS, Recipe, Study
from tracker.motion.plots import stick_row

HEADING = Heading("synthesis", "A walk of its own", "1999, figure 5; 2000, figure 2 f")
FRAMES = 300
RUNS = 10
PERIODS = ((0, 50), (50, 150), (150, 300))
EVERY = 4  # frames between stick figures
STICKS = 50  # frames shown as stick figures, as in the papers
CURVES = 150
IN_RANGE = 10.0  # per cent of frames out of range up to which a walk is called one


@dataclass(frozen=True)
class Run:
    """s (T,) the switching states, y (T, 8) the poses and out (T,) whether an angle is out of range."""

    s: NDArray[np.intp]
    y: Array
    out: NDArray[np.bool_]


def run(study: Study) -> Section:
    """Free runs from several seeds, the first one drawn."""
    if "walk" not in study.motions:
        return left_out(HEADING, "the captures show no walk")
    slds = study.slds(_recipe(study))
    known = [c.y for c in study.lessons(_recipe(study))]
    made = []
    for n in study.each(HEADING.key, range(2 if study.quick else RUNS)):
        s, y = synthesise(slds, FRAMES, study.rng(4, n), recurrent=False)
        made.append(Run(s, y, out_of_range(y, known, WIDER)))
    shares = {f"{a} to {b - 1}": [100.0 * float(r.out[a:b].mean()) for r in made] for a, b in PERIODS}
    table = Table(
        f"Frames with an angle outside the captures' range (widened by {100 * WIDER:.0f} % on either "
        f"side), %, mean (least to greatest) of {len(made)} runs.",
        ("frames", "out of range, %"),
        tuple((frames, spread(values, 0)) for frames, values in shares.items()),
    )
    return Section(
        HEADING,
        f"A second-order model of everybody's walks, {slds.K} states, runs freely for {FRAMES} frames (10 "
        "s). Its switch depends on the last state alone.",
        tuple(claims(shares)),
        (table,),
        (_plot(made[0]),),
    )


def claims(shares: dict[str, list[float]]) -> list[Claim]:
    """From the shares out of range by period."""
    first, *_, last = shares
    start, end = float(np.mean(shares[first])), float(np.mean(shares[last]))
    return [
        Claim(
            "Sampling a learned walking model makes a walk of 50 frames (judged by eye).",
            verdict(start <= IN_RANGE, start <= 50.0),
            f"By number: {start:.0f} % of the first 50 frames are out of the captures' range; up to "
            f"{IN_RANGE:.0f} % is taken as a walk.",
        ),
        Claim(
            "It becomes less realistic as time goes on, for want of global constraints.",
            verdict(end > start + 1.0),
            f"Out of range: {start:.0f} % of frames {first}, {end:.0f} % of frames {last}.",
        ),
    ]


def _recipe(study: Study) -> Recipe:
    return Recipe(2, motions=("walk",)) if study.quick else Recipe(motions=("walk",))


def _plot(made: Run) -> Plot:
    figure, axes = grid([1.9, 1.6, 1.6, 1.1], share_x=False)
    shown = np.arange(0, STICKS, EVERY)
    stick_row(axes[0, 0], made.y[:STICKS], FPS, shown, 0, np.zeros(STICKS, dtype=bool))
    y, out = made.y[:CURVES], made.out[:CURVES]
    for ax, joint in zip(axes[1:3, 0], ("hip", "knee"), strict=True):
        legs(ax, y, joint)
        low, high = ax.get_ylim()
        ax.fill_between(np.arange(len(y)), low, high, where=out, color="#c1272d", alpha=0.18, linewidth=0,
                        step="mid", label="out of range")  # fmt: skip
        ax.set(ylim=(low, high), xlim=(0, CURVES - 1), xticklabels=[])
    legend_below(figure, axes[1, 0], 3)
    axes[3, 0].step(np.arange(len(y)), made.s[:CURVES] + 1, where="mid", color=INK, linewidth=1.2)
    axes[3, 0].set(xlabel="frame", ylabel="state", xlim=(0, CURVES - 1), ylim=(0.5, made.s.max() + 1.5))
    return Plot(
        to_svg(figure),
        "Stick figures, thigh and knee angles and switching states of a synthesised walk",
        f"The first run: stick figures every {EVERY} frames up to {STICKS}, then {CURVES} frames of the "
        "angles and the switching state.",
    )
