"""How long the inferences take, side by side on the same sequences (2000, section 4.1)."""

import time
from collections.abc import Callable
from functools import partial

import numpy as np

from dynamics.hmm import hmm_all
from tracker.experiments.motions import INFERENCES, NOISE, counts
from tracker.experiments.section import Claim, Section, Table, Verdict
from tracker.experiments.study import ANGLES, Recipe, Study, noisy, six_angles

KEY, TITLE, SOURCE = "runtime", "Which inference is quickest?", "2000, section 4.1"
FRAMES = 2000
REPEATS = 3
COST = 3  # of one number of states, beside learning
CLEAR = 1.5  # times as long: a winner is clear


def recipes(study: Study) -> list[Recipe]:
    """Second order, everybody."""
    return [
        Recipe(n, order, NOISE, motions=study.motions) for n in counts(study) for order in (2, 0)
    ]  # the same as recipe(n, order, nobody) where there are both motions


def cost(study: Study) -> int:
    """For progress."""
    return COST * len(counts(study))


def run(study: Study) -> Section:
    """The least of several times, microseconds a frame."""
    rng, repeats = study.rng(6), 1 if study.quick else REPEATS
    ys, frames = [], 0
    for capture in study.captures:
        if frames < (FRAMES // 4 if study.quick else FRAMES):
            ys.append(noisy(six_angles(capture.y), NOISE, rng))
            frames += len(capture.y)
    seconds: dict[int, dict[str, float]] = {}
    for n in study.each(counts(study), COST):
        slds = study.slds(Recipe(n, 2, NOISE, motions=study.motions))
        hmm = study.hmm(Recipe(n, 0, NOISE, motions=study.motions))
        seconds[n] = {
            name: least_time(partial(infer, slds, ys), repeats) for name, infer in INFERENCES.items()
        }
        seconds[n]["hidden Markov model"] = least_time(
            partial(hmm_all, hmm, [y[:, ANGLES] for y in ys]), repeats
        )
    micro = {n: {name: 1e6 * s / frames for name, s in by.items()} for n, by in seconds.items()}
    names = list(next(iter(micro.values())))
    rows = tuple(
        (str(n * len(study.motions)), *(f"{by[name]:.0f} ({by[name] / by['viterbi']:.1f})" for name in names))
        for n, by in micro.items()
    )
    table = Table(
        f"Microseconds a frame, in brackets times Viterbi's; least of {repeats} runs over {frames} frames, "
        "second order.",
        ("states in all", *(name.replace("viterbi", "Viterbi").replace("gpb2", "GPB2") for name in names)),
        rows,
    )
    return Section(
        KEY,
        TITLE,
        SOURCE,
        "The captures' own frames with noise, whole sequences side by side, in this very run; learned "
        "models of the classification. The rates depend on the machine and on what else it does, their "
        "ratios less.",
        (claim(micro),),
        (table,),
        (),
        {"microseconds_a_frame": {str(n): by for n, by in micro.items()}, "frames": frames},
    )


def claim(micro: dict[int, dict[str, float]]) -> Claim:
    """From microseconds a frame by states and inference."""
    ratios = [by[name] / by["viterbi"] for by in micro.values() for name in ("gpb2", "variational")]
    least, greatest = min(ratios), max(ratios)
    verdict = (
        Verdict.HOLDS if least >= CLEAR else Verdict.PARTLY if np.median(ratios) > 1.0 else Verdict.FAILS
    )
    return Claim(
        "Viterbi is the clear winner in computational complexity.",
        verdict,
        f"The others take {least:.1f} to {greatest:.1f} times as long; {CLEAR} times is taken as clear.",
    )


def least_time(job: Callable[[], object], repeats: int) -> float:
    """Seconds, the least of several runs."""
    times = []
    for _ in range(repeats):
        began = time.perf_counter()
        job()
        times.append(time.perf_counter() - began)
    return min(times)
