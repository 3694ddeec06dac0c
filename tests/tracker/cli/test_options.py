"""Groups of options: a command that takes a dataclass has an option for each of its fields."""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import pytest
import typer
from typer.testing import CliRunner

from tracker.cli.options import beside, named, offered
from tracker.clip.job import About


@dataclass(frozen=True)
class Drink:
    """A group."""

    sugar: Annotated[int, About("Spoons.", least=0, most=3)] = 1
    milk: Annotated[bool, About("White.")] = False
    hot: Annotated[bool, About("Not iced.")] = True
    cup: Annotated[str, typer.Option("--mug", help="Of what.")] = "clay"


@pytest.fixture
def call():
    """A command's group as it comes from words, and what is shown."""
    got = []

    def serve(*, drink: Drink, cup: str | None = None, fault: str = "") -> None:
        """Serve."""
        if fault:
            raise {"value": ValueError, "key": KeyError}[fault](fault)
        got.append((drink, cup))

    def command(*words):
        app = typer.Typer(rich_markup_mode=None)
        app.command()(offered(serve))
        got.clear()
        result = CliRunner().invoke(app, [str(word) for word in words])
        return (got[0] if got else None), result

    return command


def test_fields_come_by_their_options_and_else_have_their_defaults(call):
    assert call()[0] == (Drink(), None)
    assert call("--sugar", 3, "--milk", "--no-hot")[0] == (Drink(3, True, False), None)


def test_a_field_that_the_command_names_itself_is_the_command_s(call):
    assert call("--cup", "glass")[0] == (Drink(), "glass")
    assert call("--mug", "glass")[1].exit_code == 2


def test_words_and_ranges_are_those_of_the_field(call):
    said = " ".join(call("--help")[1].stdout.split())
    assert "Spoons. [default: 1; 0<=x<=3]" in said
    assert "--hot / --no-hot" in said
    assert "--no-milk" not in said
    assert call("--sugar", 4)[1].exit_code == 2


def test_a_film_has_a_name_though_it_is_the_folder_that_one_is_in(tmp_path, monkeypatch):
    (tmp_path / "walk" / "inner").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "walk" / "inner")
    assert named(Path(".")) == tmp_path / "walk" / "inner"
    assert named(Path("..")) == tmp_path / "walk"
    assert named(Path("a.mp4")) == Path("a.mp4")
    assert beside(named(Path("..")), "track") == Path("walk-track")


def test_what_cannot_be_done_is_one_line_and_a_mistake_of_ours_is_not_hidden(call):
    _, result = call("--fault", "value")
    assert (result.exit_code, result.stderr) == (1, "error: value\n")
    assert isinstance(call("--fault", "key")[1].exception, KeyError)


def ended(error, cause=None):
    """Exit status and what is told of a command that fails so."""

    def fail():
        """Fail."""
        raise error from cause

    app = typer.Typer(rich_markup_mode=None)
    app.command()(offered(fail))
    result = CliRunner().invoke(app, [])
    return result.exit_code, result.stderr


@pytest.mark.parametrize(
    ("error", "cause"),
    [
        (KeyboardInterrupt(), None),
        (SystemError("returned a result with an exception set"), KeyboardInterrupt()),  # compiled code
        (ImportError("initialization failed"), KeyboardInterrupt()),
        (RuntimeError("Error calling __set_name__"), KeyboardInterrupt()),  # a class that is made
    ],
)
def test_what_is_interrupted_says_so_in_one_line(error, cause):
    assert ended(error, cause) == (1, "error: interrupted; nothing was written\n")


def test_a_library_that_finds_no_memory_is_told_in_one_line(monkeypatch):
    text = "libav.so: failed to map segment from shared object"
    said = f"error: a library cannot be loaded ({text}); is there enough memory?\n"
    assert ended(ImportError(text)) == (1, said)
    other = OSError("could not find it, or something else")
    other.__context__ = OSError(text)
    assert ended(other) == (1, said)
    monkeypatch.setitem(sys.modules, "tracker.errors", None)  # so that it cannot be imported
    assert ended(MemoryError())[1].startswith("error: there is not enough memory even to begin (")
