"""Walks with frames missing, filled by the SLDS and by what knows nothing of walking (1999, figure 6)."""

from functools import partial
from itertools import product

import numpy as np

from dynamics.gaussian import Array
from dynamics.slds import SLDS
from dynamics.viterbi import viterbi
from kinematics.mocap import POSE_COLUMNS
from kinematics.mocap import Sequence as Capture
from tracker.experiments import measures
from tracker.experiments.ahead import model
from tracker.experiments.measures import ANGLES, SIDE, Errors, Fill
from tracker.experiments.panels import GREY, INK, grid, legend_below, to_svg
from tracker.experiments.section import (
    Claim,
    Heading,
    Plot,
    Section,
    Table,
    left_out,
    pooled_and_range,
    verdict,
)
from tracker.experiments.study import Study

HEADING = Heading("interpolation", "Frames that are missing", "1999, figure 6")
FIRST, END = 50, 100  # frames missing in the figure
AROUND = 40  # frames of a side that the figure shows
GAPS = (10, 25, 50)
EACH = 2  # captures of a subject, the longest
BETTER = 0.75  # times the error of knowing nothing, at most
LINEAR, SPLINE, PATH = "straight line", "cubic spline", "SLDS, best path"
SHADES = {SPLINE: "#c1272d", PATH: "#0072b2"}
JOINTS = {"hip_near": "near thigh", "knee_near": "near knee", "knee_far": "far knee"}


def run(study: Study) -> Section:
    """Gaps in the middle of the longest walks, and the papers' frames 50 to 100 of the longest of all."""
    walks = _walks(study)
    if not walks:
        return left_out(HEADING, f"no walk is {GAPS[0] + 2 * SIDE} frames long")
    found: dict[tuple[str, int], list[Errors]] = {}
    for walk in study.each(HEADING.key, walks):
        fills = _fills(_model_of(study, walk)).items()
        for gap, (name, fill) in product(GAPS[:2] if study.quick else GAPS, fills):
            if measures.spans(walk.y, gap):
                found.setdefault((name, gap), []).append(measures.gap_errors(fill, walk, gap))
    total = {key: measures.rms(errors) for key, errors in found.items()}
    people = {key: measures.by_person(errors) for key, errors in found.items()}
    gaps = [gap for gap in GAPS if (LINEAR, gap) in total]
    names = (LINEAR, SPLINE, PATH)
    table = Table(
        "Error inside the gap, degrees, root mean square over frames and six angles (least to greatest "
        "over subjects).",
        ("filled by", *(f"{gap} frames" for gap in gaps)),
        tuple((name, *(pooled_and_range(total[name, g], people[name, g]) for g in gaps)) for name in names),
    )
    return Section(
        HEADING,
        "All freedoms of some frames in the middle of a walk are blanked, the rest of it shown, and the "
        f"frames between filled. The {EACH} longest walks of each subject; people were {study.unseen}.",
        (_quality(total, gaps[-1]), *([_sparser(total, gaps)] if len(gaps) > 1 else [])),
        (table,),
        (_example(study, max(walks, key=lambda c: len(c.y))),),
    )


def _walks(study: Study) -> list[Capture]:
    """The longest of each subject that span the least gap."""
    chosen: dict[str, list[Capture]] = {}
    for walk in sorted(study.of("walk"), key=lambda c: -len(c.y)):
        if measures.spans(walk.y, GAPS[0]):
            chosen.setdefault(walk.subject, []).append(walk)
    return [walk for theirs in chosen.values() for walk in theirs[: 1 if study.quick else EACH]]


def _held(study: Study, walk: Capture) -> frozenset[str]:
    """Who is left out of the models that this walk is shown to."""
    return next((fold for fold in study.folds if walk.subject in fold), frozenset[str]())


def _model_of(study: Study, walk: Capture) -> SLDS:
    return study.slds(model(study, _held(study, walk)))


def _fills(slds: SLDS) -> dict[str, Fill]:
    return {
        LINEAR: partial(measures.across, 1),
        SPLINE: partial(measures.across, 3),
        PATH: partial(measures.best_path, slds),
    }


def _quality(total: dict[tuple[str, int], float], gap: int) -> Claim:
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


def _sparser(total: dict[tuple[str, int], float], gaps: list[int]) -> Claim:
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
    hole, slds = slice(first, end), _model_of(study, walk)
    shown, offset = measures.gappy(walk.y, hole)
    states, M = viterbi(slds, shown).states, walk.y.shape[1]
    mean, sd = states.mean[:, :M], np.sqrt(np.diagonal(states.cov, axis1=-2, axis2=-1))[:, :M]
    y = walk.y - offset
    inside = 100.0 * float((np.abs(mean - y) <= 2.0 * sd)[hole, ANGLES].mean())
    lines = {PATH: mean, SPLINE: measures.across(3, shown)}
    return Plot(
        _curves(y, hole, lines, sd),
        "Angles over a gap: measured, true, and filled by the SLDS and a spline",
        f"The longest walk ({walk.name}), frames {first} to {end - 1} missing. {inside:.0f} % of its six "
        "hidden angles lie within the band of two sigma (95 % if the band were calibrated). A spline that "
        "leaves the picture goes on outside it.",
    )


def _curves(y: Array, hole: slice, lines: dict[str, Array], sd: Array) -> str:
    """Three angles about a gap: measured, true, and filled by name, the first with its band of two sigma."""
    figure, axes = grid([1.9] * len(JOINTS))
    frames = np.arange(len(y))
    around = np.r_[max(0, hole.start - AROUND) : hole.start, hole.stop : min(len(y), hole.stop + AROUND)]
    for ax, (column, told) in zip(axes[:, 0], JOINTS.items(), strict=True):
        i = POSE_COLUMNS.index(column)
        true, mean = np.degrees(y[:, i]), np.degrees(next(iter(lines.values()))[hole, i])
        half = 2.0 * np.degrees(sd[hole, i])
        ax.fill_between(
            *(frames[hole], mean - half, mean + half), color=SHADES[PATH], alpha=0.25, lw=0,
            label="its two sigma",
        )  # fmt: skip
        ax.plot(frames[hole], true[hole], ":", color=INK, linewidth=1.8, label="true, hidden")
        ax.plot(around, true[around], "x", color=GREY, markersize=3.5, label="measured")
        low, high = ax.get_ylim()
        for name, line in lines.items():
            ax.plot(frames[hole], np.degrees(line[hole, i]), color=SHADES[name], linewidth=1.6, label=name)
        room = 0.35 * (high - low)
        ax.set(ylabel=f"{told},\ndegrees", ylim=(low - room, high + room))
    axes[-1, 0].set_xlabel("frame")
    legend_below(figure, axes[0, 0], 3)
    return to_svg(figure)
