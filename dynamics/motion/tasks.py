"""Labels and forecasts for sequences of poses by a learned model, and synthesis of motion.

Pavlović et al. (2000), sections 4.1 to 4.3: classification by the switching states, prediction and synthesis.
Filling of gaps is in `dynamics.motion.gaps`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np

from dynamics.frames import Frames, in_batches
from dynamics.gaussian import Array, Gaussian, Ints, apply, collapse, unknown
from dynamics.gpb2 import switching_all
from dynamics.gpb2_filter import filter_steps
from dynamics.hmm import HMM, hmm_all
from dynamics.kalman import predict as step
from dynamics.kalman import update
from dynamics.motion.noise import SEARCHES, among_strangers, at_noise, at_process_noise, wider
from dynamics.posterior import InferSwitching
from dynamics.region import POSE, Regions, drawn, log_switch, pose_hints, pose_regions, regions
from dynamics.slds import SLDS

Tick = Callable[[], None]

CLASSIFY_TICKS = SEARCHES + 1
NOISE_KNOWN = (5, 15, 45, 135)  # frames after which forecasts use the noise measured so far
TOWARDS = 0.3  # weight of a state's region in every step of a forecast; 0.1 to 0.8 do about equally well
PULL = 1.5  # weight of a state's region in every step of synthesis; with much more all strides are equal
INSIDE = 0.995  # share of a state's poses within the distance to which synthesis is confined
LEAST, MOST = 0.1, 1e4  # range of weights searched to stay within that distance


@dataclass(frozen=True)
class Labelling:
    """The motion of each of T frames.

    label  : (T,) the motion
    state  : (T,) the switching state
    labels : the L motions
    prob   : (T, L) probability of each motion; 0 or 1 where the inference gives a path only
    """

    label: tuple[str, ...]
    state: Ints
    labels: tuple[str, ...]
    prob: Array


def classify(
    slds: SLDS,
    ys: Sequence[Array],
    *,
    infer: InferSwitching = switching_all,
    pose: float = POSE,
    tick: Tick = lambda: None,
) -> list[Labelling]:
    """The motion of every frame: the one whose switching states are the most probable together.

    R is raised to the noise of these sequences and for people not learned from, and each pose adds its
    likelihood under the states' regions.

    Args:
        ys: sequences (T, M) in body units; NaN entries were not measured.
        infer: switching_all (GPB2), viterbi_all, variational_all.
        pose: weight of the pose's term; 0 leaves it out, as in the papers.
        tick: called CLASSIFY_TICKS times in all, to show progress.
    """
    found = labelled(at_noise(slds, ys, tick), ys, infer=infer, pose=pose)
    tick()
    return found


def labelled(
    slds: SLDS, ys: Sequence[Array], *, infer: InferSwitching = switching_all, pose: float = POSE
) -> list[Labelling]:
    """Labels like `classify`, but with R raised only for people not learned from, not to the noise."""
    wide = among_strangers(slds)
    hints = [pose_hints(wide, y, pose) for y in ys] if pose > 0 else None
    return [labelling(slds.labels, p.prob, p.path) for p in infer(wide, ys, hints)]


def classify_hmm(hmm: HMM, ys: Sequence[Array]) -> list[Labelling]:
    """Labels of every frame by a hidden Markov model, the papers' baseline."""
    return [labelling(hmm.labels, p.prob, p.path) for p in hmm_all(hmm, ys)]


def labelling(labels: tuple[str, ...], prob: Array, path: Ints) -> Labelling:
    """A Labelling from the labels of the K states, their probabilities (T, K) and the path (T,)."""
    motions = tuple(dict.fromkeys(labels))
    belongs = np.array([[label == motion for motion in motions] for label in labels], dtype=float)
    shares = prob @ belongs
    return Labelling(tuple(motions[i] for i in shares.argmax(1)), path, motions, shares)


def predict(slds: SLDS, ys: Sequence[Array], horizon: int = 1, tick: Tick = lambda: None) -> list[Gaussian]:
    """Forecasts `horizon` frames ahead by the GPB2 filter: one Gaussian a switching state, collapsed.

    The switch depends on the pose, and every step is drawn towards the region of its state, widened for
    people who were not learned from (`dynamics.region`). R is raised and Q scaled to the noise of the frames
    so far, again after each of NOISE_KNOWN frames of the sequences (T, M) in body units; NaN entries were not
    measured. `tick` is called `predict_ticks(ys)` times.

    Returns:
        For each sequence mean (T + horizon, M) and cov of the pose without measurement noise: entry t from
        the frames up to t - horizon. The first `horizon` entries, which have no such frames, are NaN.
    """
    own = drawn(wider(slds), TOWARDS)
    found = [unknown(len(y) + horizon, len(slds.names)) for y in ys]
    for known, until in pairwise([0, *_edges(ys), max(map(len, ys), default=0)]):
        longer = [i for i, y in enumerate(ys) if len(y) > known]
        before = [y[:known] for y in ys]
        fitted = at_process_noise(at_noise(own, before, tick), before, tick) if known else own
        later = forecasts(fitted, [ys[i][:until] for i in longer], horizon, recurrent=True, first=known)
        tick()
        for i, ahead in zip(longer, later, strict=True):
            rows = slice(known + horizon, len(ahead.mean))
            found[i][rows] = ahead[rows]
    return found


def predict_ticks(ys: Sequence[Array]) -> int:
    """How many times `predict` calls its `tick` for these sequences."""
    return 1 + len(_edges(ys)) * (SEARCHES + 2)


def forecasts(
    slds: SLDS, ys: Sequence[Array], horizon: int = 1, *, recurrent: bool = False, first: int = 0
) -> list[Gaussian]:
    """Forecasts of the GPB2 filter `horizon` frames ahead with an unchanged model; otherwise as `predict`.

    Args:
        recurrent: the switch depends on the pose; if not it is the papers'.
        first: forecasts from earlier frames than this are skipped, which saves time.
    """
    switch = partial(log_switch, slds, regions(slds), weight=POSE) if recurrent else None

    def infer(frames: Frames) -> list[Gaussian]:
        found = unknown(len(frames.y), len(slds.names))
        for now in filter_steps(slds, frames, switch):
            if now.rows.stop <= frames.first[min(first, len(frames.first) - 1)]:
                continue
            prob, states = np.exp(now.log_prob), now.states
            for _ in range(horizon):
                log_Pi = slds.log_Pi if switch is None else switch(states.mean)
                prob, states = _switched(slds, prob[:, :, None] * np.exp(log_Pi), states)
            found[now.rows] = collapse(prob, states).through(slds.C)
        return [_later(found[rows], horizon) for rows in frames.sequences()]

    return in_batches(slds, ys, None, infer)


def synthesise(slds: SLDS, T: int, rng: np.random.Generator, *, recurrent: bool = True) -> tuple[Ints, Array]:
    """A motion sampled from the model: switching states (T,) and poses (T, M) without measurement noise.

    If `recurrent` the switch depends on the pose, and every step is weighted by the region of its state
    (`dynamics.region`); otherwise it is the papers' model, whose samples soon leave the range of the motion.
    """
    from scipy.special import chdtri  # slow to import; labels of tracked motion do not need it

    reach, poses, log_Pi = regions(slds), pose_regions(slds), slds.log_Pi
    limit = float(chdtri(len(poses.regard), 1.0 - INSIDE))
    s = np.empty(T, dtype=np.intp)
    x = np.empty((T, slds.A.shape[-1]))
    for t in range(T):
        if t == 0:
            k = s[0] = rng.choice(slds.K, p=slds.pi0)
            following = slds.start[k]
        else:
            ahead = apply(slds.A, x[t - 1]) + slds.b
            log_p = log_Pi[s[t - 1]] + (reach.log_density(ahead) if recurrent else 0.0)
            p = np.exp(log_p - log_p.max())
            k = s[t] = rng.choice(slds.K, p=p / p.sum())
            following = Gaussian(ahead[k], slds.Q[k])
            if recurrent:
                near, _ = update(following, reach.mean[k], reach.regard, reach.cov[k] / PULL)
                following = _kept_in(near, poses, k, limit)
        x[t] = rng.multivariate_normal(following.mean, following.cov, method="svd", check_valid="ignore")
    return s, apply(slds.C, x)


def _edges(ys: Sequence[Array]) -> list[int]:
    """Frames after which the noise of these sequences is measured again."""
    longest = max(map(len, ys), default=0)
    return [known for known in NOISE_KNOWN if known < longest]


def _kept_in(following: Gaussian, poses: Regions, k: int, limit: float) -> Gaussian:
    """The next state, drawn towards the poses of state k just far enough to lie within their limit."""
    weight, near = LEAST, following
    while poses.distance(near.mean)[k] > limit and weight < MOST:
        near, _ = update(following, poses.mean[k], poses.regard, poses.cov[k] / weight)
        weight *= 2.0
    return near


def _later(found: Gaussian, frames: int) -> Gaussian:
    """Gaussians of frames moved so many frames later; the first ones become unknown."""
    T, M = found.mean.shape
    later = unknown(T + frames, M)
    later[frames:] = found
    return later


def _switched(slds: SLDS, joint: Array, states: Gaussian) -> tuple[Array, Gaussian]:
    """One step without a measurement: Pr(s) (T, K), and x given each s, collapsed over the state before.

    joint (T, K, K) is the probability of each state before and now. All pairs that lead to a state move by
    the dynamics of that state, so collapsing before the step gives the same as after it.
    """
    later: Array = joint.sum(1)
    weights = np.where(later[:, None] > 0, joint / np.maximum(later, 1e-300)[:, None], 1.0 / slds.K)
    come = collapse(np.swapaxes(weights, 1, 2), states[:, None])
    return later, step(come, slds.A, slds.b, slds.Q)
