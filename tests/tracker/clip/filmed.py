"""Painted films as files, the jobs that follow them, and what is seen of them."""

import numpy as np

from tests.tracker.clips import FPS, QUIET, write_table, write_video
from tests.tracker.outline.films import MIDDLE, WALKER
from tracker.clip.job import Job
from tracker.clip.outlines import look, outlined
from tracker.tables.keypoints import read_keypoints
from videos.frames import Video


def as_video(images, folder, fps=FPS):
    write_video(folder / "film.mp4", np.ascontiguousarray(images), fps=fps)
    return Video(folder / "film.mp4")


def written(folder, images, joints, frame=MIDDLE):
    """The job of a film of these images with its walker marked in a frame."""
    write_video(folder / "walk.mp4", np.ascontiguousarray(images))
    marks = zip(WALKER.joints, joints[frame], strict=True)
    write_table(folder / "walk.csv", [(frame, name, *place, 1) for name, place in marks])
    return Job(folder / "walk.mp4", read_keypoints(folder / "walk.csv"), model="cv", facing=1)


def as_seen(plan):
    """The plan with what its film shows."""
    return outlined(plan, look(plan, QUIET))


def away(points, walk):
    """By frame, the distances of its points from the walker's joints, leg lengths."""
    return {
        t: np.hypot(*(of.pixels - walk.joints[t][of.joint]).T) / walk.units[t] for t, of in points.items()
    }


def mean_away(points, walk):
    return np.mean(np.concatenate([*away(points, walk).values()]))
