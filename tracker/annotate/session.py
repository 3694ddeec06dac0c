"""The data and requests of the marking page."""

import base64
import os
import shlex
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from http import HTTPStatus
from pathlib import Path
from queue import Empty, Queue
from threading import RLock
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BaseModel, Field

from kinematics.figure import Figure
from kinematics.figure_file import WALKER
from kinematics.recover import PoseError, start_pose
from tracker.annotate.frames import Frames
from tracker.annotate.loopback import RefusalError
from tracker.annotate.marks import Table
from tracker.clip.job import Facing, towards
from tracker.clip.start import facing_at, objections, outside
from tracker.run.folder import FolderError
from tracker.tables.keypoints import Mark, Marks, points

if TYPE_CHECKING:
    from tracker.foreign.start_marks import Taken

FARTHEST = 1e5  # largest coordinate of a joint, pixels
IN_APP = "FIGTRACK_APP"  # variable of the environment that figtrack app sets for its commands

Reply = dict[str, Any]

Coordinate = Annotated[float, Field(ge=-FARTHEST, le=FARTHEST, allow_inf_nan=False)]
Index = Annotated[int, Field(ge=0, le=10**8)]


class Placed(BaseModel, extra="forbid"):
    """One joint as the page sends it."""

    x: Coordinate
    y: Coordinate
    visible: bool = True


class MarksRequest(BaseModel, extra="forbid"):
    """All marks of the changed frames, or of one to be checked; a frame without any loses its marks.

    facing : as chosen on the page, None for no choice
    frame  : the frame on the page
    revision : of the marks that the page began with or last saved, None for any
    close  : whether to end the session, unless something is wrong
    anyway : whether to continue even if something is wrong
    """

    frames: dict[Index, dict[str, Placed]]
    facing: Facing | None = None
    frame: Index = 0
    revision: int | None = None
    close: bool = False
    anyway: bool = False


@dataclass(frozen=True)
class Advice:
    """The check of one frame.

    missing : required joints of a start frame that are not marked
    faults  : one line each
    faces   : "left" or "right", as tracking will use it; None if it cannot start
    """

    missing: tuple[str, ...]
    faults: tuple[str, ...]
    faces: str | None


class Session:
    """One video, its table, and the open page.

    command : that opens the page
    saved   : whether anything was saved
    revision : number of times that marks or facing changed here
    """

    command = "annotate"

    def __init__(
        self, video: Path, table: Table, first: int, facing: int | None = None, figure: str = "walker"
    ) -> None:
        """Open the video and show frame `first`; VideoError if it cannot be read or ends before.

        `facing` is +1 right, -1 left, None to find it from the marks; `figure` names the table's.
        """
        self.video, self.table, self.facing = video, table, facing
        self.taken: Taken | None = None
        self.saved, self.revision = False, 0
        self._frames = Frames(video)
        self._name, self._figure = figure, table.figure
        self._lock = RLock()
        self._asked: Queue[Callable[[], None]] = Queue()
        self._shown = self._readable(first)

    def start_from(self, taken: "Taken") -> None:
        """Show marks that are not saved yet, at their frame; raises VideoError."""
        self._shown = self._readable(taken.frame)
        self.taken = taken

    def opening(self) -> Reply:
        taken = self.taken
        return {
            "command": self.command,
            "video": self.video.name,
            "joints": _joints(self._figure),
            "base": self._figure.base,
            "marks": {frame: told(marks) for frame, marks in self.table.marks.items()},
            "frame": self.frame(self._shown),
            "fps": self._frames.fps,
            "facing": side(self.facing),
            "revision": self.revision,
            "where": "on the card of the film" if IN_APP in os.environ else "in the terminal",
            "taken": taken and {"frame": taken.frame, "marks": told(taken.marks), "told": taken.told},
        }

    def frame(self, index: int, *, quick: bool = False) -> Reply:
        """A frame, lossless or, if `quick`, small; raises VideoError."""
        kind, data = ("jpeg", self._frames.jpeg(index)) if quick else ("png", self._frames.png(index))
        return {
            "index": index,
            "count": self._frames.count_hint,
            "width": self._frames.width,
            "height": self._frames.height,
            "image": f"data:image/{kind};base64,{base64.b64encode(data).decode('ascii')}",
            "figure": told(self._followed(index)),
        }

    def check(self, request: MarksRequest) -> Reply:
        """The missing joints and the faults of the frame on the page; raises RefusalError."""
        marks = self._marks(request.frames.get(request.frame, {}))
        facing = towards(request.facing) or self.facing
        return asdict(self._advise({**self.table.marks, request.frame: marks}, request.frame, facing))

    def save(self, request: MarksRequest) -> Reply:
        """Write the table; `closed` says whether the session has ended. RefusalError, FolderError, OSError:
        nothing was written."""
        changed = {frame: self._marks(marks) for frame, marks in request.frames.items()}
        with self._lock:
            if request.revision not in (None, self.revision):
                raise FolderError(
                    "marks were saved in another tab meanwhile; reload this page and mark again"
                )
            if changed or not self.table.marks:
                self.table.save(changed)
                self.saved, self.taken = True, None  # else a reloaded page would show the suggestion again
            facing = towards(request.facing) or self.facing
            self.revision += bool(changed) or facing != self.facing
            self.facing = facing
            wrong = self._wrong(set(changed) | {self._start()})
        closed = request.close and (request.anyway or not wrong)
        return {
            "saved": str(self.table.path),
            "frames": len(self.table.marks),
            "wrong": wrong,
            "closed": closed,
            "revision": self.revision,
            "next": self.next_command(),
        }

    def follow(self, request: MarksRequest) -> Reply | None:
        """Save, and follow the figure again; None, without saving, if there is no run to correct."""
        return None

    def following(self) -> Reply | None:
        """Progress of following; None if there is no run to correct."""
        return None

    def next_command(self) -> str:
        """The command, or in the app the button, that follows the figure from the saved marks."""
        if IN_APP in os.environ:
            return "Follow" if self.facing is None else f"Follow, with Faces {side(self.facing)}"
        words = ["figtrack", "track", str(self.video), "--keypoints", str(self.table.path)]
        if self._figure != WALKER:
            words += ["--figure", self._name]
        if self.facing is not None:
            words += ["--facing", "right" if self.facing > 0 else "left"]
        return shlex.join([*words, "--anchors"] if len(self.table.marks) > 1 else words)

    def work(self, seconds: float) -> None:
        """Wait up to this time for long work from the page, and do it."""
        with suppress(Empty):
            self._asked.get(timeout=seconds)()

    def _readable(self, index: int) -> int:
        """The number of a frame; VideoError if it cannot be shown."""
        self._frames.png(index)
        return index

    def _marks(self, placed: Mapping[str, Placed]) -> dict[str, Mark]:
        for name in placed:
            if name not in self._figure.marks:
                known = ", ".join(self._figure.marks)
                raise RefusalError(HTTPStatus.BAD_REQUEST, f"unknown joint {name!r}; known are {known}")
        return {name: Mark(**each.model_dump()) for name, each in placed.items()}

    def _followed(self, index: int) -> Mapping[str, Mark]:
        """The tracked joints of a frame; none if there is no run to correct."""
        return {}

    def _start(self) -> int:
        """The marked frame from which tracking starts."""
        return min(self.table.marks)

    def _wrong(self, frames: set[int]) -> list[str]:
        """The faults of these frames, and the missing joints of the first one, where tracking starts."""
        start, out = self._start(), []
        for frame in sorted(frames & self.table.marks.keys()):
            advice = self._advise(self.table.marks, frame, self.facing)
            lacks = [f"lacks {', '.join(advice.missing)}"] if advice.missing and frame == start else []
            out += [f"frame {frame}: {text}" for text in [*lacks, *advice.faults]]
        return out

    def _advise(self, marks: Marks, frame: int, facing: int | None) -> Advice:
        size = (self._frames.width, self._frames.height)
        return advise(self._figure, marks[frame], size, facing or facing_at(marks, frame, self._figure))


def _joints(figure: Figure) -> list[Reply]:
    """The joints in the order of marking, with the start of their limb, its side, and whether required."""
    needed = figure.needed
    twins = dict(zip(figure.joints, (figure.joints[i] for i in figure.joint_twins), strict=True))
    return [
        {
            "name": name,
            "before": None if name == figure.base else _before(figure, figure.link_of(name)),
            "side": "trunk" if name == figure.base else figure.depth[figure.link_of(name)],
            "needed": name in needed,
            "twin": twins[name],
            "hint": figure.hints.get(name, ""),
        }
        for name in figure.marks
    ]


def _before(figure: Figure, i: int) -> str:
    """The next joint from the tip of link i towards the base that can be marked."""
    parent = figure.parents[i]
    while parent >= 0 and (figure.links[i].at < 0.5 or figure.links[parent].joint not in figure.marks):
        i, parent = parent, figure.parents[parent]
    return figure.base if parent < 0 else figure.links[parent].joint


def side(facing: int | None) -> str | None:
    """A facing in the form of the page's data."""
    return None if facing is None else ("right" if facing > 0 else "left")


def told(marks: Mapping[str, Mark]) -> Reply:
    """Marks in the form of the page's data."""
    return {name: asdict(mark) for name, mark in marks.items()}


def advise(figure: Figure, marks: Mapping[str, Mark], size: tuple[int, int], facing: int) -> Advice:
    """Check the marks of one frame, complete or not: all that `figtrack track` would refuse is listed.

    `size` is width and height of the picture in pixels, `facing` +1 right, -1 left.
    """
    places, faces = points(marks), None
    missing = tuple(name for name in figure.needed if name not in marks)
    wrong = [
        f"{name} lies outside the picture of {size[0]} x {size[1]} px; move it in, or delete it"
        for name in outside(marks, size)
    ] + objections(figure, places, facing, "choose Faces")
    if not missing:
        try:
            faces = start_pose(figure, places, facing).view.side
        except PoseError as error:
            wrong = [str(error), *wrong]
    return Advice(missing, tuple(wrong), faces)
