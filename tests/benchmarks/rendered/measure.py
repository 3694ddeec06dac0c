"""A film followed from its true marks and without any, and how far from the truth that is."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from kinematics.figure_file import WALKER
from kinematics.mocap import read_trials
from kinematics.recover import PoseError
from kinematics.sides import other_side
from tests.benchmarks.evaluation.calibration import distance, inside
from tests.benchmarks.evaluation.cases import BEFORE_ALL, LEGS, QUIET
from tests.benchmarks.rendered.filming import Film, film
from tests.benchmarks.rendered.plans import planned
from tracker.clip.follow import follow
from tracker.clip.found import people, start_of
from tracker.clip.job import Following, Found, Job
from tracker.clip.start import FoundError, StartError
from tracker.outline.person import Person
from tracker.run.score import places, score
from tracker.run.track import Track
from tracker.tables.keypoints import Mark, Marks
from videos.frames import Video

AWAY = 0.25  # leg lengths; a start whose joints are farther from the truth is misplaced
SCORED = WALKER.scored


@dataclass(frozen=True)
class Followed:
    """A track against every true joint of every frame, hidden ones too.

    error     : mean over the frames, leg lengths
    lost      : frame, None where it never was
    exchanged : frames in which the legs are named wrongly, of `frames`
    inside    : share of visible joints within two sigma, 0.865 is right
    behind    : the same of hidden ones, NaN where there are none
    label     : of most frames
    """

    error: float
    lost: int | None
    exchanged: int
    frames: int
    inside: float
    behind: float
    label: str


@dataclass(frozen=True)
class Start:
    """A start that was found, and what of it is right; `sure` is what was said of the nearer leg.

    placed : whether its joints are about where the figure's are, whatever the legs are called
    """

    placed: bool
    facing: bool
    near: bool
    sure: bool

    @property
    def wrong_though_sure(self) -> bool:
        """Whether it misleads: what was not refused is right but for a leg of which a warning tells."""
        return not (self.placed and self.facing and (self.near or not self.sure))


@dataclass(frozen=True)
class Case:
    """One film both ways; a track is a line of text where the start was refused.

    start : that was found, None where none was
    """

    seed: int
    label: str
    kinds: Mapping[str, str]
    marked: Followed | str
    start: Start | None
    unmarked: Followed | str


def case(seed: int, trials: Path) -> Case:
    """The film of a seed, made by the table of captures, followed and measured."""
    plan = planned(seed, read_trials(trials))
    made = film(plan)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "film.mp4"
        made.write(path)
        frame = start_frame(made)
        marked = _followed(made, Job(path, {frame: made.marks[frame]}))
        start, unmarked = without_marks(made, path)
    lead = plan.walkers[0]
    return Case(seed, lead.label, plan.kinds, marked, start, unmarked)


def without_marks(made: Film, path: Path) -> tuple[Start | None, Followed | str]:
    """What was found, and followed from there; or why not.

    Where several people are found, the one that is meant is named, as a user would.
    """
    video = Video(path)
    everybody = people(video, QUIET)
    how = Following(person=meant(everybody, made.marks) if len(everybody) > 1 else None)
    try:
        found = start_of(everybody, how, video)
    except FoundError as refused:
        return None, str(refused)
    return judged(made, found), _followed(made, how.job(path, found))


def start_frame(made: Film) -> int:
    """Where the ankles are farthest apart among frames that show all of both legs."""

    def apart(frame: int) -> float:
        return abs(made.marks[frame]["near_ankle"].x - made.marks[frame]["far_ankle"].x)

    whole = [t for t, row in made.marks.items() if all(row[name].visible for name in LEGS)]
    return max(whole or made.marks, key=apart)


def judged(made: Film, found: Found) -> Start:
    """A start against the truth of its frame."""
    truth = made.marks[found.frame]
    lead = made.plan.walkers[0]
    named = _error(truth, found.marks, LEGS)
    exchanged = _error(truth, {other_side(name): mark for name, mark in found.marks.items()}, LEGS)
    trunk = _error(truth, found.marks, ("head_top", "neck", "hip"))
    return Start(
        placed=bool(max(trunk, min(named, exchanged)) < AWAY * lead.leg_px),
        facing=found.facing == lead.facing,
        near=named <= exchanged,
        sure=found.near_leg == "sure",
    )


def meant(everybody: Sequence[Person], marks: Marks) -> int:
    """The number of the one whose hips are where those marked in every frame are."""

    def away(one: Person) -> float:
        hips = [marks[t]["hip"] for t in range(one.first, one.last + 1)]
        return float(np.median(np.hypot(*(one.outline.hips - [(hip.x, hip.y) for hip in hips]).T)))

    return 1 + min(range(len(everybody)), key=lambda i: away(everybody[i]))


def _followed(made: Film, job: Job) -> Followed | str:
    try:
        track = follow(job, QUIET).track
    except (StartError, PoseError) as refused:
        return str(refused)
    found = score(made.marks, places(track), BEFORE_ALL)
    labels = Counter(track.motions)
    return Followed(
        error=found.mean_error_leg,
        lost=found.first_failure_frame,
        exchanged=found.swaps,
        frames=found.truth_frames,
        inside=inside(_distances(made, track, True)),
        behind=inside(_distances(made, track, False)),
        label=labels.most_common(1)[0][0],
    )


def _distances(made: Film, track: Track, visible: bool) -> np.ndarray:
    """(M,) squared errors of visible or of hidden joints, in standard deviations; the truth has none."""
    column = {name: j for j, name in enumerate(track.figure.joints)}
    return np.array(
        [
            distance(np.array([row[name].x, row[name].y]) - at[column[name]], covs[column[name]])
            for row, at, covs in zip(made.marks.values(), track.joints(), track.joint_covs(), strict=True)
            for name in SCORED
            if row[name].visible == visible
        ]
    )


def _error(truth: Mapping[str, Mark], found: Mapping[str, Mark], names: Sequence[str]) -> float:
    """Mean distance of these joints, pixels."""
    return float(
        np.mean([np.hypot(truth[name].x - found[name].x, truth[name].y - found[name].y) for name in names])
    )
