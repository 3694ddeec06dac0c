"""The figure of a track in numbers, as the page draws it on the film: links, ellipses, where to look."""

from typing import Any

import numpy as np

from kinematics.figure import Array, Figure
from kinematics.spm import skeleton
from tracker.report.drawing import by_layer, colours, limb_width
from tracker.run.track import Track
from videos.overlay import FARTHEST, INK, as_hex, ellipse_axes, limbs

SWAY = 0.5  # seconds to either side over which the way of the view is a mean
SPAN = 90.0  # per cent of the frames in which every joint is within `reach`


def figure_numbers(track: Track) -> dict[str, Any]:
    """Numbers of T frames, as JSON can hold them; those of a row a frame in tenths, which is shorter.

    limbs    : in the order they are drawn, each its color and links [point, link]: from a point to the tip of
               the link, which is point 1 + link
    ink      : color around them; width: pixels of a limb
    points   : (T, 2 P) pixels of the film, x and y of the base, of every link's tip, and of where links begin
               that begin elsewhere
    ellipses : (T, 3 L) of every link's tip: both radii at two standard deviations, and degrees clockwise
    centre   : (T, 2) where to look to have the figure's base in the middle
    reach    : how far from there its joints are, across and up
    """
    figure, shades = track.figure, colours(track.figure)
    order = by_layer(figure)
    starts, others = _starts(figure)
    places = track.joints()
    begun = track.view.to_pixels(skeleton(figure, track.q).start) + track.shift[:, None]
    radii, angles = ellipse_axes(track.joint_covs()[:, 1:])
    centre, reach = _sight(track, places)
    return {
        "ink": as_hex(INK),
        "width": round(limb_width(track.view), 2),
        "limbs": [
            {"color": as_hex(shades[order[limb[0]]]), "links": [[starts[order[i]], order[i]] for i in limb]}
            for limb in limbs([shades[i] for i in order])
        ],
        "points": _rows(np.concatenate([places, begun[:, others]], axis=1)),
        "ellipses": _rows(np.concatenate([radii, angles[..., None]], axis=-1)),
        "centre": _rows(centre),
        "reach": np.round(reach, 1).tolist(),
    }


def _starts(figure: Figure) -> tuple[list[int], list[int]]:
    """The point that each link begins at, and the links that begin within their parent, in their order."""
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
    """(T, 2) a calm way along the figure's base, and (2,) how far its joints are from there."""
    measured = track.measured if track.measured.any() else np.ones(len(track), bool)
    times, base = track.times, places[:, 0]
    known = [np.interp(times, times[measured], base[measured, k]) for k in range(2)]
    total = np.concatenate([np.zeros((1, 2)), np.cumsum(np.stack(known, axis=-1), axis=0)])
    # As many frames to either side, fewer near the ends, or the view would lag behind there.
    steps = np.arange(len(track))
    room = np.minimum(steps, steps[::-1])
    near = np.minimum(steps - np.searchsorted(times, times - SWAY), room)
    centre = (total[steps + near + 1] - total[steps - near]) / (2 * near + 1)[:, None]
    away = np.abs(places[measured] - centre[measured, None]).max(axis=1)
    return centre, np.percentile(away, SPAN, axis=0)


def _rows(values: Array) -> list[list[int]]:
    rows = np.clip(values, -FARTHEST, FARTHEST).reshape(len(values), -1)
    return np.rint(10.0 * rows).astype(int).tolist()  # type: ignore[no-any-return]
