"""A track at equal times: shares of strides, peaks and paths around a moment are counted in its rows."""

from dataclasses import replace

import numpy as np

from tracker.run.track import Track

EVEN = 0.1  # largest distance of a frame from its place at equal times, frames
USUAL = 25  # percentile of the times between frames that is taken for all
MOST = 4  # rows for each frame of the film at most


def evened(track: Track) -> Track:
    """The track at equal times, its first row called frame 0; itself if its own times are equal.

    Poses in between are interpolated, and measured where the film's frames on both sides are.
    """
    if len(track) < 3:
        return track
    rows, steps = np.arange(len(track)), np.diff(track.times)
    equal = np.linspace(track.times[0], track.times[-1], len(track))
    if np.abs(track.times - equal).max() < EVEN * steps.mean():
        return track
    step = max(float(np.percentile(steps, USUAL)), float(np.ptp(track.times)) / (MOST * len(track)))
    times = np.arange(track.times[0], track.times[-1] + 0.01 * step, step)
    at = np.interp(times, track.times, rows).round(6)
    before, after = np.floor(at).astype(np.intp), np.ceil(at).astype(np.intp)
    on, of = (at - before)[:, None], np.where(track.measured[before], after, before)
    return replace(
        track,
        first=0,
        times=times,
        q=(1.0 - on) * track.q[before] + on * track.q[after],
        cov=track.cov[of],
        s=track.s[of],
        motions=tuple(track.motions[t] for t in of),
        outcome=tuple(track.outcome[t] for t in of),
        moved=(1.0 - on) * track.moved[before] + on * track.moved[after],
    )
