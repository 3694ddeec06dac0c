"""Walks with missing frames, filled by the SLDS and without a model of walking (1999, figure 6)."""

from collections import defaultdict
from functools import partial
from itertools import product

import numpy as np

from dynamics.slds import SLDS
from dynamics.viterbi import viterbi
from kinematics.mocap import Sequence as Capture
from tracker.experiments import measures
from tracker.experiments.ahead import model
from tracker.experiments.measures import SIDE, Errors, Fill
from tracker.experiments.section import Claim, Heading, Plot, Section, Table, as_sequence, left_out, verdict
from tracker.experiments.study import Study
from tracker.models.centred import ANGLES
from tracker.motion.plots import draw_forecast

HEADING = Heading("interpolation", "Frames that are missing", "1999, figure 6")
FIRST, END = 50, 100  # range of missing frames in the figure
AROUND = 40  # frames on either side that the figure shows
GAPS = (10, 25, 50)
EACH = 2  # longest captures taken of each subject
BETTER = 0.75  # largest error as a share of that without a model for the claim to hold
LINEAR, SPLINE, PATH = NAMES = "straight line", "cubic spline", "SLDS, best path"

Key = tuple[str, int]  # method, and frames of the gap


def run(study: Study) -> Section:
    """Gaps in the middle of the longest walks, and the papers' frames 50 to 100 of the longest of all."""
    walks = _walks(study)
    if not walks:
        return left_out(HEADING, f"no walk is {GAPS[0] + 2 * SIDE} frames long")
    found: dict[Key, list[Errors]] = defaultdict(list)
    for walk in study.each(HEADING.key, walks):
        fills = _fills(_model_of(study, walk)).items()
        for gap, (name, fill) in product(GAPS[:2] if study.quick else GAPS, fills):
            if measures.spans(walk.y, gap):
                found[name, gap].append(measures.gap_errors(fill, walk, gap))
    total = {key: measures.rms(errors) for key, errors in found.items()}
    gaps = [gap for gap in GAPS if (LINEAR, gap) in total]
    table = Table(
        "Error inside the gap, degrees, root mean square over frames and six angles (least to greatest "
        "over subjects).",
        ("filled by", *(f"{gap} frames" for gap in gaps)),
        [(name, *(measures.in_words(found[name, g]) for g in gaps)) for name in NAMES],
    )
    return Section(
        HEADING,
        "All freedoms of some frames in the middle of a walk are blanked, the rest of it shown, and the "
        f"frames between filled. The {EACH} longest walks of each subject; people were {study.unseen}.",
        [_quality(total, gaps[-1]), *([_sparser(total, gaps)] if len(gaps) > 1 else [])],
        [table],
        [_example(study, max(walks, key=lambda c: len(c.y)))],
    )


def _walks(study: Study) -> list[Capture]:
    """The longest walks of each subject that are long enough for the shortest gap."""
    chosen: dict[str, list[Capture]] = defaultdict(list)
    for walk in sorted(study.of("walk"), key=lambda c: -len(c.y)):
        if measures.spans(walk.y, GAPS[0]):
            chosen[walk.subject].append(walk)
    return [walk for theirs in chosen.values() for walk in theirs[: 1 if study.quick else EACH]]


def _model_of(study: Study, walk: Capture) -> SLDS:
    """The model that was learned without this walk's subject."""
    held = next((fold for fold in study.folds if walk.subject in fold), frozenset[str]())
    return study.slds(model(study, held))


def _fills(slds: SLDS) -> dict[str, Fill]:
    return {
        LINEAR: partial(measures.across, 1),
        SPLINE: partial(measures.across, 3),
        PATH: partial(measures.best_path, slds),
    }


def _quality(total: dict[Key, float], gap: int) -> Claim:
    blind, path = min(total[LINEAR, gap], total[SPLINE, gap]), total[PATH, gap]
    holds = path < BETTER * blind
    here = (
        f"In gaps of {gap} frames the best path errs by {path:.1f} degrees, the better of line and spline "
        f"by {blind:.1f}. "
    )
    if holds:
        here += "The learned walk carries on through the gap."
    else:
        here += (
            "The gait stops in a long gap, where only Pi speaks; 'figtrack interpolate' therefore fills it "
            "otherwise."
        )
    paper = "The quality of the frames filled in was high (judged by eye)."
    return Claim(paper, verdict(holds, path < blind), here)


def _sparser(total: dict[Key, float], gaps: list[int]) -> Claim:
    grows = [total[PATH, g] for g in gaps]
    return Claim(
        "The sparser the measurements, the lower the quality.",
        verdict(grows == sorted(grows), grows[-1] > grows[0]),
        f"Errors of the best path in gaps of {', '.join(map(str, gaps))} frames: "
        f"{', '.join(f'{g:.1f}' for g in grows)} degrees.",
    )


def _example(study: Study, walk: Capture) -> Plot:
    T = len(walk.y)
    first, end = (FIRST, END) if T >= END + 10 else (T // 3, T - T // 3)
    hole, shown = slice(first, end), slice(max(first - AROUND, 0), min(end + AROUND, T))
    gappy, offset = measures.gappy(walk.y, hole)
    states, M = viterbi(_model_of(study, walk), gappy).states, walk.y.shape[1]
    mean, sd = states.mean[:, :M], np.sqrt(np.diagonal(states.cov, axis1=-2, axis2=-1))[:, :M]
    y = walk.y - offset
    inside = 100.0 * float((np.abs(mean - y) <= 2.0 * sd)[hole, ANGLES].mean())
    filled = np.full_like(y, np.nan)
    filled[hole] = mean[hole]
    true = as_sequence(walk.name, y[shown], shown.start)
    return Plot(
        lambda file: draw_forecast(true, filled[shown], sd[shown], file, "", "filled"),
        "Angles over a gap: measured, and filled by the SLDS",
        f"The longest walk ({walk.name}), of which frames {first} to {end - 1} were not shown. {inside:.0f} "
        "% of its six hidden angles lie within the band of two sigma (95 % if the band were calibrated).",
    )
