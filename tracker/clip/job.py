"""What to follow, and how: `Following` holds a user's options, `Job` also what their files contain.

Command line, tables of clips and the Python API take the options' names, ranges, defaults and words from
`Following`. This module imports nothing slow, so that the command line can read it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from enum import Enum, StrEnum
from functools import cache
from pathlib import Path
from types import NoneType
from typing import TYPE_CHECKING, Annotated, Any, get_args, get_type_hints

if TYPE_CHECKING:
    from tracker.settings import Settings
    from tracker.tables.keypoints import Mark, Marks


class Facing(StrEnum):
    """Which way the figure faces."""

    LEFT = "left"
    RIGHT = "right"


class Nearer(StrEnum):
    """Where the leg towards the camera is."""

    AHEAD = "ahead"
    BEHIND = "behind"

    @classmethod
    def of(cls, ahead: float) -> "Nearer":
        """By how far its ankle is ahead of the other one."""
        return cls.AHEAD if ahead > 0.0 else cls.BEHIND

    @property
    def other(self) -> "Nearer":
        return Nearer.BEHIND if self is Nearer.AHEAD else Nearer.AHEAD


def bare_name(path: Path) -> str:
    """The name of a file without its ending, or of a folder, which has none: results are called after it."""
    return path.absolute().name if path.is_dir() else path.absolute().stem


class OptionsError(ValueError):
    """Options that do not go together."""


def towards(facing: Facing | None) -> int | None:
    """+1 right, -1 left, None if not given."""
    return None if facing is None else (1 if facing is Facing.RIGHT else -1)


@dataclass(frozen=True)
class About:
    """The meaning of an option, and the range of a number."""

    text: str
    least: float | None = None
    most: float | None = None


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of a clip that its job keeps unchanged."""

    start: Annotated[
        int | None, About("The marked frame to start from [default: the first marked].", least=0)
    ] = None
    from_: Annotated[
        int | None, About("The first frame to follow [default: the clip's first].", least=0, most=10**9)
    ] = None
    stop: Annotated[
        int | None, About("The last frame to follow [default: the clip's last].", least=0, most=10**9)
    ] = None
    figure: Annotated[str, About("What is followed: a figure that ships, or a TOML file of one.")] = "walker"
    model: Annotated[str, About("cv, a shipped model, or a file from 'figtrack learn'.")] = "walk-run"
    anchors: Annotated[bool, About("Pass through every marked frame, not the start alone.")] = False
    measure: Annotated[
        Path | None,
        About(
            "A pose network's points of every frame, as a further, doubted measurement: "
            "DeepLabCut CSV, OpenPose JSON (file or folder), COCO or labelme JSON, or TRC in pixels."
        ),
    ] = None
    rate: Annotated[
        float | None,
        About(
            "Playback speed: 0.5 for slow motion at half speed [default: found while tracking].", 0.25, 4.0
        ),
    ] = None
    height: Annotated[
        float | None, About("Of the person, metres: lengths and speed are then told in metres.", 0.3, 3.0)
    ] = None
    scale: Annotated[
        float | None, About("Pixels a metre where the figure walks, in place of --height.", 0.1, 1e5)
    ] = None
    smooth: Annotated[bool, About("Write each pose given the whole clip, or as first seen.")] = True

    def kept(self) -> dict[str, Any]:
        """These options by name."""
        return {each.name: getattr(self, each.name) for each in fields(Options)}

    @property
    def inputs(self) -> list[Path | None]:
        """The input files, None for none; a model may also be the name of a shipped one."""
        named = [Path(name) if Path(name).is_file() else None for name in (self.figure, self.model)]
        return [self.measure, *named]


@dataclass(frozen=True, kw_only=True)
class Following(Options):
    """How to follow a clip: all options of a user.

    Raises:
        OptionsError: options that do not go together.
        ValueError: a number out of its range, or a word that is none of those known.
    """

    facing: Annotated[Facing | None, About("Which way the figure faces [default: seen from the marks].")] = (
        None
    )
    person: Annotated[
        int | None, About("Which of those that 'figtrack find' lists, where no joint is marked.", least=1)
    ] = None
    near: Annotated[
        Nearer | None,
        About("Where the leg towards the camera is in the frame started from [default: seen from the film]."),
    ] = None
    templates: Annotated[bool, About("Follow looks, or with --measure points alone.")] = True
    settings: Annotated[Path | None, About("TOML file of tracker settings.")] = None

    def __post_init__(self) -> None:
        for option in options():
            value = getattr(self, option.name)
            if value is not None:
                object.__setattr__(self, option.name, option.checked(value))
        if self.height is not None and self.scale is not None:
            raise OptionsError("give either height or scale, not both")
        if self.from_ is not None and self.stop is not None and self.from_ > self.stop:
            raise OptionsError(f"from {self.from_} comes after stop {self.stop}; choose a later stop")

    @property
    def inputs(self) -> list[Path | None]:
        """The input files, including that of settings."""
        return [*super().inputs, self.settings]

    def tuned(self, settings: "Settings | None" = None) -> "Settings":
        """The settings given, or else the file's or the defaults, with the changes that options make.

        ValueError: as `read_settings`.
        """
        from tracker.settings import Settings, read_settings

        if settings is None:
            settings = Settings() if self.settings is None else read_settings(self.settings)
        return settings if self.templates else settings.model_copy(update={"templates": False})

    def job(self, video: Path, start: "Marks | Found", settings: "Settings | None" = None) -> "Job":
        """The job with its marks and settings.

        Args:
            start: given marks, or a start found in the film.
            settings: replace those of the file.

        Raises:
            OptionsError: options that cannot be combined with given marks.
            ValueError: as `read_settings`.
        """
        if isinstance(start, Found):
            found, marks = start, {start.frame: dict(start.marks)}
        elif self.person is not None or self.near is not None:
            raise OptionsError("person and near are for films without marks; leave them or the keypoints out")
        else:
            found, marks = None, start
        facing = towards(self.facing) if found is None else found.facing
        return Job(video, marks, settings=self.tuned(settings), facing=facing, found=found, **self.kept())


@dataclass(frozen=True)
class Found:
    """A start found in the film.

    frame    : start frame
    marks    : its joints
    facing   : +1 right, -1 left
    nearer   : where the leg named near is in this frame
    near_leg : whether that is "sure", "unsure" or "given"
    against  : whether the film tells the other facing
    """

    frame: int
    marks: "Mapping[str, Mark]"
    facing: int
    nearer: Nearer
    near_leg: str
    against: bool = False


@dataclass(frozen=True)
class Option:
    """A field of `Following` and its type, which may also be None.

    name  : in Python, with an underscore at the end if it is a keyword
    shown : on the command line and in tables
    """

    name: str
    kind: type
    about: About

    @property
    def shown(self) -> str:
        return self.name.rstrip("_")

    def checked(self, value: Any) -> Any:
        """The value in this option's type; ValueError if it is out of range or none of the words."""
        least, most = self.about.least, self.about.most
        if least is not None and not value >= least:
            raise ValueError(f"{self.shown} must be at least {least:.10g}; got {value!r}")
        if most is not None and not value <= most:
            raise ValueError(f"{self.shown} must be at most {most:.10g}; got {value!r}")
        if self.words and value not in self.words:
            known = ", ".join(map(repr, self.words))
            raise ValueError(f"{self.name} must be {known} or None; got {value!r}")
        return self.kind(value)

    @property
    def words(self) -> tuple[str, ...]:
        """The words that the option accepts; () if it is no choice between words."""
        return tuple(map(str, self.kind)) if issubclass(self.kind, Enum) else ()


@cache
def options() -> tuple[Option, ...]:
    """The options of `Following` by name, in its order."""
    found = []
    for name, hint in get_type_hints(Following, include_extras=True).items():
        kinds, about = get_args(hint)
        kind = next(kind for kind in get_args(kinds) or (kinds,) if kind is not NoneType)
        found.append(Option(name, kind, about))
    return tuple(found)


@dataclass(frozen=True)
class Job(Options):
    """What to follow, and how.

    marks  : marked joints by frame
    facing : +1 right, -1 left, None to find it from the start pose
    called : name of the video in results, None for its path
    found  : the start found in the film, None if marks were given
    """

    video: Path
    marks: "Marks"
    settings: "Settings" = field(default_factory=lambda: Following().tuned(), kw_only=True)
    facing: int | None = field(default=None, kw_only=True)
    called: str | None = field(default=None, kw_only=True)
    found: Found | None = field(default=None, kw_only=True)

    @property
    def inputs(self) -> list[Path | None]:
        """The input files, including the video."""
        return [self.video, *super().inputs]

    @property
    def first(self) -> int:
        """Number of the first frame that is followed."""
        return self.from_ or 0

    @property
    def names_legs(self) -> bool:
        """Whether the user says which leg is near: by marks, or of a start that was found."""
        return self.found is None or self.found.near_leg == "given"

    def passed(self, start: int) -> "Marks":
        """The marks that the track passes through: those of the start frame, and of anchors."""
        return self.marks if self.anchors else {start: self.marks[start]}

    def asked(self) -> dict[str, Any]:
        """The given options in a form for JSON, files by their absolute path."""
        return {name: _whole(value) for name, value in sorted(self.kept().items())}


def _whole(value: Any) -> Any:
    if isinstance(value, Path) or (isinstance(value, str) and Path(value).is_file()):
        return str(Path(value).absolute())
    return value
