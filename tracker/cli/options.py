"""What the commands share: options, where results go unless told, and errors as one line."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from tracker.progress import Progress


class Style(StrEnum):
    """How progress is shown."""

    AUTO = "auto"
    PLAIN = "plain"
    JSON = "json"


class Facing(StrEnum):
    """Which way the figure faces."""

    LEFT = "left"
    RIGHT = "right"


Overwrite = Annotated[
    bool, typer.Option("--overwrite", help="Replace complete results once the new ones are complete.")
]
Video = Annotated[Path, typer.Argument(help="A video file or a folder of numbered images.")]
FacingOption = Annotated[
    Facing | None, typer.Option(help="Which way the figure faces [default: seen from the marks].")
]
Quiet = Annotated[bool, typer.Option("--quiet", help="Show no progress.")]
ProgressStyle = Annotated[Style, typer.Option("--progress", help="How progress is shown on stderr.")]


def towards(facing: Facing | None) -> int | None:
    """+1 right, -1 left, None where it is not said."""
    return None if facing is None else (1 if facing is Facing.RIGHT else -1)


def beside(source: Path, what: str) -> Path:
    """Where results go unless told, in the folder one is in."""
    return Path(f"{source.absolute().stem}-{what}")


def shown_progress(quiet: bool, style: Style) -> "Progress":
    """Progress as the options ask for it."""
    from tracker.progress import Progress

    return Progress("quiet" if quiet else style.value)


@contextmanager
def plain_errors() -> Iterator[None]:
    """One line on stderr and exit status 1 for whatever keeps the work from being done."""
    try:
        yield
        sys.stdout.flush()  # onto a full disk, or to a reader that hung up
    except KeyboardInterrupt:
        _fail("interrupted; nothing was written")
    except BrokenPipeError:
        _drop_output()
        raise typer.Exit(1) from None
    except Exception as error:
        from tracker.errors import fault

        said = fault(error)
        if said is None:
            raise
        _fail(said)


def _fail(text: str) -> None:
    print(f"error: {text}", file=sys.stderr)
    try:
        sys.stdout.flush()
    except OSError:
        _drop_output()
    raise typer.Exit(1)


def _drop_output() -> None:
    """Let what is still to be printed go nowhere, or Python would complain of it as it ends."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
