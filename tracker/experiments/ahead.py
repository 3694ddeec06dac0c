"""Forecasts of people left out, against constant velocity at its best and the hidden Markov model."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import chain, product

import numpy as np
from scipy.stats import multivariate_normal

from dynamics.gaussian import Array
from dynamics.hmm import HMM
from dynamics.motion.tasks import forecasts, predict
from dynamics.slds import SLDS, constant_velocity
from kinematics.mocap import POSE_COLUMNS
from kinematics.mocap import Sequence as Capture
from tracker.experiments.panels import grid, to_svg
from tracker.experiments.section import Claim, Plot, Section, Table, share_verdict, spread
from tracker.experiments.study import ANGLES, FPS, Recipe, Study, centred, noisy, rmse, six_angles

KEY, TITLE, SOURCE = "prediction", "Where next?", "2000, section 1; 1999, section 4.2"
NOISE = 2.0  # degrees
HORIZONS = (1, 2, 5, 10)
CHANGES = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0)  # degrees a frame a frame, of the Kalman filter
MEASURED = (0.5, 1.0, 2.0, 4.0, 8.0)  # degrees
FIRST_SPEED = 4.0  # degrees a frame
HIDDEN = 4  # states a motion of the hidden Markov model
COST = 10  # of forecasts for all horizons, beside learning
NAMES = {"slds": "SLDS", "kalman": "constant velocity", "hmm": "hidden Markov model"}
SHADES = {"slds": "#0072b2", "kalman": "#c1272d", "hmm": "#009e73"}

Errors = dict[str, dict[tuple[str, int], dict[str, list[Array]]]]


def recipes(study: Study) -> list[Recipe]:
    """Learned at the noise that is met, each without a group of subjects."""
    return [
        recipe
        for held in study.held_out
        for recipe in (model(study, held), Recipe(HIDDEN, 0, NOISE, held, study.motions))
    ]


def model(study: Study, held: frozenset[str]) -> Recipe:
    """The usual model at this noise."""
    usual = Recipe(noise=NOISE, held=held, motions=study.motions)
    return replace(usual, states=2) if study.quick else usual


def cost(study: Study) -> int:
    """For progress."""
    return len(_horizons(study)) * COST * (len(study.held_out) + 1)


def run(study: Study) -> Section:
    """Errors of every capture by the model that was learned without its subject."""
    found = _errors(study)
    keys = [(motion, h) for motion in study.motions for h in _horizons(study)]
    chosen = {}
    for motion, h in study.each(keys, COST // len(study.motions)):
        best, chosen[motion, h] = best_rival(study.of(motion), h, study.seed, study.quick)
        found["kalman"][motion, h] = best
    total = {name: {key: rmse(pooled(by)) for key, by in rows.items()} for name, rows in found.items()}
    people = {
        name: {key: {who: rmse(errors) for who, errors in by.items()} for key, by in rows.items()}
        for name, rows in found.items()
    }
    rows = tuple(
        (f"{motion}, {h} frame{'s' if h > 1 else ''}",
         *(spread_of(total[name][motion, h], people[name][motion, h]) for name in NAMES),
         f"{100.0 * (1.0 - total['slds'][motion, h] / total['kalman'][motion, h]):.0f} %")
        for motion, h in keys
    )  # fmt: skip
    table = Table(
        "Error of the forecast angles, degrees, root mean square over frames and six angles (least to "
        "greatest over subjects). Constant velocity by its best noise for that motion and horizon, chosen "
        "on these very errors.",
        ("motion, ahead", *NAMES.values(), "SLDS under constant velocity"),
        rows,
    )
    whom = "left out in learning" if study.folds else "also learned from, as there are too few to leave out"
    return Section(
        KEY,
        TITLE,
        SOURCE,
        f"The six angles of every capture with {NOISE:g} degrees of white noise; the clean angles up to "
        f"{max(_horizons(study))} frames ahead are forecast from the noisy ones up to now. People were "
        f"{whom}. The SLDS (second order, GPB2 filter) has the states a motion that learning uses by "
        f"default; the hidden Markov model has {HIDDEN}.",
        (_against(total, "kalman"), _against(total, "hmm")),
        (table,),
        (_plot(people, total, study.motions),),
        {
            "rmse_degrees": {
                name: {
                    f"{m}+{h}": {"all": total[name][m, h], "subjects": people[name][m, h]} for m, h in keys
                }
                for name in NAMES
            },
            "kalman_noise_degrees": {f"{m}+{h}": noises for (m, h), noises in chosen.items()},
        },
    )


def shown(captures: Sequence[Capture], seed: int) -> list[Array]:
    """The six angles as measured; the same noise for whoever asks."""
    rngs = [np.random.default_rng([seed, 3, *c.name.encode()]) for c in captures]
    return [noisy(six_angles(c.y), NOISE, rng) for c, rng in zip(captures, rngs, strict=True)]


def best_rival(
    captures: Sequence[Capture], horizon: int, seed: int, quick: bool = False
) -> tuple[dict[str, list[Array]], tuple[float, float]]:
    """Errors by subject of constant velocity at the noises (change, measured) that make them least."""
    ys = shown(captures, seed)
    noises = list(product(CHANGES, MEASURED))[:: 5 if quick else 1]
    tried = [_by_subject(captures, [f.mean for f in forecasts(rival(*pair), ys, horizon)]) for pair in noises]
    best = int(np.argmin([rmse(pooled(errors)) for errors in tried]))
    return tried[best], noises[best]


def rival(change: float, measured: float) -> SLDS:
    """Constant velocity at noises in degrees: change of speed a frame, and what is measured."""
    M = len(POSE_COLUMNS)
    slds = constant_velocity(
        POSE_COLUMNS, np.full(M, np.radians(change)), np.full(M, np.radians(FIRST_SPEED)), FPS
    )
    return replace(slds, R=np.radians(measured) ** 2 * np.eye(M))


def hmm_forecast(hmm: HMM, y: Array, horizon: int) -> Array:
    """(T + horizon, M) mean of the pose from the frames up to t - horizon; NaN where there are none."""
    liks = np.stack(
        [multivariate_normal(m, c).logpdf(y) for m, c in zip(hmm.mean, hmm.cov, strict=True)], axis=-1
    )
    ahead, prob = np.linalg.matrix_power(hmm.Pi, horizon), hmm.pi0
    means = np.full((len(y) + horizon, y.shape[1]), np.nan)
    for t, lik in enumerate(liks):
        prior = prob if t == 0 else prob @ hmm.Pi
        prob = prior * np.exp(lik - lik.max())
        prob = prob / prob.sum()
        means[t + horizon] = prob @ ahead @ hmm.mean
    return means


def pooled(by_subject: Mapping[str, Iterable[Array]]) -> list[Array]:
    """Everybody's errors."""
    return list(chain.from_iterable(by_subject.values()))


def spread_of(total: float, people: dict[str, float]) -> str:
    """The pooled error, and the range over subjects if there are several."""
    several = spread(list(people.values())).partition(" ")[2]
    return f"{total:.1f} {several}".strip()


def _errors(study: Study) -> Errors:
    found: Errors = {name: {} for name in NAMES}
    for held in study.held_out:
        slds, hmm = study.slds(model(study, held)), study.hmm(Recipe(HIDDEN, 0, NOISE, held, study.motions))
        captures = study.tested(held)
        ys = shown(captures, study.seed)
        for h in study.each(_horizons(study), COST):
            answers = {
                "slds": [f.mean for f in predict(slds, ys, h)],
                "hmm": [
                    np.hstack([np.zeros((len(y) + h, 2)), hmm_forecast(hmm, y[:, ANGLES], h)]) for y in ys
                ],
            }
            for (name, means), motion in product(answers.items(), study.motions):
                of = [n for n, c in enumerate(captures) if c.label == motion]
                errors = _by_subject([captures[n] for n in of], [means[n] for n in of])
                found[name].setdefault((motion, h), {}).update(errors)
    return found


def _by_subject(captures: Sequence[Capture], means: Sequence[Array]) -> dict[str, list[Array]]:
    errors: dict[str, list[Array]] = {}
    for c, mean in zip(captures, means, strict=True):
        apart = (mean[: len(c.y)] - centred(c.y))[:, ANGLES]
        # No frame before another's horizon is forecast; all horizons are judged on the same frames.
        errors.setdefault(c.subject, []).append(apart[_first(c) :])
    return errors


def _first(capture: Capture) -> int:
    return min(max(HORIZONS), len(capture.y) - 1)


def _horizons(study: Study) -> tuple[int, ...]:
    return HORIZONS[:1] if study.quick else HORIZONS


def _against(total: dict[str, dict[tuple[str, int], float]], rival: str) -> Claim:
    gains = {key: 100.0 * (1.0 - e / total[rival][key]) for key, e in total["slds"].items()}
    least, most = min(gains, key=lambda k: gains[k]), max(gains, key=lambda k: gains[k])
    papers = {
        "kalman": "A learned SLDS predicts better than constant velocity (there: its tracker lasts longer).",
        "hmm": "The SLDS consistently outperforms the hidden Markov model in one-step prediction.",
    }
    judged = {key: g for key, g in gains.items() if rival == "kalman" or key[1] == 1}
    here = f"Its error is lower in {sum(g > 0 for g in judged.values())} of {len(judged)} cases"
    here += "." if rival == "kalman" else " one frame ahead."
    here += f" Over all horizons from {_less(gains[most])} ({_told(most)}) "
    here += f"to {_less(gains[least])} ({_told(least)})."
    return Claim(papers[rival], share_verdict(float(np.mean([g > 0 for g in judged.values()]))), here)


def _less(gain: float) -> str:
    return f"{abs(gain):.0f} % {'less' if gain >= 0 else 'more'}"


def _told(key: tuple[str, int]) -> str:
    return f"{key[0]}, {key[1]} frame{'s' if key[1] > 1 else ''} ahead"


def _plot(
    people: dict[str, dict[tuple[str, int], dict[str, float]]],
    total: dict[str, dict[tuple[str, int], float]],
    motions: Sequence[str],
) -> Plot:
    figure, axes = grid([3.0], len(motions), share_x=False)
    for ax, motion in zip(axes[0], motions, strict=True):
        top = 0.0
        for n, (name, told) in enumerate(NAMES.items()):
            horizons = [h for m, h in total[name] if m == motion]
            x = np.array(horizons) + 0.12 * (n - 1)
            each = [list(people[name][motion, h].values()) for h in horizons]
            top = max(top, *(max(e) for e in each))
            ax.vlines(x, [min(e) for e in each], [max(e) for e in each], color=SHADES[name], linewidth=1.2)
            ax.plot(
                x,
                [total[name][motion, h] for h in horizons],
                "o-",
                color=SHADES[name],
                label=told,
                markersize=4,
            )
        ax.set(title=motion, xlabel="frames ahead (30 a second)", xticks=horizons)
        ax.set_ylim(0, 1.1 * top)
    axes[0, 0].set_ylabel("error, degrees")
    handles, names = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=3, frameon=False)
    return Plot(
        to_svg(figure),
        "Error of forecasts by frames ahead for the SLDS, constant velocity and the hidden Markov model",
        "Lines reach from the easiest to the hardest subject.",
    )
