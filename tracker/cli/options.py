"""Common parts of the commands: options and groups of them, default places of results, errors as one line."""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import MISSING, dataclass, fields, is_dataclass
from enum import StrEnum
from functools import wraps
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args, get_type_hints

import typer
from typer.models import OptionInfo

from tracker.clip.job import About, OptionsError, bare_name

if TYPE_CHECKING:
    from tracker.progress import Progress

INTERRUPTED = "interrupted; nothing was written"
UNLOADED = ("failed to map segment", "cannot allocate memory")  # messages of the system without memory
Style = StrEnum("Style", "AUTO PLAIN JSON")  # how progress is shown


def named(path: Path) -> Path:
    """The path, in full where its last part is no name, as in `.`; results and pages are called after it."""
    return path.resolve() if path.name in ("", "..") else path


Video = Annotated[Path, typer.Argument(help="A video file or a folder of numbered images.", callback=named)]
Keypoints = Annotated[
    Path | None,
    typer.Option(
        help="Table of marked joints: frame,keypoint,x,y,visible; or DeepLabCut CSV, OpenPose JSON (a file "
        "or a folder), COCO keypoints JSON, labelme JSON or TRC in pixels, of which the best frame is taken "
        "unless --start names one [default: the walker is found].",
    ),
]
Overwrite = Annotated[
    bool, typer.Option("--overwrite", help="Replace complete results once the new ones are complete.")
]


@dataclass(frozen=True)
class Shown:
    """How a long command shows its progress."""

    quiet: Annotated[bool, typer.Option("--quiet", help="Show no progress.")] = False
    progress: Annotated[Style, typer.Option(help="How progress is shown on stderr.")] = Style.AUTO

    def shown(self) -> "Progress":
        from tracker.progress import Progress

        return Progress("quiet" if self.quiet else self.progress.value)


@dataclass(frozen=True)
class Common(Shown):
    """The last options of every long command with results."""

    overwrite: Overwrite = False


def offered(command: Callable[..., None]) -> Callable[..., None]:
    """The command in typer's form; it ends with one line and exit status 1 if it fails.

    A parameter that is a dataclass becomes an option for each of its fields. A field with the name of one of
    the command's own parameters is no option and keeps its default.
    """
    hints = get_type_hints(command, include_extras=True)
    own = signature(command).parameters
    groups = {
        name: [each for each in fields(hints[name]) if each.name not in own]
        for name in own
        if is_dataclass(hints[name])
    }
    parameters: list[Parameter] = []
    for name, parameter in own.items():
        if name in groups:
            of_fields = get_type_hints(hints[name], include_extras=True)
            parameters += [_parameter(f.name, of_fields[f.name], f.default) for f in groups[name]]
        else:
            parameters.append(_parameter(name, hints[name], parameter.default))

    @wraps(command)
    def run(**given: Any) -> None:
        with plain_errors():
            for name, members in groups.items():
                chosen = {member.name: given.pop(member.name) for member in members}
                try:
                    given[name] = hints[name](**chosen)
                except ValueError as error:  # options that cannot be combined
                    raise typer.BadParameter(str(error)) from error
            try:
                command(**given)
            except OptionsError as error:
                raise typer.BadParameter(str(error)) from error

    run.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return run


def beside(source: Path, what: str) -> Path:
    """The default place of results, in the current folder."""
    return Path(f"{bare_name(source)}-{what}")


@contextmanager
def plain_errors() -> Iterator[None]:
    """In this block errors become one line on stderr and exit status 1."""
    try:
        yield
        sys.stdout.flush()  # may fail on a full disk or a closed pipe
    except KeyboardInterrupt:
        _fail(INTERRUPTED)
    except BrokenPipeError:
        _drop_output()
        raise typer.Exit(1) from None
    except Exception as error:
        # Compiled code, a library that is being loaded, or a class that is being made reports Ctrl-C so.
        by_others = isinstance(error, SystemError | ImportError | RuntimeError)
        if by_others and isinstance(error.__cause__, KeyboardInterrupt):
            _fail(INTERRUPTED)
        _fail(_fault(error))


def _fault(error: Exception) -> str:
    """The error as one line for the user; a bug of the program is raised."""
    # Another library may have reported in its own words that one could not be loaded.
    unloaded = error if isinstance(error, ImportError) else error.__context__
    if any(text in str(unloaded) for text in UNLOADED):
        return f"a library cannot be loaded ({unloaded}); is there enough memory?"
    try:
        from tracker.errors import fault
    except (ImportError, MemoryError) as another:
        why = str(another) or "none is left"
        return f"there is not enough memory even to begin ({why}); close other programs"
    return fault(error)


def _parameter(name: str, hint: Any, default: Any) -> Parameter:
    """An option of this type; its help is in the type's annotations, as typer's own or as `About`."""
    about = next((note for note in get_args(hint) if isinstance(note, About)), None)
    if about is not None:
        shown = name.rstrip("_")
        flag = f"--{shown}/--no-{shown}" if default is True else f"--{shown}"
        hint = Annotated[
            get_args(hint)[0], typer.Option(flag, help=about.text, min=about.least, max=about.most)
        ]
    if name == "model":
        next(note for note in get_args(hint) if isinstance(note, OptionInfo)).autocompletion = _models
    default = Parameter.empty if default is MISSING else default
    return Parameter(name, Parameter.KEYWORD_ONLY, default=default, annotation=hint)


def _models(beginning: str) -> list[str]:
    """The models that a shell may complete the beginning of a name to."""
    from tracker.models.find import known_models

    return [name for name in known_models() if name.startswith(beginning)]


def _fail(text: str) -> None:
    print(f"error: {text}", file=sys.stderr)
    try:
        sys.stdout.flush()
    except OSError:
        _drop_output()
    raise typer.Exit(1)


def _drop_output() -> None:
    """Discard pending output, for which Python would print an error when it exits."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
