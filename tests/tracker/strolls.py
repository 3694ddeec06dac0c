"""Walks made up for tests, whose every strike and leaving is known, variants of them, and their gait."""

from dataclasses import replace

import numpy as np

from kinematics.spm import UNMOVED, View
from tests.kinematics.figures import FOOTLESS, WALKER
from tracker.gait.figures import gait_of
from tracker.run.track import Track

PERIOD, DUTY = 1.1, 0.6
SWING = np.radians(28.0)  # greatest angle of a thigh


def stroll(
    seconds=6.0,
    *,
    fps=30.0,
    period=PERIOD,
    duty=DUTY,
    offset=0.5,
    start=0.3,
    swings=(SWING, SWING),
    sigma=0.002,
):
    """A track of a figure that walks to the right on straight legs.

    The near foot strikes at start, start + period .. seconds, the far foot offset * period later; either
    leaves the floor duty * period after its strike. The angles know nothing of frames.

    Args:
        sigma: standard deviation of every freedom.
    """
    times = np.arange(round(seconds * fps)) / fps
    q = np.zeros((len(times), len(WALKER.freedoms)))
    q[:, 0] = 1.2 * times
    for side, late, swing in zip(("near", "far"), (0.0, offset), swings, strict=True):
        phase = ((times - start) / period - late) % 1.0
        back, ahead = _eased(phase / duty, 0.15), _eased((phase - duty) / (1.0 - duty), 0.5)
        q[:, WALKER.index(f"hip_{side}")] = swing * (1.0 - 2.0 * np.where(phase < duty, back, 1.0 - ahead))
    return track_of(q, times, sigma)


def a_run(seconds=6.0):
    """Knees that bend far, a hip that is high while the feet are apart, and short stances."""
    track = stroll(seconds, period=0.75, duty=0.35)
    near, far = (angle_of(track, f"hip_{side}") for side in ("near", "far"))
    knees = {}
    for side, late in (("near", 0.0), ("far", 0.5)):
        phase = 2.0 * np.pi * ((track.times - 0.3) / 0.75 - late)
        knees[f"knee_{side}"] = np.radians(60.0 - 50.0 * np.cos(phase - 0.9 * np.pi))
    return replace(posed(track, root_y=0.05 * np.abs(near - far), **knees), labels=("run",))


def _eased(share, ramp):
    """0 to 1 at an even pace but for the ramps at either end, where it starts from and comes to rest."""
    grid = np.linspace(0.0, 1.0, 2001)
    pace = np.minimum(np.minimum(grid, 1.0 - grid) / ramp, 1.0)
    return np.interp(share, grid, np.cumsum(pace) / pace.sum())


def track_of(q, times, sigma=0.002):
    """A track of the walking figure in these poses, all in view."""
    T, D = q.shape
    return Track(
        figure=WALKER,
        view=View(origin=(100.0, 100.0), unit=80.0, facing=1),
        model="made-up",
        labels=("walk",),
        first=0,
        times=times,
        q=q,
        cov=np.tile(sigma**2 * np.eye(D), (T, 1, 1)),
        s=np.zeros(T, np.intp),
        motions=("walk",) * T,
        outcome=("ok",) * T,
        moved=np.tile(UNMOVED, (T, 1)),
        mark=0.02,
    )


def angle_of(track, name):
    """(T,) values of a freedom."""
    return track.q[:, track.figure.index(name)]


def posed(track, **freedoms):
    """The same track with other values of these freedoms."""
    q = track.q.copy()
    for name, values in freedoms.items():
        q[:, track.figure.index(name)] = values
    return replace(track, q=q)


def bend(track, share, width=0.1, strike=0.3):
    """(T,) radians that are greatest at a share of the stride of a foot that strikes then."""
    phase = ((track.times - strike) / PERIOD) % 1.0
    return np.exp(-(((phase - share) / width) ** 2))


def lost_in(track, *rows):
    """The same track, in these rows of which the figure was lost."""
    return replace(track, outcome=tuple("lost" if t in rows else "ok" for t in range(len(track))))


def footless(track):
    """The same track of a figure that ends at the ankles."""
    figure = FOOTLESS.with_lengths([link.length for link in track.figure.links[: len(FOOTLESS.links)]])
    kept = [track.figure.index(name) for name in figure.freedoms]
    return replace(track, figure=figure, q=track.q[:, kept], cov=track.cov[:, kept][:, :, kept])


def told(track, rate=1.0, known=None):
    return {measure.name: measure for measure in gait_of(track, rate, known).measures}
