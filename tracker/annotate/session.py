"""What the page is told and what it may ask, without a word of HTTP."""

import base64
import shlex
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from queue import Empty, Queue
from threading import Lock
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BaseModel, Field

from kinematics.figure import Figure
from kinematics.figure_file import WALKER
from kinematics.recover import PoseError, needed_joints, start_pose
from tracker.annotate.frames import Frames
from tracker.annotate.marks import Table
from tracker.clip.job import Facing, towards
from tracker.clip.start import facing_at, objections, outside
from tracker.tables.keypoints import Mark, Marks, points

if TYPE_CHECKING:
    from tracker.foreign.start_marks import Taken

FARTHEST = 1e5  # pixels; nobody marks a joint beyond it

Reply = dict[str, Any]

Coordinate = Annotated[float, Field(ge=-FARTHEST, le=FARTHEST, allow_inf_nan=False)]
Index = Annotated[int, Field(ge=0, le=10**8)]


class Placed(BaseModel, extra="forbid"):
    """One joint as the page sends it."""

    x: Coordinate
    y: Coordinate
    visible: bool = True


class CheckRequest(BaseModel, extra="forbid"):
    """The marks of one frame, to be judged.

    facing : as it was said on the page, None where nothing was
    """

    frame: Index
    marks: dict[str, Placed]
    facing: Facing | None = None


class SaveRequest(BaseModel, extra="forbid"):
    """All marks of the frames that changed; a frame without any loses those it had.

    facing : as it was said on the page, None where nothing was
    frame  : that is shown
    close  : end the session, unless something is still wrong
    anyway : go on all the same
    """

    frames: dict[Index, dict[str, Placed]]
    facing: Facing | None = None
    frame: Index = 0
    close: bool = False
    anyway: bool = False


@dataclass(frozen=True)
class Advice:
    """The judgement of one frame.

    missing : joints that a start frame needs and that are not marked
    faults  : what cannot be right, one line each
    faces   : "left" or "right", as tracking will take it; None where it cannot start
    """

    missing: tuple[str, ...]
    faults: tuple[str, ...]
    faces: str | None


class UnknownJointError(ValueError):
    """A joint that the figure has not."""


class Session:
    """One video, one table, and a page that is open on both.

    command : that opens it
    saved   : whether anything was saved
    """

    command = "annotate"

    def __init__(
        self,
        video: Path,
        table: Table,
        first: int,
        taken: "Taken | None" = None,
        facing: int | None = None,
        figure: str = "walker",
    ) -> None:
        """Open the video, whose frame `first` is shown; VideoError if it cannot be read or ends before.

        Args:
            facing: +1 right, -1 left, None to see it from the marks.
            figure: by which the video is to be followed; the table's is the same.
        """
        self.video, self.table, self.taken, self.facing = video, table, taken, facing
        self.saved = False
        self._frames = Frames(video)
        self._name, self._figure = figure, table.figure
        self._lock = Lock()
        self._asked: Queue[Callable[[], None]] = Queue()
        self._opening = self.frame(first)

    def start_from(self, taken: "Taken") -> None:
        """Open with marks that nobody saved, at their frame; raises VideoError."""
        self.taken, self._opening = taken, self.frame(taken.frame)

    def opening(self) -> Reply:
        taken = self.taken
        return {
            "command": self.command,
            "video": self.video.name,
            "joints": _joints(self._figure),
            "base": self._figure.base,
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
        """What is missing and what cannot be right; raises UnknownJointError."""
        marks = self._marks(request.marks)
        facing = towards(request.facing) or self.facing
        return asdict(self._advise({**self.table.marks, request.frame: marks}, request.frame, facing))

    def save(self, request: SaveRequest) -> Reply:
        """Write the table; `closed` tells whether the session is over. UnknownJointError, FolderError,
        OSError: nothing was written."""
        changed = {frame: self._marks(marks) for frame, marks in request.frames.items()}
        with self._lock:
            if changed or not self.table.marks:
                self.table.save(changed)
                self.saved, self.taken = True, None  # or a page opened anew would have those again
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

    def follow(self, request: SaveRequest) -> Reply | None:
        """Save, and follow the figure again; None of a film that is only marked, where nothing is done."""
        return None

    def following(self) -> Reply | None:
        """How far following has come; None of a film that is only marked."""
        return None

    def next_command(self) -> str:
        """What to type in the terminal to follow the figure from the saved marks."""
        words = ["figtrack", "track", str(self.video), "--keypoints", str(self.table.path)]
        if self._figure != WALKER:
            words += ["--figure", self._name]
        if self.facing is not None:
            words += ["--facing", "right" if self.facing > 0 else "left"]
        return shlex.join([*words, "--anchors"] if len(self.table.marks) > 1 else words)

    def work(self, seconds: float) -> None:
        """Do what the page has asked for that takes a while; wait for it so long."""
        with suppress(Empty):
            self._asked.get(timeout=seconds)()

    def _marks(self, placed: Mapping[str, Placed]) -> dict[str, Mark]:
        for name in placed:
            if name not in self._figure.marks:
                known = ", ".join(self._figure.marks)
                raise UnknownJointError(f"unknown joint {name!r}; known are {known}")
        return {name: Mark(**each.model_dump()) for name, each in placed.items()}

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
        return advise(self._figure, marks[frame], size, facing or facing_at(marks, frame, self._figure))


def _joints(figure: Figure) -> list[Reply]:
    """The joints in the order they are marked in: where their limb comes from, its side, whether needed."""
    needed = needed_joints(figure)
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
    """The nearest joint towards the base from link i's own that is marked."""
    parent = figure.parents[i]
    while parent >= 0 and (figure.links[i].at < 0.5 or figure.links[parent].joint not in figure.marks):
        i, parent = parent, figure.parents[parent]
    return figure.base if parent < 0 else figure.links[parent].joint


def told(marks: Mapping[str, Mark]) -> Reply:
    """Marks as the page has them."""
    return {name: asdict(mark) for name, mark in marks.items()}


def advise(figure: Figure, marks: Mapping[str, Mark], size: tuple[int, int], facing: int) -> Advice:
    """Judge the marks of one frame, complete or not: whatever `figtrack track` refuses is said.

    `size` is width and height of the picture in pixels, `facing` +1 right, -1 left.
    """
    places = points(marks)
    missing = tuple(name for name in needed_joints(figure) if name not in marks)
    wrong, faces = [*_outside(marks, size), *objections(figure, places, facing, "choose Faces")], None
    if not missing:
        try:
            faces = start_pose(figure, places, facing).view.side
        except PoseError as error:
            wrong = [str(error), *wrong]
    return Advice(missing, tuple(wrong), faces)


def _outside(marks: Mapping[str, Mark], size: tuple[int, int]) -> list[str]:
    width, height = size
    return [
        f"{name} lies outside the picture of {width} x {height} px; move it in, or delete it"
        for name in outside(marks, size)
    ]
