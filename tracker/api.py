"""The Python interface: a call follows a clip and returns arrays; nothing is written.

Slow imports happen in the call, so that `import tracker` is fast.
"""

import re
import warnings
from dataclasses import fields
from difflib import get_close_matches
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from tracker.run.track import Track
    from tracker.settings import Settings

Place = str | PathLike[str]
# An option of the command and its value; not within quotes, where a whole command stands, nor within a name.
OPTION = re.compile(r"(?<!\w)('[^']*')|(?<![\w-])--([a-z]+)(?: (ahead|behind))?")


def follow(
    video: Place,
    keypoints: Place | None = None,
    *,
    settings: "Settings | Place | None" = None,
    progress: Literal["auto", "bar", "plain", "json", "quiet"] = "quiet",
    **options: Any,
) -> "Track":
    """Follow the walker, or the figure marked in one frame, through the whole clip, as `figtrack track` does.

    Warnings of the command become Python warnings.

    Args:
        video: a file, or a folder of numbered images.
        keypoints: table of marked joints, `frame,keypoint,x,y,visible`, pixels, or a file of another
            supported program; None to find the walker.
        settings: the tracker's, or a TOML file of them; None for the defaults.
        progress: how it is shown on stderr.
        options: the command's, as in `tracker.clip.job.Following`: `figure`, `model`, `start`, `from_`,
            `stop`, `facing`, `person`, `near`, `anchors`, `measure`, `templates`, `rate`, `height`, `scale`
            and `smooth`.

    Returns:
        A track with a row for each of the T frames from 0, or `from_`, on: `joints()` (T, J, 2) and
        `joint_covs()` (T, J, 2, 2) in pixels, named by `figure.joints`; the pose `q` (T, D) in leg lengths
        and radians and its `cov` (T, D, D), named by `figure.freedoms`; `times` (T,) in seconds, `outcome`
        and switching state `s`.

    Raises:
        VideoError, ModelError: a file that cannot be used.
        ValueError: marks, settings or options that cannot be used, or no pose to start from.
        TypeError: no option of that name.
    """
    from tracker.clip.asked import asked
    from tracker.clip.follow import follow as follow_clip
    from tracker.clip.job import Following
    from tracker.progress import Progress
    from tracker.settings import Settings

    marks, shown = None if keypoints is None else Path(keypoints), Progress(progress)
    chosen = settings if isinstance(settings, Settings) else None
    file = Path(settings) if isinstance(settings, (str, PathLike)) else None
    _check_names(options, [field.name for field in fields(Following)])
    try:
        run = follow_clip(
            asked(Following(settings=file, **options), Path(video), marks, chosen, shown), shown
        )
    except Exception as error:
        error.args = tuple(map(_by_keywords, error.args))
        raise
    for warning in run.warnings:
        warnings.warn(_by_keywords(warning), stacklevel=2)
    return run.track


def _check_names(options: dict[str, Any], known: list[str]) -> None:
    for name in options:
        if name not in known:
            near = ", ".join(get_close_matches(name, known) or known)
            raise TypeError(f"follow() has no option {name!r}; choose from {near}")


def _by_keywords(said: Any) -> Any:
    """A message that names keywords of `follow` instead of the command's options."""
    if not isinstance(said, str):
        return said

    def keyword(found: re.Match[str]) -> str:
        quoted, name, value = found.groups()
        return quoted or {"from": "from_"}.get(name, name) + (f"={value!r}" if value else "")

    return OPTION.sub(keyword, said)
