"""What the page is told and what it may ask, without a word of HTTP."""

import base64
import shlex
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from queue import Empty, Queue
from threading import Lock
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from kinematics.figure import Figure, load_figure
from kinematics.recover import needed_joints
from tracker.annotate.advice import Advice, advise
from tracker.annotate.frames import Frames
from tracker.annotate.marks import Table
from tracker.clip.job import Facing, towards
from tracker.clip.start import facing_at
from tracker.foreign.start_marks import Taken
from tracker.tables.keypoints import KEYPOINTS, Mark, Marks

FARTHEST = 1e5  # pixels; nobody marks a joint beyond it

Reply = dict[str, Any]


def _known(name: str) -> str:
    if name not in KEYPOINTS:
        raise ValueError(f"unknown joint {name!r}; known are {', '.join(KEYPOINTS)}")
    return name


Coordinate = Annotated[float, Field(ge=-FARTHEST, le=FARTHEST, allow_inf_nan=False)]
Index = Annotated[int, Field(ge=0, le=10**8)]
Joint = Annotated[str, AfterValidator(_known)]


class Placed(BaseModel):
    """One joint as the page sends it."""

    model_config = ConfigDict(extra="forbid")

    x: Coordinate
    y: Coordinate
    visible: bool = True

    def mark(self) -> Mark:
        return Mark(self.x, self.y, self.visible)


class CheckRequest(BaseModel):
    """The marks of one frame, to be judged.

    facing : as it was said on the page, None where nothing was
    """

    model_config = ConfigDict(extra="forbid")

    frame: Index
    marks: dict[Joint, Placed]
    facing: Facing | None = None


class SaveRequest(BaseModel):
    """All marks of the frames that changed; a frame without any loses those it had.

    facing : as it was said on the page, None where nothing was
    frame  : that is shown
    close  : end the session, unless something is still wrong
    anyway : go on all the same
    """

    model_config = ConfigDict(extra="forbid")

    frames: dict[Index, dict[Joint, Placed]]
    facing: Facing | None = None
    frame: Index = 0
    close: bool = False
    anyway: bool = False


class Session:
    """One video, one table, and a page that is open on both.

    command : that opens it
    saved   : whether anything was saved
    """

    command = "annotate"

    def __init__(
        self, video: Path, table: Table, first: int, taken: Taken | None = None, facing: int | None = None
    ) -> None:
        """Open the video.

        Args:
            first: the frame that the page shows first.
            facing: +1 right, -1 left, None to see it from the marks.

        Raises:
            VideoError: the video cannot be read, or ends before `first`.
        """
        self.video, self.table, self.taken, self.facing = video, table, taken, facing
        self.saved = False
        self._frames = Frames(video)
        self._figure = load_figure()
        self._lock = Lock()
        self._asked: Queue[Callable[[], None]] = Queue()
        self._opening = self.frame(first)

    def start_from(self, taken: Taken) -> None:
        """Open with marks that nobody saved, at their frame; raises VideoError."""
        self.taken, self._opening = taken, self.frame(taken.frame)

    def opening(self) -> Reply:
        """What the page starts with."""
        taken = self.taken
        return {
            "command": self.command,
            "video": self.video.name,
            "table": str(self.table.path),
            "joints": _joints(self._figure),
            "marks": {frame: told(marks) for frame, marks in self.table.marks.items()},
            "frame": self._opening,
            "fps": self._frames.fps,
            "facing": self.facing and ("right" if self.facing > 0 else "left"),
            "taken": taken and {"frame": taken.frame, "marks": told(taken.marks), "told": taken.told},
        }

    def frame(self, index: int, *, quick: bool = False) -> Reply:
        """One frame, losslessly unless it is wanted `quick`; raises VideoError."""
        kind, data = ("jpeg", self._frames.jpeg(index)) if quick else ("png", self._frames.png(index))
        return {
            "index": index,
            "count": self._frames.count_hint,
            "width": self._frames.width,
            "height": self._frames.height,
            "image": f"data:image/{kind};base64,{base64.b64encode(data).decode('ascii')}",
            "figure": told(self._followed(index)),
        }

    def check(self, request: CheckRequest) -> Reply:
        """What is missing and what cannot be right."""
        marks = {name: placed.mark() for name, placed in request.marks.items()}
        facing = towards(request.facing) or self.facing
        return asdict(self._advise({**self.table.marks, request.frame: marks}, request.frame, facing))

    def save(self, request: SaveRequest) -> Reply:
        """Write the table; `closed` tells whether the session is over.

        Raises:
            FolderError, OSError: nothing was written.
        """
        changed = {
            frame: {name: placed.mark() for name, placed in marks.items()}
            for frame, marks in request.frames.items()
        }
        with self._lock:
            if changed or not self.table.marks:
                self.table.save(changed)
                self.saved = True
            self.facing = towards(request.facing) or self.facing
            wrong = self._wrong(set(changed) | {self._start()})
        closed = request.close and (request.anyway or not wrong)
        return {
            "saved": str(self.table.path),
            "frames": len(self.table.marks),
            "wrong": wrong,
            "closed": closed,
            "next": self.next_command(),
        }

    def next_command(self) -> str:
        """What to type in the terminal to follow the figure from the saved marks."""
        words = ["figtrack", "track", str(self.video), "--keypoints", str(self.table.path)]
        if self.facing is not None:
            words += ["--facing", "right" if self.facing > 0 else "left"]
        return shlex.join([*words, "--anchors"] if len(self.table.marks) > 1 else words)

    def work(self, seconds: float) -> None:
        """Do what the page has asked for that takes a while; wait for it so long."""
        with suppress(Empty):
            self._asked.get(timeout=seconds)()

    def _followed(self, index: int) -> Mapping[str, Mark]:
        """The figure as it was followed in a frame; of a film that is only marked, nothing."""
        return {}

    def _start(self) -> int:
        """The marked frame that tracking starts from."""
        return min(self.table.marks)

    def _wrong(self, frames: set[int]) -> list[str]:
        """What cannot be right in these frames, and what the first one, where tracking starts, lacks."""
        start, out = self._start(), []
        for frame in sorted(frames & self.table.marks.keys()):
            advice = self._advise(self.table.marks, frame, self.facing)
            lacks = [f"lacks {', '.join(advice.missing)}"] if advice.missing and frame == start else []
            out += [f"frame {frame}: {text}" for text in [*lacks, *advice.faults]]
        return out

    def _advise(self, marks: Marks, frame: int, facing: int | None) -> Advice:
        size = (self._frames.width, self._frames.height)
        return advise(self._figure, marks[frame], size, facing or facing_at(marks, frame))


def _joints(figure: Figure) -> list[Reply]:
    """The joints in the order they are marked in: where their limb comes from, its side, whether needed."""
    tips = {link.joint: link for link in figure.links}
    names = {link.name: link.joint for link in figure.links}
    needed = needed_joints(figure)
    out: list[Reply] = []
    for name in KEYPOINTS:
        link = tips.get(name)
        before = None if link is None else names.get(link.parent or "", figure.base)
        side = next((side for side in ("near", "far") if name.startswith(side)), "trunk")
        out.append({"name": name, "before": before, "side": side, "needed": name in needed})
    return out


def told(marks: Mapping[str, Mark]) -> Reply:
    """Marks as the page has them."""
    return {name: asdict(mark) for name, mark in marks.items()}
