"""The pages hang together: every command has one, links lead somewhere, figures are where they come from."""

import re

import pytest

from tests.handbook.blocks import PAGES, ROOT
from tracker.cli.app import COMMANDS

INDEX = "docs/README.md"
MOST_WORDS = 14_000
LINK = re.compile(r"\[([^\]]+)\]\(([^)]+)\)")
MEASURED = ("results.md", "robustness.md", "motion.md", "speed.md", "rendered.md", "gait.md")


def links(page):
    """What each link of a page says, and where it leads."""
    return LINK.findall((ROOT / page).read_text(encoding="utf-8"))


def figures(page):
    """The figures that are links to the page they were measured in."""
    return [(said, where) for said, where in links(page) if where in MEASURED and said[0].isdigit()]


def test_every_command_has_a_page_in_the_index():
    text = (ROOT / INDEX).read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\|\[`([\w-]+)`\]\((\S+)\) \|", text, re.MULTILINE))
    assert set(rows) == {command.__name__.replace("_", "-") for command in COMMANDS}
    for name, page in rows.items():
        assert f"figtrack {name}" in (ROOT / "docs" / page).read_text(encoding="utf-8"), name


def test_every_page_is_in_the_index():
    linked = {where for _, where in links(INDEX)}
    assert {page.removeprefix("docs/") for page in PAGES if page not in ("README.md", INDEX)} <= linked


def test_the_pages_of_docs_stay_short_enough_to_be_read():
    texts = [(ROOT / page).read_text(encoding="utf-8") for page in PAGES if page != "README.md"]
    assert sum(len(text.split()) for text in texts) <= MOST_WORDS


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_to_files_that_there_are(page):
    for _, where in links(page):
        if not where.startswith(("http", "#")):
            assert (ROOT / page).parent.joinpath(where.partition("#")[0]).exists(), where


def test_figures_in_prose_are_in_the_page_that_they_are_said_to_come_from():
    assert figures("docs/limits.md")
    for page in PAGES:
        for said, where in figures(page):
            text = (ROOT / "docs" / where).read_text(encoding="utf-8")
            assert re.search(rf"(?<![\d.]){re.escape(said)}(?!\d)", text), f"{page}: {said} is not in {where}"
