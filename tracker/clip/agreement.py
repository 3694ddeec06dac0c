"""A finished track compared with the outline of its figure.

The templates carry the errors of the start marks through the film, and the outline has errors of its own that
are the same in all frames. Their constant difference is shared between both by their variances.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from dynamics.gaussian import Array
from kinematics.spm import joint_jacobian, joints
from tracker.clip.plan import Plan
from tracker.loop.detections import Detections, Detector
from tracker.often import crowded
from tracker.run.track import Track, blocks

MARKED, FOUND = 7 / 3, 1.0  # variance of the outline's constant error over that of a marked or found start
FEWEST = 10  # frames in which a joint must be seen
FAR = 0.09  # rms difference of the joints beyond which the outline is not believed, leg lengths
RIDGE = 0.01  # prior variance of the error of a joint over that of a freedom, leg lengths and radians


def agreed(plan: Plan, track: Track) -> Track:
    """The smoothed track less its share of the constant difference from the outline, and with covariances
    enlarged, in place, where the two differ; the same track where no outline was seen."""
    outline = {} if plan.measured else plan.seen.points
    if plan.job.smooth:
        number, found = len(plan.job.passed(plan.frame)), plan.job.found is not None
        share = 1.0 / (1.0 + MARKED * (number - found) + FOUND * found)
        track = replace(track, q=track.q + share * constant_difference(track, outline))
    _enlarge(plan, track, outline)
    return track


def constant_difference(track: Track, outline: Mapping[int, Detections]) -> Array:
    """(D,) difference of the pose that leads from a track's joints to those of the outline.

    It is the ridge regression, on the mean derivatives of the joints, of the medians of their differences; no
    difference if these are greater than errors of marks are, as the outline is then wrong.
    """
    apart = _apart(track, outline)
    known = np.asarray(np.isfinite(apart).all(-1))
    often = known.sum(0) >= FEWEST
    if not often.any():
        return np.zeros(track.q.shape[1])
    middle = np.nanmedian(apart[:, often], axis=0)
    if (middle**2).sum(-1).mean() > FAR**2:
        return np.zeros(track.q.shape[1])
    J = np.zeros((len(often), 2, track.q.shape[1]))
    for some in blocks(len(track)):
        J += np.einsum("tj,tjad->jad", known[some], joint_jacobian(track.figure, track.q[some]))
    J = (J[often] / known.sum(0)[often, None, None]).reshape(-1, J.shape[-1])
    return np.linalg.solve(J.T @ J + RIDGE * np.eye(J.shape[1]), J.T @ middle.ravel())


def _apart(track: Track, outline: Mapping[int, Detections]) -> Array:
    """(T, J, 2) outline's joints less the track's, leg lengths; NaN where one of them is not seen."""
    apart = np.full((len(track), len(track.figure.joints), 2), np.nan)
    for t in np.flatnonzero(track.measured).tolist():
        found = outline.get(track.first + t)
        if found is not None:
            apart[t, found.joint] = track.view_at(t).to_body(found.pixels)
    for some in blocks(len(track)):
        apart[some] -= joints(track.figure, track.q[some])
    return apart


def _enlarge(plan: Plan, track: Track, outline: Mapping[int, Detections]) -> None:
    """Enlarge covariances where the outline shows the figure elsewhere, but not in corrected frames, through
    whose marks the track passes."""
    crowd, anchors = crowded(plan.video.fps), plan.job.passed(plan.frame).keys() - {plan.frame}
    for t, q in enumerate(track.q):
        found = None if track.first + t in anchors else outline.get(track.first + t)
        if found is not None:
            detector = Detector(track.figure, track.view_at(t), plan.tracker.settings, found.doubt / crowd)
            track.cov[t] += detector.elsewhere(found, q)
