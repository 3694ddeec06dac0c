"""Gait figures of tracked rendered films against what the feet of the figure do."""

import pickle
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from kinematics.mocap import read_trials
from kinematics.recover import PoseError
from kinematics.sides import SIDES, Side
from tests.benchmarks.evaluation.cases import QUIET, marks_of
from tests.benchmarks.gait.learn import figure_of, poses
from tests.benchmarks.gait.truth import Contact, contacts
from tests.benchmarks.rendered.captures import RATE, gait_of
from tests.benchmarks.rendered.filming import Film, film
from tests.benchmarks.rendered.measure import start_frame
from tests.benchmarks.rendered.plans import MOMENTS, Plan, planned
from tracker.clip.follow import follow
from tracker.clip.job import Job
from tracker.clip.start import StartError
from tracker.gait.figures import runs, turns
from tracker.gait.lengths import Known, lengths
from tracker.gait.moments import OFF, STRIKE, Event
from tracker.gait.strides import Stride, Strides, strides_of
from tracker.gait.times import times
from tracker.gait.values import Measure, Value
from tracker.run.track import Track

TALL = 1.75  # metres, of every walker
NEAREST = 0.5  # of a stride: a true strike farther away is another one


@dataclass(frozen=True)
class Moment:
    """One strike or leaving: seconds that it was told too late, and its standard error."""

    kind: str
    late: float
    error: float


@dataclass(frozen=True)
class Figure:
    """One gait figure of a film, of a leg or of both: as told, as it is, and its standard error."""

    name: str
    told: float
    true: float
    error: float


@dataclass(frozen=True)
class Case:
    """A film's strides that have their truth; none where the start was refused.

    runs    : whether the film was taken for a run
    strides : of the near and of the far leg, with clear moments
    missed  : strides whose strike is no foot's, as where legs are exchanged
    unclear : strides one of whose moments is unclear
    """

    seed: int
    capture: str
    kinds: Mapping[str, str]
    runs: bool = False
    strides: tuple[int, int] = (0, 0)
    missed: int = 0
    unclear: int = 0
    moments: tuple[Moment, ...] = ()
    figures: tuple[Figure, ...] = ()


def case(seed: int, trials: Path, tracks: Path) -> Case:
    """The film of a seed, made and followed from its marks where `tracks` does not hold that yet."""
    plan = planned(seed, read_trials(trials))
    track = _kept(tracks / f"{seed}.pkl", lambda: _followed(film(plan)))
    none = Case(seed, plan.walkers[0].name, plan.kinds)
    return none if isinstance(track, str) else measured(none, plan, track)


def measured(none: Case, plan: Plan, track: Track) -> Case:
    """What a track's strides come to."""
    run, lead = runs(track), plan.walkers[0]
    moments = np.arange(int(lead.motion.seconds * RATE)) / RATE  # of the motion, of which the film is a part
    contact = contacts(gait_of(lead.motion, lead.build, moments), lead.build)
    found = strides_of(track, run)
    pairs = {side: list(_pairs(plan, found[side].sound, contact[side])) for side in SIDES}
    known = {side: [one for one in pairs[side] if one is not None] for side in SIDES}
    clear = {side: [one for one in known[side] if _clear(*one[1])] for side in SIDES}
    told = {side: replace(found[side], sound=tuple(one for one, _ in clear[side])) for side in SIDES}
    true = {side: _true_strides(plan, clear[side], contact[side]) for side in SIDES}
    return replace(
        none,
        runs=run,
        strides=(len(clear["near"]), len(clear["far"])),
        missed=sum(one is None for side in SIDES for one in pairs[side]),
        unclear=sum(len(known[side]) - len(clear[side]) for side in SIDES),
        moments=tuple(_moments(plan, known)),
        figures=tuple(
            _figures(_measures(plan, track, told), _measures(plan, _true_track(plan, track), true))
        ),
    )


def clip(path: Path, tracks: Path) -> Track:
    """An open clip followed from its marks, where `tracks` does not hold that yet."""
    job = Job(path, marks_of(path))
    track = _kept(tracks / f"{path.stem}.pkl", lambda: follow(job, QUIET).track)
    assert isinstance(track, Track)
    return track


def _kept(path: Path, made: Callable[[], Track | str]) -> Track | str:
    """What a file holds, or what is made and then kept in it."""
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        aside = path.with_suffix(".part")
        aside.write_bytes(pickle.dumps(made()))
        aside.replace(path)
    found: Track | str = pickle.loads(path.read_bytes())  # our own file
    return found


def _followed(made: Film) -> Track | str:
    frame = start_frame(made)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "film.mp4"
        made.write(path)
        try:
            return follow(Job(path, {frame: made.marks[frame]}), QUIET).track
        except (StartError, PoseError) as refused:
            return str(refused)


def _pairs(
    plan: Plan, strides: Sequence[Stride], true: Sequence[Contact]
) -> Iterator[tuple[Stride, tuple[Contact, Contact]] | None]:
    """Each stride with the true contacts that begin and follow it, None if there are none such.

    Strides that begin before the first true contact or end after the last are passed over: the capture that
    is shown does not tell of them.
    """
    strikes = np.array([contact.strike for contact in true])
    for stride in strides:
        start, end = (_seconds(plan, event.at) for event in (stride.strike, stride.end))
        near = NEAREST * (end - start)
        if len(strikes) < 2 or start < strikes[0] - near or end > strikes[-1] + near:
            continue
        i = int(np.abs(strikes[:-1] - start).argmin())
        close = abs(strikes[i] - start) < near and abs(strikes[i + 1] - end) < near
        yield (stride, (true[i], true[i + 1])) if close else None


def _clear(true: Contact, after: Contact) -> bool:
    return {STRIKE, OFF} <= set(true.clear) and STRIKE in after.clear


def _seconds(plan: Plan, frame: float) -> float:
    """Of the motion that is shown."""
    return plan.walkers[0].zero + frame * plan.speed / plan.fps


def _true_strides(
    plan: Plan, pairs: Sequence[tuple[Stride, tuple[Contact, Contact]]], true: Sequence[Contact]
) -> Strides:
    def frames(*seconds: float) -> tuple[Event, ...]:
        first = plan.walkers[0].zero
        return tuple(Event((moment - first) * plan.fps / plan.speed, 0.0, 0.0) for moment in seconds)

    sound = tuple(Stride(*frames(one.strike, one.off, after.strike)) for _, (one, after) in pairs)
    return Strides(sound, 0, frames(*(one.strike for one in true)), frames(*(one.off for one in true)))


def _true_track(plan: Plan, track: Track) -> Track:
    """The track with the true poses of its frames."""
    lead = plan.walkers[0]
    shown = MOMENTS * (track.first + np.arange(len(track))) + MOMENTS // 2
    figure = figure_of(lead.build)
    q = poses(figure, lead.build, lead.gait.at(shown))
    return replace(track, figure=figure, q=q, cov=np.zeros((len(q), q.shape[1], q.shape[1])))


def _moments(
    plan: Plan, pairs: Mapping[Side, Sequence[tuple[Stride, tuple[Contact, Contact]]]]
) -> Iterator[Moment]:
    pace = plan.speed / plan.fps
    for of_side in pairs.values():
        seen: set[float] = set()
        for stride, (true, after) in of_side:
            moments = ((stride.strike, STRIKE, true), (stride.off, OFF, true), (stride.end, STRIKE, after))
            for event, kind, contact in moments:
                if event.at not in seen and kind in contact.clear:
                    seen.add(event.at)
                    error = pace * float(np.hypot(event.error, event.shared))
                    yield Moment(kind, _seconds(plan, event.at) - getattr(contact, kind), error)


def _measures(plan: Plan, track: Track, strides: Mapping[Side, Strides]) -> dict[str, Measure]:
    track = replace(track, times=track.times * plan.speed)
    leg = Known(height=TALL).leg(track)
    run = plan.walkers[0].label == "run"
    every = (*times(track, strides, run), *lengths(track, strides, leg), *turns(track, strides))
    return {measure.name: measure for measure in every}


def _figures(told: Mapping[str, Measure], true: Mapping[str, Measure]) -> Iterator[Figure]:
    for name in told.keys() & true.keys():
        one, other = told[name], true[name]
        legs = [(one.near, other.near), (one.far, other.far)]
        found = [pair for pair in legs if None not in pair] or [(one.both, other.both)]
        for value, truth in found:
            if isinstance(value, Value) and isinstance(truth, Value):
                yield Figure(name, value.mean, truth.mean, value.error)
