"""The film of a report, on which its page draws the figure."""

from collections.abc import Iterator
from pathlib import Path

from tracker.clip.follow import Run
from tracker.progress import Progress
from tracker.report.drawing import followed
from videos.frames import Image
from videos.playable import Playable, copied, encoded


def write_film(finished: Run, path: Path, progress: Progress) -> Playable:
    """The part of the clip that was followed, nothing drawn on it: its own packets where browsers play it."""
    job, track, size = finished.job, finished.track, finished.size
    film = None if finished.mended else copied(job.video, path, track.first, track.times, size)
    if film is not None:
        return film
    with progress.task(f"{job.video.name} film", len(track)) as advance:

        def pictures() -> Iterator[tuple[Image, float]]:
            for frame, moment in followed(finished):
                yield frame.image, moment
                advance()

        return encoded(path, pictures(), finished.fps, size)
