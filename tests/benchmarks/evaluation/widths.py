"""How far the foreground reaches on either side of marked links, for the bars of `tracker.outline.shape`.

    python -m tests.benchmarks.evaluation.widths DATA

Along each link, at shares of its length, the distances to its right and left at which half of the marked
frames show foreground, medians over the clips in leg lengths. A leg counts where its twin is not behind it.
"""

import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from kinematics.figure_file import WALKER
from kinematics.recover import PoseError, Start, start_pose
from kinematics.spm import skeleton, surface
from tests.benchmarks.evaluation.cases import QUIET, Array, first_whole, marks_of
from tracker.clip.part import LEG
from tracker.clip.staged import surveyed
from tracker.clip.start import facing_at
from tracker.outline.stage import Stage
from tracker.survey.evidence import NOTHING
from tracker.tables.keypoints import points
from videos.frames import Video

ALONG = np.arange(0.0, 1.01, 0.2)
ACROSS = np.arange(-0.3, 0.301, 0.02)  # leg lengths
APART = 0.35  # leg lengths between the tips of a link and of its twin


def main() -> None:
    """Print a line for every link and share of its length."""
    data = Path(sys.argv[1])
    clips = sorted([*(data / "video").glob("*.mp4"), *(data / "video_hard").glob("*.mp4")])
    found: dict[str, list[Array]] = defaultdict(list)
    for clip in clips:
        for link, shown in of_clip(clip).items():
            found[link].append(np.array([edges(row) for row in shown]))
    for link, each in found.items():
        for share, (right, left) in zip(ALONG, np.nanmedian(each, axis=0), strict=True):
            print(f"{link:12s} {share:.1f}  right {-right:.3f}  left {left:.3f}")


def of_clip(clip: Path) -> dict[str, Array]:
    """(ALONG, ACROSS) share of the marked frames with foreground, of each link that is marked apart."""
    marks = marks_of(clip)
    facing = facing_at(marks, first_whole(marks))
    starts = {frame: start for frame in marks if (start := _start(points(marks[frame]), facing)) is not None}
    unit = float(np.median([start.view.unit for start in starts.values()]))
    film = surveyed(Video(clip), 0, max(marks), 1, unit / LEG, QUIET)
    if film is None:
        return {}
    stage, found = film.stage(facing), defaultdict(list)
    for frame, start in starts.items():
        for name, shown in _of_frame(stage, frame, start):
            found[name].append(shown)
    return {name: np.mean(each, axis=0) for name, each in found.items()}


def edges(shown: Array) -> tuple[float, float]:
    """Where half of the frames show foreground, right and left of the link; NaN where it goes on beyond."""
    middle = len(ACROSS) // 2
    ways = shown[middle::-1], shown[middle:]
    right, left = (_falls(way) for way in ways)
    return -right, left


def _falls(shown: Array) -> float:
    below = np.flatnonzero(shown < 0.5)
    if not len(below) or below[0] == 0:
        return float("nan")
    i = int(below[0])
    share = (shown[i - 1] - 0.5) / (shown[i - 1] - shown[i])
    return float((i - 1 + share) * (ACROSS[1] - ACROSS[0]))


def _start(marked: dict[str, tuple[float, float]], facing: int) -> Start | None:
    try:
        start = start_pose(WALKER, marked, facing)
    except PoseError:
        return None
    return start if start.known.all() else None


def _of_frame(stage: Stage, frame: int, start: Start) -> Iterator[tuple[str, Array]]:
    figure, bones = start.figure, skeleton(start.figure, start.q)
    part, view = stage.part(slice(frame, frame + 1)), start.view
    along, across = (each.ravel() for each in np.meshgrid(ALONG, ACROSS, indexing="ij"))
    for i, link in enumerate(figure.links):
        if i in figure.twins and np.hypot(*(bones.tip[i] - bones.tip[figure.twins[i]])) < APART:
            continue
        places = surface(bones, np.full(len(along), i), along, across)
        hips, units = np.array([view.origin]), np.array([view.unit])
        out = part.at(part.odds, hips, units, places[None], NOTHING)[0] > NOTHING
        yield link.name.removesuffix("_near").removesuffix("_far"), out.reshape(len(ALONG), -1)


if __name__ == "__main__":
    main()
