"""The Python face: a clip followed in one call, arrays back, nothing written.

Whatever is slow to import is imported by the call, so that `import tracker` costs nothing.
"""

import warnings
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from tracker.run.track import Track
    from tracker.settings import Settings

FACING = {None: None, "left": -1, "right": 1}

Place = str | PathLike[str]


def follow(
    video: Place,
    keypoints: Place,
    *,
    model: str = "walk-run",
    start: int | None = None,
    stop: int | None = None,
    facing: Literal["left", "right"] | None = None,
    rate: float | None = None,
    smooth: bool = True,
    anchors: bool = False,
    settings: "Settings | Place | None" = None,
    progress: Literal["auto", "bar", "plain", "json", "quiet"] = "quiet",
) -> "Track":
    """Follow the figure marked in one frame through the whole clip, as `figtrack track` does.

    What the command warns of is a Python warning.

    Args:
        video: a file, or a folder of numbered images.
        keypoints: table of marked joints, `frame,keypoint,x,y,visible`, pixels.
        model: "cv", a shipped model's name or a file from `figtrack learn`.
        start: the marked frame to start from; None for the first.
        stop: the last frame to follow; None for the clip's last.
        facing: which way the figure faces; None to see it from the marks.
        rate: playback speed, 0.5 for slow motion at half speed; None to find it.
        smooth: poses given the whole clip; False for what was known at each frame.
        anchors: pass through every marked frame, not the start alone.
        settings: the tracker's, or a TOML file of them; None for the defaults.
        progress: how it is shown on stderr.

    Returns:
        A row for each of the T frames from 0 on: `joints()` (T, J, 2) and `joint_covs()` (T, J, 2, 2) in
        pixels, named by `figure.joints`; the pose `q` (T, D) in leg lengths and radians and its `cov`
        (T, D, D), named by `figure.freedoms`; `times` (T,) in seconds, `outcome` and switching state `s`.

    Raises:
        VideoError, ModelError: a file that cannot be used.
        ValueError: marks, settings or options that cannot be used, or no pose to start from.
    """
    from tracker.clip.follow import Job
    from tracker.clip.follow import follow as follow_clip
    from tracker.progress import Progress
    from tracker.settings import Settings, read_settings
    from tracker.tables.keypoints import read_keypoints

    if facing not in FACING:
        raise ValueError(f"facing must be 'left', 'right' or None; got {facing!r}")
    if settings is None:
        settings = Settings()
    elif not isinstance(settings, Settings):
        settings = read_settings(Path(settings))
    job = Job(
        video=Path(video),
        marks=read_keypoints(Path(keypoints)),
        model=str(model),
        settings=settings,
        start=start,
        stop=stop,
        facing=FACING[facing],
        rate=rate,
        smooth=smooth,
        anchors=anchors,
    )
    run = follow_clip(job, Progress(progress))
    for warning in run.warnings:
        warnings.warn(warning, stacklevel=2)
    return run.track
