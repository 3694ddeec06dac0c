"""The pictures of a comparison: errors against time, and the sheet of frames where tracks part."""

from collections.abc import Mapping
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from tracker.report.drawing import paint
from tracker.run.score import LOST_ERROR, Score
from tracker.run.track import Track
from videos.frames import Video, images_of
from videos.upright import Image

DPI = 130
SHOWN = 4  # largest number of frames
GAP, LABEL = 0.1, 0.5  # space around pictures, and beside them for the rows' labels, inches
CROP = 1.1  # width kept on either side of the middle of the tracked joints, leg lengths
matplotlib.rcParams["text.parse_math"] = False  # names may have a $ in them


def write_error_plot(scores: Mapping[str, Score], path: Path) -> None:
    """Plot the mean error of every marked frame against time, one line a model."""
    figure = Figure(figsize=(7.0, 3.2), dpi=DPI, layout="constrained")
    axes = figure.subplots()
    lines = []
    for result in scores.values():
        frames, errors = list(result.frame_errors), list(result.frame_errors.values())
        (line,) = axes.plot(frames, errors, marker="o", markersize=3)
        lines.append(line)
        if result.first_failure_frame is not None:
            at = result.first_failure_frame
            axes.plot(at, result.frame_errors[at], marker="x", markersize=11, mew=2.5, color=line.get_color())
    axes.axhline(LOST_ERROR, color="0.6", linestyle="--", linewidth=1)
    axes.annotate(
        "lost above this", (0.0, LOST_ERROR), (3, 3), textcoords="offset points", color="0.4", fontsize=8
    )
    axes.set(xlabel="frame", ylabel="mean error, leg lengths", ylim=(0.0, None), xlim=(0.0, None))
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(lines, list(scores), frameon=False)  # a name may begin with _, which a label may not
    figure.savefig(path)


def sheet_frames(scores: Mapping[str, Score]) -> list[int]:
    """Marked frames that show how the tracks part: evenly up to the largest difference of best and worst."""
    ranked = sorted(scores.values(), key=lambda result: result.mean_error_leg)
    best, worst = ranked[0].frame_errors, ranked[-1].frame_errors
    frames = sorted(best)
    differ = [round(abs(best[frame] - worst[frame]), 12) for frame in frames]
    parting = 1 + (int(np.argmax(differ)) if len(ranked) > 1 else len(frames) - 1)
    upto, after = frames[:parting], frames[parting:]
    chosen = [upto[round(i)] for i in np.linspace(0, len(upto) - 1, min(SHOWN - bool(after), len(upto)))]
    return sorted(set(chosen) | set(after[-1:]))


def write_sheet(video: Path, tracks: Mapping[str, Track], scores: Mapping[str, Score], path: Path) -> None:
    """Write a picture: a row for each model's overlay, a column for each frame where the tracks part."""
    frames = sheet_frames(scores)
    shown = images_of(Video(video), frames)
    best = min(scores, key=lambda name: scores[name].mean_error_leg)
    images = [
        _cropped(paint(shown[t], track, t), tracks[best], t) for track in tracks.values() for t in frames
    ]
    height, width = np.max([image.shape[:2] for image in images], axis=0) / DPI + GAP
    size = width * len(frames) + LABEL, height * len(tracks) + GAP
    figure = Figure(figsize=size, dpi=DPI, layout="constrained")
    grid = figure.subplots(len(tracks), len(frames), squeeze=False)
    for axes, image in zip(grid.ravel(), images, strict=True):
        axes.imshow(image)
        axes.set(xticks=[], yticks=[], frame_on=False)
    for axes, t in zip(grid[0], frames, strict=True):
        axes.set_title(f"frame {t}", fontsize="medium")
    for axes, name in zip(grid[:, 0], tracks, strict=True):
        axes.set_ylabel(f"{name}\n{scores[name].mean_error_leg:.3f} leg")
    figure.savefig(path)


def _cropped(image: Image, reference: Track, frame: int) -> Image:
    """The drawn frame cropped around the figure of the reference track."""
    places = reference.joints()[frame - reference.first]
    centre, unit = places.mean(axis=0), reference.view.unit
    H, W = image.shape[:2]
    half_w, half_h = min(CROP * unit, W / 2), min(1.35 * CROP * unit, H / 2)
    x = int(np.clip(centre[0] - half_w, 0, W - 2 * half_w))
    y = int(np.clip(centre[1] - half_h, 0, H - 2 * half_h))
    return image[y : y + int(2 * half_h), x : x + int(2 * half_w)]
