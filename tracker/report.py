"""What a comparison shows: the table, the error plot, the sheet of frames where tracks part, the page."""

import base64
import html
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tracker.clip import Run
from tracker.compare import LOST_ERROR, Score, error_curve, parting
from tracker.drawing import paint
from videos.frames import Video
from videos.sheet import sheet

Image = NDArray[np.uint8]

COLUMNS = (
    "model",
    "lost at frame",
    "followed",
    "mean error",
    "median error",
    "within 0.2 leg",
    "swaps",
    "leg angles",
)
CROP = 1.1  # leg lengths of picture kept around the marked figure's hip, to either side


def table_rows(scores: Mapping[str, Score]) -> list[tuple[str, ...]]:
    """One row a model, in words; errors in leg lengths."""
    rows: list[tuple[str, ...]] = []
    for name, result in scores.items():
        lost = "never" if result.first_failure_frame is None else str(result.first_failure_frame)
        angle = "" if result.angle_median_deg is None else f"{result.angle_median_deg:.1f} deg"
        rows.append(
            (
                name,
                lost,
                f"{result.frames_followed} of {result.truth_frames}",
                f"{result.mean_error_leg:.3f}",
                f"{result.median_error_leg:.3f}",
                f"{100.0 * result.pck_02_leg:.0f} %",
                str(result.swaps),
                angle,
            )
        )
    return rows


def text_table(scores: Mapping[str, Score]) -> str:
    """The table as lines of text."""
    rows = [COLUMNS, *table_rows(scores)]
    widths = [max(len(row[i]) for row in rows) for i in range(len(COLUMNS))]
    lines = [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows
    ]
    return "\n".join(lines)


def write_error_plot(scores: Mapping[str, Score], path: Path) -> None:
    """Mean error of every marked frame against time, one line a model."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(7.0, 3.2), dpi=130, layout="constrained")
    for name, result in scores.items():
        frames, errors = error_curve(result)
        (line,) = axes.plot(frames, errors, marker="o", markersize=3, label=name)
        if result.first_failure_frame is not None:
            at = result.first_failure_frame
            axes.plot(at, result.frame_errors[at], marker="x", markersize=11, mew=2.5, color=line.get_color())
    axes.axhline(LOST_ERROR, color="0.6", linestyle="--", linewidth=1)
    axes.annotate(
        "lost above this", (0.0, LOST_ERROR), (3, 3), textcoords="offset points", color="0.4", fontsize=8
    )
    axes.set(xlabel="frame", ylabel="mean error, leg lengths", ylim=(0.0, None), xlim=(0.0, None))
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False)
    figure.savefig(path)
    pyplot.close(figure)


def sheet_frames(scores: Mapping[str, Score], count: int = 4) -> list[int]:
    """Marked frames that show where the tracks part: evenly up to the worst gap between best and worst."""
    ranked = sorted(scores.values(), key=lambda result: result.mean_error_leg)
    frames = sorted(ranked[0].frame_errors)
    worst = parting([ranked[0].frame_errors, ranked[-1].frame_errors]) if len(ranked) > 1 else frames[-1]
    upto = frames[: frames.index(worst) + 1] if worst in frames else frames
    after = frames[frames.index(upto[-1]) + 1 :]
    chosen = [upto[round(i)] for i in np.linspace(0, len(upto) - 1, min(count - bool(after), len(upto)))]
    return sorted(set(chosen) | set(after[-1:]))


def write_sheet(runs: Mapping[str, Run], scores: Mapping[str, Score], path: Path) -> None:
    """Each model's overlay, a row, at the frames where they part, a column."""
    import cv2

    frames = sheet_frames(scores)
    any_run = next(iter(runs.values()))
    shown = {frame.index: frame.image for frame in Video(any_run.job.video) if frame.index in frames}
    best = min(scores, key=lambda name: scores[name].mean_error_leg)
    rows = [
        [_cropped(paint(shown[t], finished.track, t), runs[best], t, shown[t].shape[0]) for t in frames]
        for finished in runs.values()
    ]
    labels = [f"{name}\n{scores[name].mean_error_leg:.3f} leg" for name in runs]
    picture = sheet(rows, labels, [f"frame {t}" for t in frames])
    cv2.imwrite(str(path), cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))


def write_page(
    title: str, runs: Mapping[str, Run], scores: Mapping[str, Score], folder: Path, notes: Sequence[str] = ()
) -> None:
    """report.html: one self-contained page with the overlays, the sheet, the plot and the table."""
    head = "".join(f"<th>{html.escape(column)}</th>" for column in COLUMNS)
    body = "".join(
        "<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>"
        for row in table_rows(scores)
    )
    clips = "".join(
        "<figure><video controls loop muted playsinline "
        f"src='{_embedded(folder / name / 'overlay.mp4', 'video/mp4')}'></video>"
        f"<figcaption>{html.escape(name)}</figcaption></figure>"
        for name in runs
    )
    warnings = [f"{name}: {text}" for name, finished in runs.items() for text in finished.warnings]
    said = "".join(f"<li>{html.escape(text)}</li>" for text in (*notes, *warnings))
    page = _PAGE.format(
        title=html.escape(title),
        head=head,
        body=body,
        clips=clips,
        notes=f"<ul>{said}</ul>" if said else "",
        sheet=_embedded(folder / "failure.png", "image/png"),
        errors=_embedded(folder / "errors.png", "image/png"),
    )
    (folder / "report.html").write_text(page, encoding="utf-8")


def _cropped(image: Image, reference: Run, frame: int, height: int) -> Image:
    """The drawn frame around where the reference track has the figure."""
    track = reference.track
    scale = len(image) // height
    t = int(np.clip(frame - track.first, 0, len(track) - 1))
    places = track.joints()[t]
    centre, unit = places.mean(axis=0) * scale, track.view.unit * scale
    H, W = image.shape[:2]
    half_w, half_h = min(CROP * unit, W / 2), min(1.35 * CROP * unit, H / 2)
    x = int(np.clip(centre[0] - half_w, 0, W - 2 * half_w))
    y = int(np.clip(centre[1] - half_h, 0, H - 2 * half_h))
    return image[y : y + int(2 * half_h), x : x + int(2 * half_w)]


def _embedded(path: Path, kind: str) -> str:
    return f"data:{kind};base64,{base64.b64encode(path.read_bytes()).decode('ascii')}"


_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>
:root {{ color-scheme: light dark; }}
body {{ font: 16px/1.5 system-ui, sans-serif; max-width: 72rem; margin: 0 auto; padding: 1rem; }}
.clips {{ display: grid; grid-template-columns: repeat(auto-fit, minmax(18rem, 1fr)); gap: 1rem; }}
figure {{ margin: 0; }} video, img {{ max-width: 100%; border-radius: 4px; }} img {{ background: white; }}
.wide {{ overflow-x: auto; }} table {{ border-collapse: collapse; white-space: nowrap; }}
th, td {{ text-align: left; padding: .3rem .9rem .3rem 0; border-bottom: 1px solid #8884; }}
</style></head><body>
<h1>{title}</h1>
<p>Errors are in leg lengths (thigh + shank) over head top, neck, hip, knees and ankles.
Near limbs are orange, far limbs blue; ellipses are two sigma.</p>
<div class="wide"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>
{notes}
<h2>Overlays</h2><div class="clips">{clips}</div>
<h2>Where they part</h2><img alt="Each model's overlay at the frames where they part" src="{sheet}">
<h2>Error against time</h2><img alt="Mean error of every marked frame" src="{errors}">
</body></html>
"""
