"""The figure of a track drawn on the clip, and as numbers for pages that draw it on the plain film."""

from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinematics.figure import Array, Figure
from kinematics.spm import View, skeleton
from tracker.clip.follow import Run
from tracker.loop.outcome import Outcome
from tracker.progress import Progress
from tracker.run.track import Track, blocks
from videos.frames import Frame, Video
from videos.overlay import (
    FAR,
    FARTHEST,
    INK,
    NEAR,
    TRUNK,
    Ellipse,
    Segment,
    as_hex,
    draw,
    ellipse_axes,
    limbs,
)
from videos.playable import Playable, copied, encoded
from videos.upright import Image
from videos.writer import Writer

SWAY = 0.5  # seconds before and after over which the path of the view is averaged
SPAN = 90.0  # per cent of the frames in which all joints are within `reach`


def colours(figure: Figure) -> list[tuple[int, int, int]]:
    """One colour a link by its layer: farthest, between, nearest."""
    palette = {"far": FAR, "trunk": TRUNK, "near": NEAR}
    return [palette[depth] for depth in figure.depth]


def segments(figure: Figure, q: Array, view: View) -> list[Segment]:
    """Line segments of the links in a pose (D,), the farthest link first."""
    bones, shades, width = skeleton(figure, q), colours(figure), limb_width(view)
    starts, tips = view.to_pixels(bones.start), view.to_pixels(bones.tip)
    return [Segment(starts[i], tips[i], shades[i], width) for i in by_layer(figure)]


def limb_width(view: View) -> float:
    """Width of a drawn limb, pixels."""
    return max(view.unit / 30.0, 1.5)


def by_layer(figure: Figure) -> list[int]:
    """Positions of the links, the farthest first."""
    return sorted(range(len(figure.links)), key=lambda i: figure.links[i].layer)


def paint(image: Image, track: Track, frame: int, title: str = "") -> Image:
    """A followed frame with the figure drawn: limbs, two-sigma ellipses of joints, state and frame number."""
    t = frame - track.first
    now = slice(t, t + 1)  # one row; converting the whole track for each frame would take quadratic time
    (places,), (covs,) = track.joints(now), track.joint_covs(now)
    figure, shades = track.figure, colours(track.figure)
    ellipses = [Ellipse(places[i + 1], covs[i + 1], shades[i]) for i in by_layer(figure)]
    state = f"  {track.motions[t]}" if len(track.labels) > 1 else ""
    outcome = "" if track.outcome[t] is Outcome.OK else f"  {track.outcome[t]}"
    limbs = segments(figure, track.q[t], track.view_at(t))
    return draw(image, limbs, ellipses, f"{title}frame {frame}{state}{outcome}")


def write_overlay(finished: Run, path: Path, progress: Progress) -> None:
    """Write the followed part of the clip with the figure drawn on every frame, from time 0 on."""
    job, track = finished.job, finished.track
    with Writer(path, finished.fps, finished.size, quick=True) as writer:
        for frame, moment in progress.through(f"{job.video.name} overlay", followed(finished), len(track)):
            writer.write(paint(frame.image, track, frame.index, f"{job.model}  "), moment)


def write_film(finished: Run, path: Path, progress: Progress) -> Playable:
    """Write the followed part of the clip unchanged: its own packets if browsers play them, else encoded."""
    job, track, size = finished.job, finished.track, finished.size
    film = None if finished.mended else copied(job.video, path, track.first, track.times, size)
    if film is not None:
        return film
    shown = progress.through(f"{job.video.name} film", followed(finished), len(track))
    return encoded(path, ((frame.image, moment) for frame, moment in shown), finished.fps, size)


def followed(finished: Run) -> Iterator[tuple[Frame, float]]:
    """The followed frames, and the time of each after the first of them, seconds."""
    track = finished.track
    frames = islice(Video(finished.job.video), track.first, finished.frames)
    return zip(frames, (track.times - track.times[0]).tolist(), strict=True)


def figure_numbers(track: Track) -> dict[str, Any]:
    """Numbers of T frames for a page; arrays with a row a frame are in tenths, which is shorter.

    limbs    : in drawing order, each with its color and links [point, link]: from a point to the tip of the
               link, which is point 1 + link
    ink      : color around them; width: pixels of a limb
    points   : (T, 2 P) pixels of the film, x and y of the base, of every link's tip, and of the starts of
               links that begin elsewhere
    ellipses : (T, 3 L) for every link's tip: both radii at two standard deviations, and degrees clockwise
    centre   : (T, 2) centre of a view that follows the figure's base
    reach    : distance of joints from there, across and up
    """
    figure, shades = track.figure, colours(track.figure)
    order = by_layer(figure)
    starts, others = _starts(figure)
    drawn = zip(*(_drawn(track, rows, others) for rows in blocks(len(track))), strict=True)
    points, ellipses = map(np.concatenate, drawn)
    centre, reach = _sight(track, track.joints())
    return {
        "ink": as_hex(INK),
        "width": round(limb_width(track.view), 2),
        "limbs": [
            {"color": as_hex(shades[order[limb[0]]]), "links": [[starts[order[i]], order[i]] for i in limb]}
            for limb in limbs([shades[i] for i in order])
        ],
        "points": points,
        "ellipses": ellipses,
        "centre": _rows(centre),
        "reach": np.round(reach, 1).tolist(),
    }


def _drawn(track: Track, rows: slice, others: Sequence[int]) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Points and ellipses of some rows; `others` are links that begin within their parent."""
    begun = track.in_frames(skeleton(track.figure, track.q[rows]).start, rows)
    radii, angles = ellipse_axes(track.joint_covs(rows)[:, 1:])
    return (
        _rows(np.concatenate([track.joints(rows), begun[:, others]], axis=1)),
        _rows(np.concatenate([radii, angles[..., None]], axis=-1)),
    )


def _starts(figure: Figure) -> tuple[list[int], list[int]]:
    """The point at which each link begins, and the links that begin within their parent, in order."""
    starts: list[int] = []
    others: list[int] = []
    for i, (link, parent) in enumerate(zip(figure.links, figure.parents, strict=True)):
        if parent < 0:
            starts.append(0)
        elif link.at == 1.0:
            starts.append(1 + parent)
        else:
            starts.append(1 + len(figure.links) + len(others))
            others.append(i)
    return starts, others


def _sight(track: Track, places: Array) -> tuple[Array, Array]:
    """(T, 2) a smooth path near the figure's base, and (2,) the distance of its joints from there."""
    measured = track.measured if track.measured.any() else np.ones(len(track), bool)
    times, base = track.times, places[:, 0]
    known = [np.interp(times, times[measured], base[measured, k]) for k in range(2)]
    total = np.concatenate([np.zeros((1, 2)), np.cumsum(np.stack(known, axis=-1), axis=0)])
    # Equal numbers of frames before and after, fewer near the ends, where the view would otherwise lag.
    steps = np.arange(len(track))
    room = np.minimum(steps, steps[::-1])
    near = np.minimum(steps - np.searchsorted(times, times - SWAY), room)
    centre = (total[steps + near + 1] - total[steps - near]) / (2 * near + 1)[:, None]
    away = np.maximum(places.max(axis=1) - centre, centre - places.min(axis=1))
    return centre, np.percentile(away[measured], SPAN, axis=0)


def _rows(values: Array) -> NDArray[np.int32]:
    rows = np.clip(values, -FARTHEST, FARTHEST).reshape(len(values), -1)
    return np.rint(10.0 * rows).astype(np.int32)
