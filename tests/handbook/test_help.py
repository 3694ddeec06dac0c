"""Every command's help has an example, and the examples, one after the other, can be run."""

import inspect
import re
import shlex

import pytest

from tests.handbook.stage import run, set_up
from tests.tracker.clips import figtrack
from tracker.cli.app import COMMANDS


def example(command):
    """The words of a command's example."""
    (found,) = re.findall(r"^Example: (figtrack .+)$", inspect.getdoc(command), re.MULTILINE)
    return shlex.split(found)


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command.__name__)
def test_the_help_shows_an_example_of_the_very_command(command):
    words = example(command)
    assert words[:2] == ["figtrack", command.__name__.replace("_", "-")]
    said = " ".join(figtrack(words[1], "--help").stdout.split())
    assert f"Example: {shlex.join(words)}" in said


@pytest.mark.handbook
def test_the_examples_can_be_run_one_after_the_other(stage, here, scheduler):
    set_up(stage, here, "help")
    for command in COMMANDS:
        run(example(command), here, scheduler)
