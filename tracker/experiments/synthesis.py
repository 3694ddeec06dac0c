"""Synthesised walks."""

import numpy as np

from dynamics.motion.tasks import synthesise
from tracker.experiments.measures import WIDER, out_of_range
from tracker.experiments.section import Claim, Heading, Plot, Section, Table, left_out, spread, verdict
from tracker.experiments.study import FPS, Recipe, Study
from tracker.models.learn import STATES
from tracker.motion.plots import draw_synthesis

HEADING = Heading("synthesis", "A walk of its own", "1999, figure 5; 2000, figure 2 f")
FRAMES = 300
RUNS = 10
PERIODS = ((0, 50), (50, 150), (150, 300))
IN_RANGE = 10.0  # largest share of frames out of range for a walk, per cent


def run(study: Study) -> Section:
    """Samples from several seeds, of which the first is drawn."""
    if "walk" not in study.motions:
        return left_out(HEADING, "the captures show no walk")
    recipe = Recipe(2 if study.quick else STATES, motions=("walk",))
    slds, known = study.slds(recipe), [c.y for c in study.lessons(recipe)]
    runs = study.each(HEADING.key, range(2 if study.quick else RUNS))
    made = [synthesise(slds, FRAMES, study.rng(4, n), recurrent=False) for n in runs]
    out = np.array([out_of_range(y, known, WIDER) for _, y in made])
    shares = {f"{a} to {b - 1}": (100.0 * out[:, a:b].mean(axis=1)).tolist() for a, b in PERIODS}
    table = Table(
        f"Frames with an angle outside the captures' range (widened by {100 * WIDER:.0f} % on either "
        f"side), %, mean (least to greatest) of {len(made)} runs.",
        ("frames", "out of range, %"),
        [(frames, spread(values, 0)) for frames, values in shares.items()],
    )
    states, shown = made[0]
    plot = Plot(
        lambda file: draw_synthesis(states, slds.labels, shown, FPS, file, ""),
        "Stick figures, thigh and knee angles and switching states of a synthesised walk",
        "The first run: stick figures at its start, in its middle and at its end, the angles and the "
        "switching state.",
    )
    return Section(
        HEADING,
        f"A second-order model of everybody's walks, {slds.K} states, runs freely for {FRAMES} frames (10 "
        "s). Its switch depends on the last state alone.",
        claims(shares),
        [table],
        [plot],
    )


def claims(shares: dict[str, list[float]]) -> list[Claim]:
    """The claims, judged by the shares of frames out of range in each period."""
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
