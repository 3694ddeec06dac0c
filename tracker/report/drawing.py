"""The films of a run: with the figure drawn on the clip, and bare for a page that draws it itself."""

from collections.abc import Iterator
from itertools import islice
from pathlib import Path

from kinematics.figure import Array, Figure
from kinematics.spm import View, skeleton
from tracker.clip.follow import Run
from tracker.loop.outcome import Outcome
from tracker.progress import Progress
from tracker.run.track import Track
from videos.frames import Frame, Image, Video
from videos.overlay import FAR, NEAR, TRUNK, Ellipse, Segment, draw
from videos.playable import Playable, copied, encoded
from videos.writer import Writer

SMALL = 300  # frames lower than this are drawn twice as large


def colours(figure: Figure) -> list[tuple[int, int, int]]:
    """One colour a link, by its layer: the farthest, those between, the nearest."""
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


def enlargement(height: int) -> int:
    """How many times a frame of this height is enlarged for drawing."""
    return 2 if height < SMALL else 1


def paint(image: Image, track: Track, frame: int, title: str = "") -> Image:
    """The frame with the figure drawn on it: limbs, joint ellipses at two sigma, state and frame number."""
    t = frame - track.first
    scale = enlargement(len(image))
    if not 0 <= t < len(track):
        return draw(image, caption=f"{title}frame {frame}: not tracked", scale=scale)
    now = slice(t, t + 1)  # a copy of the track for each frame would cost as much as the film is long
    (places,), (covs,) = track.joints(now), track.joint_covs(now)
    figure, shades = track.figure, colours(track.figure)
    ellipses = [Ellipse(places[i + 1], covs[i + 1], shades[i]) for i in by_layer(figure)]
    state = f"  {track.motions[t]}" if len(track.labels) > 1 else ""
    outcome = "" if track.outcome[t] is Outcome.OK else f"  {track.outcome[t]}"
    limbs = segments(figure, track.q[t], track.view_at(t))
    return draw(image, limbs, ellipses, f"{title}frame {frame}{state}{outcome}", scale=scale)


def write_overlay(finished: Run, path: Path, progress: Progress) -> None:
    """The part of the clip that was followed, with the figure drawn on every frame, from time 0 on."""
    job, track = finished.job, finished.track
    scale = enlargement(finished.size[1])
    width, height = finished.size
    drawing = progress.task(f"{job.video.name} overlay", len(track))
    with (
        drawing as advance,
        Writer(path, finished.fps, (width * scale, height * scale), quick=True) as writer,
    ):
        for frame, moment in followed(finished):
            writer.write(paint(frame.image, track, frame.index, f"{job.model}  "), moment)
            advance()


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


def followed(finished: Run) -> Iterator[tuple[Frame, float]]:
    """The frames that were followed, and when each comes after the first of them, seconds."""
    track = finished.track
    frames = islice(Video(finished.job.video), track.first, finished.frames)
    return zip(frames, (track.times - track.times[0]).tolist(), strict=True)
