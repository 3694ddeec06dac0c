"""The page of the rendered films."""

from collections.abc import Callable, Sequence

import numpy as np

from tests.benchmarks.page import Claim, chapter, claim_table, table, written
from tests.benchmarks.rendered.measure import Case, Followed

METHOD = """\
Each film is drawn from a seed: walk or run, direction, clothes, light, occluders, camera, playback speed
and compression. The motion is that of open captures, some of which the shipped model was learned from. All
true joints, hidden ones too, are scored. Marked films start from the true joints of one frame, unmarked ones
as `figtrack track` does.
"""
KINDS = """\
The error is the median of the films' mean errors in leg lengths; inside is the share of visible/hidden joints
within two standard deviations, for which 86.5 % is expected. Unmarked starts are wrong where their joints err
by more than 0.25 leg lengths, the facing is wrong, or legs are exchanged that no warning announced.
"""
HEADER = (
    "kind",
    "films",
    "error",
    "inside, %",
    "gait named",
    "facing right",
    "near leg right",
    "wrong without warning",
    "followed unmarked",
    "error unmarked",
)


def page(cases: Sequence[Case], tried: str) -> str:
    """The whole text.

    Args:
        tried: a line that says why the figures are not those of the report; empty where they are.
    """
    seeds = [each.seed for each in cases]
    by = f"{written('rendered')}, seeds {min(seeds)} to {max(seeds)}.\n{tried}"
    return "\n".join(
        [
            *chapter("# Rendered films", by, METHOD),
            *chapter("## What is wanted", claim_table(claims(cases))),
            *chapter("## By kind of film", KINDS, table(HEADER, by_kind(cases))),
        ]
    )


def claims(cases: Sequence[Case]) -> list[Claim]:
    """What is wanted of these films; counts as if there were a hundred."""
    share = 100.0 / len(cases)
    starts = [each.start for each in cases if each.start is not None]
    facing = sum(start.placed and start.facing for start in starts)
    tracks = marked(cases)
    frames = sum(track.frames for track in tracks)
    exchanged = sum(track.exchanged for track in tracks)
    return [
        Claim("followed, of 100", share * kept(tracks), 100.0, 97.0),
        Claim("median error, leg lengths", median(tracks), 0.03),
        Claim("frames with exchanged legs", 100.0 * exchanged / frames if frames else np.nan, 1.0, unit="%"),
        Claim("found with the right facing, of 100", share * facing, 100.0, 95.0),
        Claim("wrong without warning, of 100", share * sum(start.wrong_though_sure for start in starts), 2.0),
    ]


def by_kind(cases: Sequence[Case]) -> list[list[str]]:
    """Rows under HEADER: all films, then those of each kind."""
    rows = [["**all**", *_cells(cases)]]
    for what in cases[0].kinds:
        for kind in sorted({each.kinds[what] for each in cases} - {"none"}):
            rows.append([f"{what}: {kind}", *_cells([each for each in cases if each.kinds[what] == kind])])
    return rows


def marked(cases: Sequence[Case]) -> list[Followed]:
    """Tracks from marks, where the start was not refused."""
    return [each.marked for each in cases if isinstance(each.marked, Followed)]


def kept(tracks: Sequence[Followed]) -> int:
    """How many were never lost."""
    return sum(track.lost is None for track in tracks)


def median(tracks: Sequence[Followed]) -> float:
    """Of the films' mean errors, leg lengths."""
    return _of(np.median, [track.error for track in tracks])


def _inside(tracks: Sequence[Followed]) -> tuple[float, float]:
    """Mean shares of the visible and of the hidden joints within two standard deviations."""
    hidden = [track.behind for track in tracks if np.isfinite(track.behind)]
    return _of(np.mean, [track.inside for track in tracks]), _of(np.mean, hidden)


def _cells(cases: Sequence[Case]) -> list[str]:
    tracks = marked(cases)
    unmarked = [each.unmarked for each in cases if isinstance(each.unmarked, Followed)]
    starts = [each.start for each in cases if each.start is not None]
    named = sum(isinstance(each.marked, Followed) and each.marked.label == each.label for each in cases)
    return [
        str(len(cases)),
        f"{median(tracks):.3f}",
        "{:.0f}/{:.0f}".format(*(100.0 * share for share in _inside(tracks))),
        str(named),
        str(sum(start.placed and start.facing for start in starts)),
        str(sum(start.placed and start.near for start in starts)),
        str(sum(start.wrong_though_sure for start in starts)),
        str(kept(unmarked)),
        f"{median(unmarked):.3f}",
    ]


def _of(function: Callable[[list[float]], float], values: list[float]) -> float:
    return float(function(values)) if values else np.nan
