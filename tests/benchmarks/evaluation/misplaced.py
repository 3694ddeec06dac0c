"""Start marks put wrongly in the ways people do: what the tracker makes of it, and whether it says so."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from kinematics.mocap import read_trials
from kinematics.recover import PoseError
from kinematics.sides import other_side
from tests.benchmarks.evaluation.calibration import TWO_SIGMA, distance, mark_noise
from tests.benchmarks.evaluation.cases import BEFORE_ALL, QUIET, first_whole, marks_of
from tests.benchmarks.evaluation.disturbances import beside
from tests.benchmarks.page import Claim, chapter, table
from tests.benchmarks.rendered.filming import film
from tests.benchmarks.rendered.measure import AWAY, start_frame
from tests.benchmarks.rendered.plans import planned
from tracker.clip.follow import follow
from tracker.clip.job import Job
from tracker.clip.start import StartError
from tracker.loop.outcome import Outcome
from tracker.run.score import leg_length, places, score
from tracker.run.track import Track
from tracker.tables.keypoints import Mark, Marks
from videos.frames import Video

Row = Mapping[str, Mark]
Change = Callable[[Row, Row, float, np.random.Generator], dict[str, Mark]]

LATER = 5  # frames on, or the marked frame nearest to that, are those whose marks are taken for the start's
RENDERED = range(200, 300)  # seeds of films that nothing was chosen by, one way of misplacing each


def _exchanged(*kinds: str) -> Change:
    """Both sides of these joints exchanged."""

    def change(row: Row, later: Row, leg: float, rng: np.random.Generator) -> dict[str, Mark]:
        names = {name: other_side(name) if name.partition("_")[2] in kinds else name for name in row}
        return {name: row[names[name]] for name in row if names[name] in row}

    return change


def _moved(names: Sequence[str], right: float, down: float) -> Change:
    """Marks of these joints, or all, moved by so many leg lengths."""

    def change(row: Row, later: Row, leg: float, rng: np.random.Generator) -> dict[str, Mark]:
        return {
            name: replace(mark, x=mark.x + right * leg, y=mark.y + down * leg)
            if not names or name in names
            else mark
            for name, mark in row.items()
        }

    return change


def _careless(pixels: float) -> Change:
    """Gaussian noise on every coordinate."""

    def change(row: Row, later: Row, leg: float, rng: np.random.Generator) -> dict[str, Mark]:
        return {name: beside(mark, pixels, rng) for name, mark in row.items()}

    return change


WAYS: dict[str, Change] = {
    "legs exchanged": _exchanged("knee", "ankle", "toe"),
    "ankles and toes exchanged": _exchanged("ankle", "toe"),
    "knees exchanged": _exchanged("knee"),
    "hip 0.2 leg lengths too low": _moved(("hip",), 0.0, 0.2),
    "near ankle 0.3 leg lengths off": _moved(("near_ankle",), 0.3, 0.0),
    "5 px of noise": _careless(5.0),
    "10 px of noise": _careless(10.0),
    "everything 0.15 leg lengths off": _moved((), 0.15, 0.0),
    f"of the frame {LATER} later": lambda row, later, leg, rng: dict(later),
}


@dataclass(frozen=True)
class Told:
    """What came of it.

    refused : the start
    wrong   : it was followed, not to the end or with legs exchanged
    warned  : of something besides what is said of the film itself
    off     : marked frames with a mean error over AWAY
    sure    : of these, frames called ok whose ellipses leave out most of the joints that are off
    """

    refused: bool = False
    wrong: bool = False
    warned: bool = False
    off: int = 0
    sure: int = 0


def told(trials: Path, shown: Path | int, way: str) -> Told:
    """Follow a film from misplaced marks.

    Args:
        trials: table of the captures that rendered films are of.
        shown: a marked clip, or the seed of a rendered film.
    """
    if isinstance(shown, Path):
        marks = marks_of(shown)
        return _followed(shown, marks, first_whole(marks), way)
    made = film(planned(shown, read_trials(trials)))
    with TemporaryDirectory() as folder:
        path = Path(folder) / "film.mp4"
        made.write(path)
        return _followed(path, made.marks, start_frame(made), way)


def _followed(path: Path, marks: Marks, start: int, way: str) -> Told:
    row, leg = marks[start], leg_length(marks, [start])
    later = marks[min(marks.keys() - {start}, key=lambda t: abs(t - start - LATER))]
    given = WAYS[way](row, later, leg, np.random.default_rng([start, *way.encode()]))
    job = Job(path, {start: given}, start=start, stop=max(marks))
    try:
        run = follow(job, QUIET)
    except (StartError, PoseError):
        return Told(refused=True)
    found = score({t: row for t, row in marks.items() if t != start}, places(run.track), BEFORE_ALL)
    video = Video(path)
    for _ in video:
        pass
    off = [frame for frame, error in found.frame_errors.items() if error > AWAY]
    return Told(
        wrong=found.first_failure_frame is not None or 2 * found.swaps > found.truth_frames,
        warned=bool(set(run.warnings) - set(video.notes)),
        off=len(off),
        sure=sum(_sure(run.track, marks[frame], frame, leg) for frame in off),
    )


def _sure(track: Track, row: Row, frame: int, leg: float) -> bool:
    """Whether a frame that is off is called ok and has small ellipses."""
    t = frame - track.first
    if track.outcome[t] is not Outcome.OK:
        return False
    (at,), (covs,) = track.joints(slice(t, t + 1)), track.joint_covs(slice(t, t + 1))
    column = {name: j for j, name in enumerate(track.figure.joints)}
    outside = []
    for name in track.figure.scored:
        if name in row:
            error = np.array([row[name].x, row[name].y]) - at[column[name]]
            if np.hypot(*error) > AWAY * leg:
                outside.append(distance(error, covs[column[name]] + mark_noise([])) > TWO_SIGMA)
    return 2 * sum(outside) > len(outside)


Case = tuple[Path | int, str]  # what is shown, and a way of misplacing
Answers = Mapping[Case, Told]


def cases(clips: Sequence[Path]) -> list[Case]:
    """Every way on every clip, and a rendered film each after the other one way."""
    names = list(WAYS)
    return [*product(clips, names), *((seed, names[seed % len(names)]) for seed in RENDERED)]


HEADER = ("marks", "refused", "wrong, said", "wrong, not said", "frames off", "called sure")
METHOD = """\
Marks of one frame put wrongly: in each pair the first number is of {clips} open clips, the second of {films}
rendered films, one way each. Wrong: not followed to the end, or legs exchanged in most frames; said: with a
warning. A frame is off by more than {away:g} leg lengths in the mean; it is called sure where its outcome is
`ok` and the ellipses of most joints that are off do not reach the marks.
"""


def claims(answers: Answers) -> list[Claim]:
    """How well the tracker is to know itself."""
    off, sure = (sum(getattr(each, name) for each in answers.values()) for name in ("off", "sure"))
    legs = _of(answers, "legs exchanged", Path)
    unsaid = sum(each.wrong and not each.warned for each in legs)
    return [
        Claim("share of the frames off that are called sure", sure / max(off, 1), 0.05),
        Claim(f"exchanged legs followed silently, of {len(legs)} clips", unsaid, 2),
    ]


def section(answers: Answers) -> list[str]:
    """A table with open clips and rendered films in pairs."""
    rows = []
    for way in WAYS:
        pairs = zip(*(_counts(_of(answers, way, kind)) for kind in (Path, int)), strict=True)
        rows.append([way, *(f"{clips}, {films}" for clips, films in pairs)])
    clips = len({shown for shown, _ in answers if isinstance(shown, Path)})
    method = METHOD.format(clips=clips, films=len(RENDERED), away=AWAY)
    return chapter("## Marks put wrongly", method, table(HEADER, rows))


def _of(answers: Answers, way: str, kind: type) -> list[Told]:
    return [each for (shown, by), each in answers.items() if by == way and isinstance(shown, kind)]


def _counts(of: Sequence[Told]) -> list[int]:
    """The cells of a row, under HEADER."""
    said = [each.warned for each in of if each.wrong]
    refused, off, sure = (sum(getattr(each, name) for each in of) for name in ("refused", "off", "sure"))
    return [refused, sum(said), len(said) - sum(said), off, sure]
