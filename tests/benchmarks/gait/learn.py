"""Learn tracker/gait/moments.npz from captures, for `make models`.

    python -m tests.benchmarks.gait.learn TRIALS OUT.npz --licence CMU --licence "Seoul National"

Every capture is shown by figures of several people's lengths, either leg near, at several frame rates, under
errors as tracks have them. What weights leave of a person is told by those learned from everybody else: of
each capture what its moments share, and what they differ by, without the errors of tracks, whose own part is
known where moments are told; every person counts alike.
"""

import argparse
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from kinematics.figure import Figure
from kinematics.figure_file import load_figure
from kinematics.mocap import MotionError, Trial, read_trials
from kinematics.sides import SIDES, Side
from tests.benchmarks.gait.truth import contacts
from tests.benchmarks.rendered.captures import GAITS, RATE, Motion, gait_of, motions
from tests.tracker.strolls import track_of
from tracker.gait.moments import OFF, STRIKE, Way, Weights, named, sampling
from tracker.run.track import Track
from tracker.scene.steps import Array, Build, Gait, random_build

WALKER = load_figure("walker")
FPS = (24.0, 25.0, 30.0, 50.0, 60.0)
SHORTEST = 1.0  # seconds of a capture
NOISE, GRAIN, TOGETHER = 1.3, 0.4, 0.08  # degrees of slow and of quick error; seconds that errors go together
ANGLES = [WALKER.freedoms.index(f"{joint}_{side}") for joint in ("hip", "knee", "ankle") for side in SIDES]
NEAR = 0.2  # of a stride, from a turn to its moment at most
RIDGE = 1e-4


@dataclass(frozen=True)
class Case:
    """One moment of a capture: late by this share of a stride, where the ways are x (C, W), `true` without
    the errors of a track."""

    subject: str
    capture: str
    licence: str
    late: float
    x: Array
    true: Array


def main() -> None:
    """Learn and write; captures of other licences tell the errors only."""
    asked = arguments("learn", __doc__)
    learned = learn(captures(read_trials(asked.trials)), asked.licence)
    np.savez(
        asked.out, **{n: np.array([w.base, w.error, w.shared, *w.w.ravel()]) for n, w in learned.items()}
    )


def arguments(program: str, about: str | None) -> argparse.Namespace:
    """What a program that learns from captures is asked: trials, out and licences."""
    parser = argparse.ArgumentParser(prog=f"python -m tests.benchmarks.gait.{program}", description=about)
    parser.add_argument("trials", type=Path, help="table of captures")
    parser.add_argument("out", type=Path, help="what is learned, .npz")
    parser.add_argument("--licence", action="append", default=[], help="word of a licence to learn from")
    return parser.parse_args()


def captures(trials: Iterable[Trial]) -> list[tuple[str, Motion]]:
    """Licence and motion of every capture of a walk or run."""
    found = []
    for trial in trials:
        if trial.activity in GAITS:
            try:
                found += [(trial.licence, motion) for motion in motions(trial)]
            except MotionError:  # a capture without the joints of a foot
                continue
    return [(licence, motion) for licence, motion in found if motion.seconds >= SHORTEST]


def learn(shown: Sequence[tuple[str, Motion]], licences: Sequence[str]) -> dict[str, Weights]:
    """Weights of every kind of moment.

    Args:
        licences: captures in whose terms one of these stands are learned from, all where there is none.
    """
    rng, found = np.random.default_rng(0), {}
    for label in GAITS:
        of_label = [(licence, motion) for licence, motion in shown if motion.label == label]
        for toes in (True, False):
            everything = list(cases(of_label, toes, rng))
            for kind in (STRIKE, OFF):
                own = [case for name, case in everything if name == kind]
                taught = [case for case in own if allowed(case.licence, licences)]
                found[named(kind, label == "run", toes)] = _weights(own, taught)
    return found


def cases(
    shown: Iterable[tuple[str, Motion]], toes: bool, rng: np.random.Generator
) -> Iterator[tuple[str, Case]]:
    """Kind and case of every moment."""
    for licence, motion in shown:
        subject = motion.name.split("_")[0]
        for sided in (motion, motion.mirrored):
            for fps in FPS:
                exact, build, gait = shown_at(sided, fps, rng)
                track = in_error(exact, fps, rng)
                truth = contacts(gait, build)
                for side in SIDES:
                    way, true = (_way(of, side, toes) for of in (track, exact))
                    turns = way.turns(fps)
                    apart = np.concatenate([np.diff(at) for at in turns.values()])
                    if not len(apart):
                        continue
                    period = float(np.median(apart))
                    for kind, at in turns.items():
                        moments = [(getattr(one, kind), kind in one.clear) for one in truth[side]]
                        for t in at:
                            sampled = sampling(int(t), period, len(way.places))
                            late = [(fps * (at - track.times[t]) / period, clear) for at, clear in moments]
                            nearest, clear = min(late, key=lambda one: abs(one[0]), default=(np.inf, False))
                            if sampled is not None and clear and abs(nearest) < NEAR:
                                x = [(sampled[1] @ one.places[sampled[0]]).T for one in (way, true)]
                                yield kind, Case(subject, motion.name, licence, float(nearest), *x)


def _way(track: Track, side: Side, toes: bool) -> Way:
    way = Way.of(track, side)
    return way if toes else Way(way.places[:, :2], way.covs[:, :2, :2])


def shown_at(motion: Motion, fps: float, rng: np.random.Generator) -> tuple[Track, Build, Gait]:
    """A capture as a track without error, the lengths of its figure, and its gait at RATE from second 0."""
    build = random_build(rng)
    dense = gait_of(motion, build, np.arange(int(motion.seconds * RATE)) / RATE)
    times = np.arange(rng.uniform(0.0, 0.5 / fps), motion.seconds - 1.0 / RATE, 1.0 / fps)
    figure = figure_of(build)
    q = poses(figure, build, gait_of(motion, build, times))
    track = track_of(q, times, np.radians(NOISE))
    track = replace(track, figure=figure, labels=(motion.label,), motions=(motion.label,) * len(q))
    return track, build, dense


def in_error(track: Track, fps: float, rng: np.random.Generator) -> Track:
    """The track with errors of its angles as tracks have them."""
    q, shape = track.q.copy(), (len(track), len(ANGLES))
    slow = gaussian_filter1d(rng.standard_normal(shape), TOGETHER * fps, axis=0, mode="reflect")
    q[:, ANGLES] += np.radians(NOISE * slow / slow.std() + GRAIN * rng.standard_normal(shape))
    return replace(track, q=q)


def figure_of(build: Build) -> Figure:
    """The walking figure with these lengths, its toes where those of rendered figures are marked."""
    lengths = {"torso": build.torso, "head": build.neck, "thigh": build.thigh, "shank": build.shank}
    lengths["foot"] = float(np.hypot(build.toe, build.ankle - build.toe_height))
    links = (replace(link, length=lengths[link.name.partition("_")[0]]) for link in WALKER.links)
    return replace(WALKER, links=tuple(links))


def poses(figure: Figure, build: Build, gait: Gait) -> Array:
    """(T, D) of the walking figure."""
    q = np.zeros((len(gait.pose), len(figure.freedoms)))
    q[:, : gait.pose.shape[1]] = gait.pose
    square = np.arctan2(build.toe, build.ankle - build.toe_height) - 0.5 * np.pi
    for side, hip, knee, foot in zip(SIDES, q.T[[4, 6]], q.T[[5, 7]], gait.foot.T, strict=True):
        q[:, figure.index(f"ankle_{side}")] = square + foot - (hip - knee)
    return q


def _weights(cases: Sequence[Case], taught: Sequence[Case]) -> Weights:
    b, w = _fit(taught)
    left = np.zeros(len(cases))
    who = np.array([case.subject for case in cases])
    for subject in sorted(set(who)):
        base, weights = _fit([case for case in taught if case.subject != subject])
        for i in np.flatnonzero(who == subject):
            left[i] = cases[i].late - base - (weights * cases[i].true).sum()
    shown = np.array([case.capture for case in cases])
    mean = {capture: left[shown == capture].mean() for capture in set(shown)}
    shared = np.array([mean[capture] for capture in shown])
    return Weights(b, w, _of_people(left - shared, who), _of_people(shared, who))


def _of_people(errors: Array, who: NDArray[np.str_]) -> float:
    """Root mean square, in which every person counts alike."""
    return float(np.sqrt(np.mean([np.mean(errors[who == subject] ** 2) for subject in set(who)])))


def _fit(cases: Sequence[Case]) -> tuple[float, Array]:
    """b and w (C, W), which the ridge keeps small."""
    x = np.array([case.x.ravel() for case in cases])
    late = np.array([case.late for case in cases])
    mean = x.mean(axis=0)
    gram = (x - mean).T @ (x - mean) + RIDGE * len(x) * np.eye(x.shape[1])
    w = np.linalg.solve(gram, (x - mean).T @ (late - late.mean()))
    return float(late.mean() - w @ mean), w.reshape(cases[0].x.shape)


def allowed(licence: str, wanted: Sequence[str]) -> bool:
    """Whether a capture's terms are among those wanted, all where none are."""
    return not wanted or any(text in licence for text in wanted)


if __name__ == "__main__":
    main()
