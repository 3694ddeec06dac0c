"""Every command block and every Python block of the README and docs/ is run, page by page."""

import pytest

from tests.handbook import stage as staging
from tests.handbook.blocks import PAGES, blocks_in, blocks_of
from tests.handbook.stage import IN_ITS_PLACE, NOT_RUN, CommandFailedError, run, set_up

ALL = [block for page in PAGES for block in blocks_of(page)]
RUN = [page for page in PAGES if any(block.kind != "shown" for block in blocks_of(page))]
COMMANDS = [words for block in ALL if block.kind == "commands" for words in block.commands]


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
    assert set(NOT_RUN) <= {" ".join(words) for words in COMMANDS}
    assert all(NOT_RUN.values())


def test_what_is_run_in_another_form_is_in_a_page():
    assert set(IN_ITS_PLACE) <= {word for words in COMMANDS for word in words[:2]}


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
