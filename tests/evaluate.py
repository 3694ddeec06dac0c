"""Write docs/results.md: every model on the open clips, and the grid that its settings were chosen from.

    python -m tests.evaluate CLIPS_FOLDER docs/results.md

Runs two clips at a time, about fifteen minutes on two cores. Every figure is that of `figtrack compare`
with the same settings, start frame 0 and the hand-marked keypoints as truth.
"""

import itertools
import subprocess
import sys
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from tracker.clip import Job, follow
from tracker.compare import Score, places, score
from tracker.keypoints import read_keypoints
from tracker.progress import Progress
from tracker.settings import Settings

MODELS = ("walk-run", "walk-run-1", "cv")
CLASSIC = ("walk-run", "cv")
CV_ANGLES = (2.0, 3.0, 4.0, 6.0)
CV_PLACES = (0.01, 0.02, 0.04, 0.06)
INFLATIONS = (2.0, 4.0, 6.0, 8.0)


@dataclass(frozen=True)
class Case:
    """One clip with one model and settings, smoothed or as each frame was first seen."""

    clip: Path
    model: str
    settings: Settings
    smooth: bool = True


def outcome(case: Case) -> Score:
    """Track the clip and score it."""
    marks = read_keypoints(case.clip.with_name(f"{case.clip.stem}.keypoints.csv"))
    job = Job(case.clip, marks, case.model, case.settings, start=0, stop=max(marks), smooth=case.smooth)
    return score(marks, places(follow(job, Progress("quiet")).track), 0)


def cell(result: Score) -> str:
    """A table cell: mean error, and where the track was lost."""
    lost = result.first_failure_frame
    swaps = f", {result.swaps} swaps" if result.swaps else ""
    return f"{result.mean_error_leg:.3f}" + ("" if lost is None else f" (lost at {lost}{swaps})")


def mean_error(results: Iterable[Score]) -> float:
    """Mean over clips of the mean error."""
    return float(np.mean([result.mean_error_leg for result in results]))


def main(folder: Path, out: Path) -> None:
    """Run everything and write the page."""
    clips = sorted(folder.glob("*.mp4"))
    variants = {
        **{name: (name, Settings()) for name in MODELS},
        **{f"{name}, filtered": (name, Settings(), False) for name in MODELS},
        **{f"{name}, classic": (name, Settings(mode="classic")) for name in CLASSIC},
    }
    grid = {
        **{
            ("cv", a, p): ("cv", Settings(cv_angle=a, cv_place=p))
            for a, p in itertools.product(CV_ANGLES, CV_PLACES)
        },
        **{(name, i): (name, Settings(inflation=i)) for name in MODELS[:2] for i in INFLATIONS},
    }
    wanted = {**variants, **grid}
    cases = [Case(clip, *variant) for variant in wanted.values() for clip in clips]
    with ProcessPoolExecutor(2) as pool:
        scores = list(pool.map(outcome, cases))
    rows = {key: scores[i * len(clips) : (i + 1) * len(clips)] for i, key in enumerate(wanted)}
    out.write_text(page(clips, {name: rows[name] for name in variants}, rows), encoding="utf-8")


def page(clips: list[Path], variants: dict[str, list[Score]], rows: dict[object, list[Score]]) -> str:
    """The Markdown text."""
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=False
    )
    lines = [
        "# Results on the open clips",
        "",
        f"Written by `make evaluate` at commit {commit.stdout.strip()} on {datetime.now(UTC):%Y-%m-%d},",
        "with the default settings for every clip.",
        "One clip alone: `figtrack compare CLIP.mp4 --keypoints CLIP.keypoints.csv --start 0`.",
        "",
        "Mean error over head top, neck, hip, knees and ankles in all hand-marked frames after frame 0, in",
        "leg lengths (thigh + shank), each error at most 1. Marks repeat to about 0.02. A clip is lost at",
        "the first of two marked frames in a row whose mean error is over 0.25, not recovered in the third.",
        "Poses are smoothed over the clip; `filtered` ones are as each frame was first seen.",
        "`classic` is the papers' registration: grey templates of frame 0, no prior in the climb.",
        "",
        "| clip | " + " | ".join(variants) + " |",
        "|---" * (len(variants) + 1) + "|",
    ]
    for i, clip in enumerate(clips):
        lines.append(
            f"| {clip.stem} | " + " | ".join(cell(results[i]) for results in variants.values()) + " |"
        )
    lines.append("| **mean** | " + " | ".join(f"{mean_error(r):.3f}" for r in variants.values()) + " |")
    medians = (np.median([x.mean_error_leg for x in r]) for r in variants.values())
    lines.append("| **median of the clips' means** | " + " | ".join(f"{m:.3f}" for m in medians) + " |")
    points = (np.median([x.median_error_leg for x in r]) for r in variants.values())
    lines.append(
        "| **median of the clips' median errors** | " + " | ".join(f"{m:.3f}" for m in points) + " |"
    )
    degrees = (np.mean([x.angle_median_deg or 0.0 for x in r]) for r in variants.values())
    lines.append("| **leg directions, degrees** | " + " | ".join(f"{m:.1f}" for m in degrees) + " |")
    followed = (sum(x.first_failure_frame is None for x in r) for r in variants.values())
    lines.append("| **never lost** | " + " | ".join(f"{n} of {len(clips)}" for n in followed) + " |")
    best = min(mean_error(r) for key, r in rows.items() if isinstance(key, tuple) and key[0] == "cv")
    share = mean_error(variants["walk-run"]) / min(best, mean_error(variants["cv"]))
    lines += [
        "",
        f"The mean error of walk-run is {share:.2f} of that of constant velocity at its best noise.",
        "",
        "## How the noise was chosen",
        "",
        "By the mean over these clips, for all models alike. Constant velocity: change of an angle's speed",
        "a frame (rows, degrees) against change of the root's speed a frame (columns, leg lengths).",
        "",
        "| | " + " | ".join(f"{p:g}" for p in CV_PLACES) + " |",
        "|---" * (len(CV_PLACES) + 1) + "|",
    ]
    for a in CV_ANGLES:
        lines.append(
            f"| {a:g} | " + " | ".join(f"{mean_error(rows['cv', a, p]):.3f}" for p in CV_PLACES) + " |"
        )
    lines += [
        "",
        "Learned models: factor on the learned noise Q (`inflation`).",
        "",
        "| | " + " | ".join(f"{i:g}" for i in INFLATIONS) + " |",
        "|---" * (len(INFLATIONS) + 1) + "|",
    ]
    for name in MODELS[:2]:
        lines.append(
            f"| {name} | " + " | ".join(f"{mean_error(rows[name, i]):.3f}" for i in INFLATIONS) + " |"
        )
    return "\n".join([*lines, ""])


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
