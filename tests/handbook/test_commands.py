"""Every command and Python block of the pages, every example of the help and the notebook are run, and what
the Makefile installs is told."""

import inspect
import json
import re
import shlex
import tomllib

import matplotlib.pyplot as plt
import pytest

from tests.handbook import stage as staging
from tests.handbook.blocks import PAGES, ROOT, blocks_in, blocks_of
from tests.handbook.stage import IN_ITS_PLACE, NOT_RUN, CommandFailedError, run, run_process, set_up
from tests.tracker.clips import figtrack
from tracker.cli.app import COMMANDS

ALL = [block for page in PAGES for block in blocks_of(page)]
RUN = [page for page in PAGES if any(block.kind != "shown" for block in blocks_of(page))]
OF_PAGES = [words for block in ALL if block.kind == "commands" for words in block.commands]
READ_LATER = ("learn", "track")  # whose results other examples read
NOTEBOOK = "docs/walk.ipynb"
CELLS = json.loads((ROOT / NOTEBOOK).read_text(encoding="utf-8"))["cells"]
EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
CODE = ["".join(cell["source"]) for cell in CELLS if cell["cell_type"] == "code"]


def example(command):
    """The words of a command's example in its help."""
    (found,) = re.findall(r"^Example: (figtrack .+)$", inspect.getdoc(command), re.MULTILINE)
    return shlex.split(found)


@pytest.mark.handbook
@pytest.mark.parametrize("page", RUN)
def test_a_page_can_be_followed_from_its_top_to_its_end(page, stage, here, scheduler):
    set_up(stage, here, page)
    names = {}
    for block in blocks_of(page):
        if block.file:
            (here / block.file).write_text(block.text)
        elif block.kind == "python":
            exec(compile(block.text, f"{page}:{block.line}", "exec"), names)
        elif block.kind == "commands":
            for words in block.commands:
                if " ".join(words) not in NOT_RUN:
                    run(words, here, scheduler)


def test_what_is_not_run_is_in_a_page_and_has_a_reason():
    assert set(NOT_RUN) <= {" ".join(words) for words in OF_PAGES}
    assert all(NOT_RUN.values())


def test_what_is_run_in_another_form_is_in_a_page():
    assert set(IN_ITS_PLACE) <= {word for words in OF_PAGES for word in words[:2]}


def test_what_pages_find_is_asked_for_by_pages_that_there_are():
    assert set(staging.FOUND) <= set(RUN)


def test_no_block_that_is_merely_shown_holds_a_command():
    # Whatever a shell runs is told by its first word; what a page prints or explains starts otherwise.
    shown = [block for block in ALL if block.kind == "shown"]
    assert not [block for block in shown if block.text.lstrip().startswith(("$", "./", "figtrack", ".venv"))]
    assert not [block for block in shown if "import tracker" in block.text]


def test_blocks_are_told_apart_whether_indented_or_fenced():
    text = "Text\n\n    figtrack demo\n\n```python\nimport tracker\n```\n\n    a,b\n\n```sh\nmake test\n```\n"
    assert [block.kind for block in blocks_in(text)] == ["commands", "python", "shown", "commands"]
    assert [block.line for block in blocks_in(text)] == [3, 5, 9, 11]


def test_a_line_that_ends_in_a_backslash_goes_on():
    (block,) = blocks_in("    figtrack track \\\n      walk.mp4\n    make test # now\n")
    assert block.commands == [["figtrack", "track", "walk.mp4"], ["make", "test"]]


@pytest.mark.handbook
def test_a_command_that_fails_fails_its_page(stage, here, scheduler):
    set_up(stage, here, "page")
    for text in ("figtrack track absent.mp4 --keypoints walk.keypoints.csv", "figtrack trak", "make nothing"):
        with pytest.raises(CommandFailedError, match=text.split()[-1]):
            run(text.split(), here, scheduler)
    with pytest.raises(CommandFailedError, match="no program that the test knows"):
        run(["curl", "x"], here, scheduler)


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


@pytest.mark.handbook
def test_every_file_of_a_run_and_all_that_is_said_of_it_is_told(stage):
    text, folder = (ROOT / "docs" / "files.md").read_text(encoding="utf-8"), stage / "walk-track"
    news = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    heads = [
        (folder / name).read_text(encoding="utf-8").splitlines()[0] for name in ("keypoints.csv", "pose.csv")
    ]
    columns = ",".join(heads).split(",")
    names = [*news, *(path.name for path in folder.iterdir()), *columns]
    assert [name for name in names if not re.search(rf"\b{re.escape(name)}\b", text)] == []


@pytest.mark.handbook
def test_the_notebook_runs_from_top_to_end(stage, here):
    set_up(stage, here, NOTEBOOK)
    plt.switch_backend("agg")
    names = {}
    for number, source in enumerate(CODE):
        exec(compile(source, f"{NOTEBOOK} cell {number}", "exec"), names)
    assert len(names["table"]) == len(names["track"])
    assert names["axes"].lines
    plt.close("all")


def test_the_notebook_is_kept_without_results():
    code = [cell for cell in CELLS if cell["cell_type"] == "code"]
    assert len(code) == len(CODE) > 3
    assert not any(cell["outputs"] or cell["execution_count"] for cell in code)


@pytest.mark.parametrize(
    ("target", "wanted"), [("installed", "."), ("installed-dev", ".[dev]"), ("installed-bench", ".[bench]")]
)
def test_an_environment_is_installed_by_commands_that_name_the_project_and_an_extra(target, wanted):
    told = run_process(["make", "--dry-run", "--always-make", f".venv/{target}"], cwd=ROOT)
    words = shlex.split(told)
    named = [words[i + 1] for i, word in enumerate(words) if word == "--editable"]
    assert named == [wanted, wanted]  # by uv, or else by pip
    assert wanted == "." or wanted[2:-1] in EXTRAS
