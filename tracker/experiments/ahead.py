"""Forecasts of people left out, against constant velocity at its best and the hidden Markov model."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from itertools import product

import numpy as np

from dynamics.gaussian import Array
from dynamics.hmm import HMM, log_likelihoods
from dynamics.motion.tasks import predict
from kinematics.mocap import Sequence as Capture
from tracker.experiments import measures
from tracker.experiments.measures import NOISES, Errors, noisy
from tracker.experiments.section import Claim, Heading, Section, Table, left_out, share_verdict
from tracker.experiments.study import Recipe, Study
from tracker.models.centred import ANGLES, centred, rootless
from tracker.models.learn import STATES
from tracker.progress import counted

HEADING = Heading("prediction", "Where next?", "2000, section 1; 1999, section 4.2")
NOISE = 2.0  # noise added to angles, degrees
HORIZONS = (1, 2, 5, 10)
FIRST = max(HORIZONS)  # first frame with forecasts at all horizons, which are compared from there
HIDDEN = 4  # states of the hidden Markov model for each motion
NAMES = {"slds": "SLDS", "kalman": "constant velocity", "hmm": "hidden Markov model"}

Key = tuple[str, int]  # motion and horizon
Found = Mapping[str, Mapping[Key, list[Errors]]]
Total = Mapping[str, Mapping[Key, float]]


def model(study: Study, held: frozenset[str]) -> Recipe:
    """The recipe of the compared models: the usual one, without the subjects held out."""
    return Recipe(2 if study.quick else STATES, noise=NOISE, held=held, motions=study.motions)


def run(study: Study) -> Section:
    """Errors of every capture by the model that was learned without its subject."""
    long = {motion: [len(c.y) > FIRST for c in study.of(motion)] for motion in study.motions}
    judged = [motion for motion in long if any(long[motion])]
    if not judged:
        return left_out(HEADING, f"no capture is longer than {FIRST} frames")
    short = sum(not each for motion in judged for each in long[motion])
    keys = list(product(judged, HORIZONS[:1] if study.quick else HORIZONS))
    found = _errors(study, keys)
    total = {name: {key: measures.rms(found[name][key]) for key in keys} for name in NAMES}
    table = Table(
        "Error of the forecast angles, degrees, root mean square over frames and six angles (least to "
        "greatest over subjects). Constant velocity by its best noise for that motion and horizon, chosen "
        "on these very errors.",
        ("motion, ahead", *NAMES.values(), "SLDS under constant velocity"),
        [
            (
                _told(key).removesuffix(" ahead"),
                *(measures.in_words(found[name][key]) for name in NAMES),
                f"{_gain(total, key, 'kalman'):.0f} %",
            )
            for key in keys
        ],
    )
    return Section(
        HEADING,
        f"The six angles of every capture with {NOISE:g} degrees of white noise; the clean angles up to "
        f"{counted(keys[-1][1], 'frame')} ahead are forecast from the noisy ones up to now. People were "
        f"{study.unseen}. The SLDS (second order, GPB2 filter, switch by the pose) has the "
        f"states a motion that learning uses by default; the hidden Markov model has {HIDDEN}."
        + (f" Captures of {FIRST} frames or fewer are not judged; there are {short}." if short else ""),
        [_against(total, "kalman"), _against(total, "hmm")],
        [table],
    )


def shown(study: Study, captures: Sequence[Capture]) -> list[Array]:
    """The six angles with measurement noise, the same for every model."""
    return [noisy(rootless(centred(c.y)), NOISE, study.rng(3, *c.name.encode())) for c in captures]


def hmm_forecast(hmm: HMM, y: Array, horizon: int) -> Array:
    """(T + horizon, M) mean of the pose from the frames up to t - horizon; NaN where there are none."""
    ahead, prob = np.linalg.matrix_power(hmm.Pi, horizon), hmm.pi0
    means = np.full((len(y) + horizon, y.shape[1]), np.nan)
    for t, log_lik in enumerate(log_likelihoods(hmm, y)):
        prior = prob if t == 0 else prob @ hmm.Pi
        prob = prior * np.exp(log_lik - log_lik.max())
        prob = prob / prob.sum()
        means[t + horizon] = prob @ ahead @ hmm.mean
    return means


def _errors(study: Study, keys: Sequence[Key]) -> Found:
    found: dict[str, dict[Key, list[Errors]]] = {name: defaultdict(list) for name in NAMES}
    for held, (motion, h) in study.each(HEADING.key, list(product(study.held_out, keys))):
        slds = study.slds(model(study, held))
        hmm = study.hmm(Recipe(HIDDEN, 0, NOISE, held, study.motions))
        captures = [c for c in study.tested(held) if c.label == motion]
        ys = shown(study, captures)
        means = {
            "slds": [f.mean for f in predict(slds, ys, h)],
            "hmm": [np.pad(hmm_forecast(hmm, y[:, ANGLES], h), ((0, 0), (2, 0))) for y in ys],
        }
        for name in means:
            found[name][motion, h] += measures.forecast_errors(captures, means[name], FIRST)
    for motion, h in study.each("constant velocity", keys):
        captures, noises = study.of(motion), NOISES[:: 10 if study.quick else 1]
        tried = measures.rival_errors(captures, shown(study, captures), h, FIRST, noises)
        found["kalman"][motion, h] = min(tried.values(), key=measures.rms)
    return found


def _gain(total: Total, key: Key, rival: str) -> float:
    """Decrease of the error from a rival to the SLDS, per cent of the rival's."""
    return 100.0 * (1.0 - total["slds"][key] / total[rival][key])


def _against(total: Total, rival: str) -> Claim:
    gains = {key: _gain(total, key, rival) for key in total["slds"]}
    least, most = min(gains, key=lambda k: gains[k]), max(gains, key=lambda k: gains[k])
    papers = {
        "kalman": "A learned SLDS predicts better than constant velocity (there: its tracker lasts longer).",
        "hmm": "The SLDS consistently outperforms the hidden Markov model in one-step prediction.",
    }
    judged = [gain > 0 for key, gain in gains.items() if rival == "kalman" or key[1] == 1]
    return Claim(
        papers[rival],
        share_verdict(judged),
        f"Its error is lower in {sum(judged)} of {len(judged)} cases"
        f"{'' if rival == 'kalman' else ' one frame ahead'}. Over all horizons from {_less(gains[most])} "
        f"({_told(most)}) to {_less(gains[least])} ({_told(least)}).",
    )


def _less(gain: float) -> str:
    return f"{abs(gain):.0f} % {'less' if gain >= 0 else 'more'}"


def _told(key: Key) -> str:
    return f"{key[0]}, {counted(key[1], 'frame')} ahead"
