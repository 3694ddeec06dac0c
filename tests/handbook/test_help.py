"""Every command's help has an example, and the examples, one after the other, can be run."""

import inspect
import re
import shlex

import pytest

from tests.handbook.stage import run, set_up
from tests.handbook.test_commands import COMMANDS as OF_PAGES
from tests.tracker.clips import figtrack
from tracker.cli.app import COMMANDS

READ_LATER = ("learn", "track")  # whose results other examples read


def example(command):
    """The words of a command's example."""
    (found,) = re.findall(r"^Example: (figtrack .+)$", inspect.getdoc(command), re.MULTILINE)
    return shlex.split(found)


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command.__name__)
def test_the_help_shows_an_example_of_the_very_command_and_nothing_of_python_s(command):
    words = example(command)
    assert words[:2] == ["figtrack", command.__name__.replace("_", "-")]
    said = " ".join(figtrack(words[1], "--help").stdout.split())
    assert f"Example: {shlex.join(words)}" in said
    assert not re.search(r"[{}]|list\[str", said)


@pytest.mark.handbook
def test_the_examples_can_be_run_one_after_the_other(stage, here, scheduler):
    set_up(stage, here, "help")
    run_by_pages = [words[1:] for words in OF_PAGES]
    for words in map(example, COMMANDS):
        if words[1] in READ_LATER or words[1:] not in run_by_pages:
            run(words, here, scheduler)
