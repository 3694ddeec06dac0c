"""Make tracker/gait/norms.npz from captures, for `make models`: what angles over the stride people have.

    python -m tests.benchmarks.gait.norms TRIALS OUT.npz --licence CMU --licence "Seoul National"

Strides go from a foot's strike to its next as `truth.contacts` tells them, of either leg. A person is the
mean over all of his or her strides, and the band is over people, so that who was captured often counts once.
"""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise

import numpy as np

from kinematics.mocap import read_trials
from kinematics.sides import SIDES
from tests.benchmarks.gait.learn import allowed, arguments, captures, figure_of, poses
from tests.benchmarks.gait.truth import Contact, contacts
from tests.benchmarks.rendered.captures import GAITS, RATE, Motion, gait_of
from tracker.gait.curves import over_strides
from tracker.gait.figures import LEG_JOINTS
from tracker.gait.moments import Event
from tracker.gait.strides import Stride
from tracker.scene.steps import Array, random_build

LEAST = 5  # people; the spread of fewer is no norm
LONGEST = 2.0  # seconds; between strikes further apart one was missed


def main() -> None:
    """Make and write."""
    asked = arguments("norms", __doc__)
    shown = captures(read_trials(asked.trials))
    made = norms([motion for terms, motion in shown if allowed(terms, asked.licence)])
    np.savez(asked.out, **made)


def norms(shown: Sequence[Motion]) -> dict[str, Array]:
    """By motion and joint, of motions that at least LEAST people show: their number, means and spreads."""
    rng, found = np.random.default_rng(0), {}
    people: dict[str, dict[str, list[Array]]] = {label: defaultdict(list) for label in GAITS}
    for motion in shown:
        people[motion.label][motion.name.split("_")[0]] += strides(motion, rng)
    for label, of_label in people.items():
        means = np.array([np.mean(curves, axis=0) for curves in of_label.values() if curves])
        if len(means) >= LEAST:
            for k, joint in enumerate(LEG_JOINTS):
                mean, sigma = means[:, k].mean(axis=0), means[:, k].std(axis=0, ddof=1)
                found[f"{label}_{joint}"] = np.array([len(means), *mean, *sigma])
    return found


def strides(motion: Motion, rng: np.random.Generator) -> Iterator[Array]:
    """Angles of LEG_JOINTS over every stride of either leg, (3, 101), degrees."""
    build = random_build(rng)
    times = np.arange(int(motion.seconds * RATE)) / RATE
    gait = gait_of(motion, build, times)
    if gait.pose[-1, 0] <= gait.pose[0, 0]:
        return
    figure, truth = figure_of(build), contacts(gait, build)
    q = np.degrees(poses(figure, build, gait))
    for side in SIDES:
        whole = list(_whole(truth[side]))
        columns = [figure.index(f"{joint}_{side}") for joint in LEG_JOINTS]
        yield from np.stack([over_strides(q[:, column], whole, times) for column in columns], axis=1)


def _whole(found: Iterable[Contact]) -> Iterator[Stride]:
    """In rows of the gait."""
    for contact, after in pairwise(found):
        if after.strike - contact.strike < LONGEST:
            moments = (contact.strike, contact.off, after.strike)
            yield Stride(*(Event(RATE * at, 0.0, 0.0) for at in moments))


if __name__ == "__main__":
    main()
