"""The time that the inferences take on the same sequences (2000, section 4.1)."""

from timeit import repeat

import numpy as np

from tracker.experiments.classify import NAMES, NOISE, counts, tries
from tracker.experiments.measures import noisy
from tracker.experiments.section import Claim, Heading, Section, Table, verdict
from tracker.experiments.study import Study
from tracker.models.centred import centred, rootless
from tracker.motion.choices import Inference
from tracker.progress import counted

HEADING = Heading("runtime", "Which inference is quickest?", "2000, section 4.1")
FRAMES = 2000
REPEATS = 3
CLEAR = 1.5  # ratio of times from which one inference is clearly faster


def run(study: Study) -> Section:
    """The least time of several repetitions, microseconds a frame."""
    rng, repeats = study.rng(6), 1 if study.quick else REPEATS
    ys, frames = [], 0
    for capture in study.captures:
        if frames < (FRAMES // 4 if study.quick else FRAMES):
            ys.append(noisy(rootless(centred(capture.y)), NOISE, rng))
            frames += len(capture.y)
    micro: dict[int, dict[str, float]] = {}
    for n in study.each(HEADING.key, counts(study)):
        micro[n] = {
            name: 1e6 * min(repeat(infer, number=1, repeat=repeats)) / frames
            for (_, _, name), _, infer in tries(study, n, ys, (2,))
        }
    rows = [
        (
            str(n * len(study.motions)),
            *(f"{by[name]:.0f} ({by[name] / by[Inference.VITERBI]:.1f})" for name in NAMES),
        )
        for n, by in micro.items()
    ]
    table = Table(
        "Microseconds a frame, in brackets times Viterbi's; least of "
        f"{counted(repeats, 'run')} over {frames} frames, second order.",
        ("states in all", *NAMES.values()),
        rows,
    )
    return Section(
        HEADING,
        "The captures' own frames with noise, whole sequences side by side, in this very run; learned "
        "models of the classification. The rates depend on the machine and on what else it does, their "
        "ratios less.",
        [claim(micro)],
        [table],
    )


def claim(micro: dict[int, dict[str, float]]) -> Claim:
    """The claim about run time, judged by microseconds a frame for each number of states and inference."""
    ratios = [by[name] / by["viterbi"] for by in micro.values() for name in ("gpb2", "variational")]
    least, greatest = min(ratios), max(ratios)
    return Claim(
        "Viterbi is the clear winner in computational complexity.",
        verdict(least >= CLEAR, bool(np.median(ratios) > 1.0)),
        f"The others take {least:.1f} to {greatest:.1f} times as long; {CLEAR} times is taken as clear.",
    )
