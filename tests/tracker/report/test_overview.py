"""The page of a batch: every clip has its row, its picture and its link, and names are no HTML."""

import pytest

from tests.tracker.desk.desks import a_run
from tests.tracker.report.reports import write_clip
from tracker.report.overview import MADE, write_overview


@pytest.fixture
def place(tmp_path):
    """A folder with the run of a clip in it."""
    run = a_run(tmp_path, headline="Walks <slowly>.", warnings=["A & B."]).rename(tmp_path / "a b-track")
    write_clip(run / "overlay.mp4", [0.0, 0.1, 0.2])
    return tmp_path


def test_every_clip_has_a_row_and_the_followed_ones_a_picture_and_a_link(browser, place):
    page = place / "summary.html"
    write_overview(page, place, [("a b.mp4", place / "a b-track", "3 ok"), ("<i>c.mp4", None, "no <video>")])
    assert MADE in page.read_text()[:1000]
    browser.open(page.as_uri(), width=390)
    cells = browser.each("tr", "[...one.cells].map(cell => cell.innerText)")
    assert cells[0][1] == "a b.mp4"
    assert cells[0][2].split("\n\n") == ["Walks <slowly>.", "Frames: 3 ok", "A & B."]
    assert cells[1][1:] == ["<i>c.mp4", "no <video>"]
    assert browser.value("document.querySelector('img').naturalWidth") == 240
    assert browser.value("document.querySelectorAll('a').length") == 1
    assert browser.value("document.documentElement.scrollWidth <= window.innerWidth")
    assert min(browser.each("th", "one.clientWidth")) > 300
    browser.value("document.querySelector('a').click()")
    browser.wait("document.body?.innerText === 'a report'")


def test_a_run_without_a_film_or_a_report_is_told_all_the_same(place):
    for name in ("overlay.mp4", "report.html"):
        (place / "a b-track" / name).unlink()
    write_overview(place / "summary.html", place, [("a b.mp4", place / "a b-track", "3 ok")])
    page = (place / "summary.html").read_text()
    assert "Walks &lt;slowly&gt;." in page
    assert "<img" not in page
    assert "href='a" not in page
