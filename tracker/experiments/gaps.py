"""Walks with frames missing, filled by the SLDS and by what knows nothing of walking (1999, figure 6)."""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from scipy.interpolate import CubicSpline, interp1d

from dynamics.gaussian import Array
from dynamics.motion.gaps import interpolate
from dynamics.slds import SLDS
from dynamics.viterbi import viterbi
from kinematics.mocap import POSE_COLUMNS
from kinematics.mocap import Sequence as Capture
from tracker.experiments.ahead import model, pooled, spread_of
from tracker.experiments.panels import GREY, INK, figures, grid, to_svg
from tracker.experiments.section import Claim, Plot, Section, Table, Verdict, left_out
from tracker.experiments.study import ANGLES, FPS, NECK, Recipe, Study, rmse

KEY, TITLE, SOURCE = "interpolation", "Frames that are missing", "1999, figure 6"
FIRST, END = 50, 100  # frames missing in the figure
SIDE = 10  # frames that must be left on each side
MOST = 40  # frames of a side that are shown to the model
GAPS = (10, 25, 50)
EACH = 2  # captures of a subject, the longest
COST = 4  # of filling one capture's gaps, beside learning
LINEAR, SPLINE, PATH, SAMPLED = (
    "straight line",
    "cubic spline",
    "SLDS, best path (papers)",
    "SLDS, sampled paths *",
)
SHADES = {SPLINE: "#c1272d", PATH: "#009e73", SAMPLED: "#0072b2"}

Fill = Callable[[Array], Array]


def recipes(study: Study) -> list[Recipe]:
    """Those of prediction."""
    return [model(study, held) for held in study.held_out] if _walks(study) else []


def cost(study: Study) -> int:
    """For progress."""
    return COST * (len(_walks(study)) + 1)


def run(study: Study) -> Section:
    """Gaps in the middle of the longest walks, and the papers' frames 50 to 100 of the longest of all."""
    walks = _walks(study)
    if not walks:
        return left_out(KEY, TITLE, SOURCE, f"no walk is {GAPS[0] + 2 * SIDE} frames long")
    errors: dict[tuple[str, int], dict[str, list[Array]]] = {}
    for walk in study.each(walks, COST):
        for gap in GAPS[:2] if study.quick else GAPS:
            if len(walk.y) < gap + 2 * SIDE:
                continue
            y, hole = cut_middle(walk.y, gap)
            for name, fill in _fills(_model_of(study, walk), study).items():
                apart = (fill(blanked(y, hole))[hole] - y[hole])[:, ANGLES]
                errors.setdefault((name, gap), {}).setdefault(walk.subject, []).append(apart)
    total = {key: rmse(pooled(by)) for key, by in errors.items()}
    people = {key: {who: rmse(found) for who, found in by.items()} for key, by in errors.items()}
    gaps = [gap for gap in GAPS if (LINEAR, gap) in total]
    names = (LINEAR, SPLINE, PATH, SAMPLED)
    table = Table(
        "Error inside the gap, degrees, root mean square over frames and six angles (least to greatest "
        "over subjects). * Not in the papers: switching paths are sampled, and the switch depends on the "
        "pose.",
        ("filled by", *(f"{gap} frames" for gap in gaps)),
        tuple((name, *(spread_of(total[name, g], people[name, g]) for g in gaps)) for name in names),
    )
    plots, inside = _example(study, max(walks, key=lambda c: len(c.y)))
    study.spend(COST)
    whom = "left out in learning" if study.folds else "also learned from, as there are too few to leave out"
    return Section(
        KEY,
        TITLE,
        SOURCE,
        f"All freedoms of some frames in the middle of a walk are blanked, up to {MOST} frames on each "
        f"side shown, and the frames between filled. The {EACH} longest walks of each subject; people were "
        f"{whom}.",
        tuple(_claims(total, gaps)),
        (table,),
        plots,
        {
            "rmse_degrees": {
                name: {str(g): {"all": total[name, g], "subjects": people[name, g]} for g in gaps}
                for name in names
            },
            "example_true_angles_within_band_percent": inside,
        },
    )


def cut_middle(y: Array, gap: int) -> tuple[Array, slice]:
    """The middle of a walk and where its gap is."""
    first = (len(y) - gap) // 2
    start = max(0, first - MOST)
    return y[start : first + gap + MOST], slice(first - start, first - start + gap)


def blanked(y: Array, hole: slice) -> Array:
    """Without the frames of the gap."""
    gappy = y.copy()
    gappy[hole] = np.nan
    return gappy


def straight(y: Array) -> Array:
    """Straight lines across."""
    t = np.flatnonzero(~np.isnan(y).any(1))
    return np.asarray(interp1d(t, y[t], axis=0)(np.arange(len(y))))


def spline(y: Array) -> Array:
    """A cubic spline through everything measured."""
    t = np.flatnonzero(~np.isnan(y).any(1))
    return np.asarray(CubicSpline(t, y[t])(np.arange(len(y))))


def _walks(study: Study) -> list[Capture]:
    long = sorted((c for c in study.of("walk") if len(c.y) >= GAPS[0] + 2 * SIDE), key=lambda c: -len(c.y))
    chosen: dict[str, list[Capture]] = {}
    for walk in long:
        chosen.setdefault(walk.subject, []).append(walk)
    return [walk for theirs in chosen.values() for walk in theirs[: 1 if study.quick else EACH]]


def _model_of(study: Study, walk: Capture) -> SLDS:
    held = next((fold for fold in study.folds if walk.subject in fold), frozenset[str]())
    return study.slds(model(study, held))


def _fills(slds: SLDS, study: Study) -> dict[str, Fill]:
    return {
        LINEAR: straight,
        SPLINE: spline,
        PATH: partial(_neckless, lambda y: viterbi(slds, y).states.mean[:, : y.shape[1]]),
        SAMPLED: partial(_neckless, lambda y: interpolate(slds, y, study.rng(5)).mean),
    }


def _neckless(fill: Fill, y: Array) -> Array:
    """What the model knows filled, and the rest put back."""
    offset = _unknown(y)
    return np.asarray(fill(y - offset) + offset)


def _unknown(y: Array) -> Array:
    """What no model knows: where the root was first, and the neck's mean over what is measured."""
    offset = np.zeros(len(POSE_COLUMNS))
    offset[NECK], offset[:2] = np.nanmean(y[:, NECK]), y[0, :2]
    return offset


def _claims(total: dict[tuple[str, int], float], gaps: Sequence[int]) -> list[Claim]:
    longest = gaps[-1]
    blind = min(total[LINEAR, longest], total[SPLINE, longest])
    path, sampled = total[PATH, longest], total[SAMPLED, longest]
    verdict = (
        Verdict.HOLDS if path < 0.75 * blind else Verdict.PARTLY if sampled < 0.75 * blind else Verdict.FAILS
    )
    here = (
        f"In gaps of {longest} frames the best path errs by {path:.1f} degrees, sampled paths with a "
        f"switch by the pose by {sampled:.1f}, the better of line and spline by {blind:.1f}. "
    )
    if verdict is Verdict.PARTLY:
        here += "The papers' own inference lets the gait stop in a long gap: only Pi speaks there."
    elif verdict is Verdict.FAILS:
        here += "Neither is much better than knowing nothing of walking."
    else:
        here += "The learned walk carries on through the gap."
    claims = [Claim("The quality of the frames filled in was high (judged by eye).", verdict, here)]
    if len(gaps) > 1:
        method = PATH if path <= sampled else SAMPLED
        grows = [total[method, g] for g in gaps]
        claims.append(
            Claim(
                "The sparser the measurements, the lower the quality.",
                Verdict.HOLDS
                if grows == sorted(grows)
                else Verdict.PARTLY
                if grows[-1] > grows[0]
                else Verdict.FAILS,
                f"Errors of the better of the two in gaps of {', '.join(map(str, gaps))} frames: "
                f"{', '.join(f'{g:.1f}' for g in grows)} degrees.",
            )
        )
    return claims


def _example(study: Study, walk: Capture) -> tuple[tuple[Plot, ...], float]:
    """The papers' figure on the longest walk, and the per cent of its hidden angles within two sigma."""
    T = len(walk.y)
    first, end = (FIRST, END) if T >= END + SIDE else (T // 3, T - T // 3)
    start, stop = max(0, first - MOST), min(T, end + MOST)
    y, hole = walk.y[start:stop], slice(first - start, end - start)
    gappy, slds = blanked(y, hole), _model_of(study, walk)
    offset = _unknown(gappy)
    filled = interpolate(slds, gappy - offset, study.rng(5))
    mean, sd = filled.mean + offset, np.sqrt(np.diagonal(filled.cov, axis1=-2, axis2=-1))
    inside = 100.0 * float((np.abs(mean - y) <= 2.0 * sd)[hole, ANGLES].mean())
    others = {name: fill(gappy) for name, fill in _fills(slds, study).items() if name in (SPLINE, PATH)}
    joints = {"hip_near": "near thigh", "knee_near": "near knee", "knee_far": "far knee"}
    figure, axes = grid([1.9] * len(joints))
    frames = np.arange(start, stop)
    for ax, (column, told) in zip(axes[:, 0], joints.items(), strict=True):
        i = POSE_COLUMNS.index(column)
        centre, half = np.degrees(mean[:, i]), 2.0 * np.degrees(sd[:, i])
        band = (centre - half)[hole], (centre + half)[hole]
        ax.fill_between(frames[hole], *band, color=SHADES[SAMPLED], alpha=0.25, lw=0, label="its two sigma")
        ax.plot(frames[hole], np.degrees(y[hole, i]), ":", color=INK, linewidth=1.8, label="true, hidden")
        ax.plot(frames, np.degrees(gappy[:, i]), "x", color=GREY, markersize=3.5, label="measured")
        low, high = ax.get_ylim()
        for name, line in {SAMPLED: mean, **others}.items():
            ax.plot(
                frames[hole],
                np.degrees(line[hole, i]),
                color=SHADES[name],
                linewidth=1.6,
                label=name.rstrip(" *"),
            )
        room = 0.35 * (high - low)
        ax.set(ylabel=f"{told},\ndegrees", ylim=(low - room, high + room))
    axes[-1, 0].set_xlabel("frame")
    handles, names = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=3, frameon=False)
    curves = Plot(
        to_svg(figure),
        "Angles over a gap: measured, true, and filled by the SLDS and a spline",
        f"The longest walk ({walk.name}), frames {first} to {end - 1} missing. {inside:.0f} % of its six "
        "hidden angles lie within the band of two sigma (95 % if the band were calibrated). A spline that "
        "leaves the picture goes on outside it.",
    )
    figure, axes = grid([1.5, 1.5])
    for ax, poses, told in zip(axes[:, 0], (mean, y), ("Filled by sampled paths", "True"), strict=True):
        figures(ax, poses[hole], 4, FPS, first)
        ax.set_title(told, loc="left")
    sticks = Plot(
        to_svg(figure), "Stick figures in the gap, filled and true", "Every fourth frame of the gap."
    )
    return (curves, sticks), inside
