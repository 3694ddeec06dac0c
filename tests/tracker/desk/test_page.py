"""The page of a folder of films in a real browser: its controls, its layout, and the commands it starts."""

import signal

import cv2
import numpy as np
import pytest

from tests.tracker.annotate.clients import running
from tests.tracker.desk.desks import a_run, state
from tests.tracker.report.reports import chapter, write_clip
from tests.tracker.strolls import stroll
from tracker.report import page
from tracker.report.page import write_report


@pytest.mark.parametrize("largest", [10**9, 100], ids=["within", "beside"])
def test_the_film_of_a_report_plays(browser, client, folder, monkeypatch, largest):
    monkeypatch.setattr(page, "LARGEST", largest)
    run, track = a_run(folder), stroll(1.0)
    write_report(run / "report.html", chapter(track), write_clip(run / "film.mp4", track.times))
    browser.open(f"http://{client.host}/{client.server.shown}/run/walk.mp4/report.html")
    browser.wait("document.querySelector('video').readyState >= 2")
    browser.press(" ")
    browser.wait("document.querySelector('.screen svg').dataset.frame > 10")


@pytest.mark.whole
def test_a_film_goes_all_the_way_on_the_page(browser, folder):
    with running(folder, command="app") as (process, client):
        browser.open(client.address)
        browser.push("[data-command=find]")
        browser.wait("document.querySelector('.said').innerText.includes('person 1')")
        browser.wait("document.querySelector('.found').naturalWidth > 100")
        browser.value("document.querySelector('.person').value = '1'")
        browser.push("[data-command=track]")
        browser.wait("document.querySelector('.said').innerText.includes('27 frames of walk.mp4')")
        assert (folder / "walk-track" / "report.html").exists()
        browser.value("document.querySelector('.to').value = 'mot'")
        browser.push("[data-command=export]")
        browser.wait("document.querySelector('.said').innerText.includes('wrote')")
        assert (folder / "walk-track.mot").exists()
        browser.push("[data-command=correct]")
        browser.wait("document.querySelector('.task a')")
        browser.open(browser.value("document.querySelector('.task a').href"))
        browser.wait("document.querySelector('#points circle')")
        browser.open(client.address)
        browser.push(".stop")
        browser.wait("document.querySelector('.work .row').hidden")
        browser.wait("document.querySelector('.report').href.includes('/run/')")
        browser.open(browser.value("document.querySelector('.report').href"))
        browser.wait("document.querySelector('.plots svg')")
        browser.open("about:blank")
        process.send_signal(signal.SIGINT)
        assert process.wait(30) == 0


@pytest.mark.parametrize(("width", "dark"), [(390, False), (1280, True), (1920, False)])
def test_nothing_sticks_out_of_the_page(browser, client, folder, width, dark):
    a_run(folder, headline="Walks at 99 steps a minute.", warnings=["a warning " * 30])
    found = "person,first,last,facing,motion\n1,0,123,left,walk backwards\n"
    (folder / "walk-people.csv").write_text(found)
    cv2.imwrite(str(folder / "walk-people.png"), np.zeros((90, 160, 3), np.uint8))
    browser.open(client.address, width=width, dark=dark)
    browser.wait("document.querySelector('.film img').complete")
    wide = "document.documentElement.scrollWidth <= window.innerWidth"
    assert browser.value(wide)
    right = "one.getBoundingClientRect().right"
    assert max(browser.each(".film *", right)) < max(browser.each(".film", right))
    assert browser.value("[...document.querySelectorAll('button, select, input')].every((one) => "
                         "one.innerText || one.labels.length || one.ariaLabel)")  # fmt: skip


def test_marks_that_appear_are_what_is_followed_from_and_then_no_nearer_leg_is_asked_for(
    browser, client, folder
):
    browser.open(client.address)
    assert browser.value("document.querySelector('.person').value") == ""
    (folder / "walk.keypoints.csv").write_text("frame,keypoint,x,y\n0,hip,1,1\n")
    browser.wait("document.querySelector('.person').value === 'marks'")
    browser.wait("document.querySelector('.near').disabled")
    browser.value("document.querySelector('.person').value = ''")
    browser.wait("!document.querySelector('.near').disabled")


def test_what_is_said_is_replaced_only_where_it_differs(browser, client, folder):
    a_run(folder, headline="Walks.", warnings=["dark"])
    (folder / "walk.mp4").write_bytes(b"no film")
    browser.open(client.address)
    browser.push("[data-command=find]")
    browser.wait("document.querySelector('.said p.fault')")
    browser.value("window.kept = ['.said p', '.warnings li'].map((one) => document.querySelector(one));"
                  "window.kept.push(document.querySelector('.headline').firstChild); 0")  # fmt: skip
    (folder / "other.mp4").write_bytes(b"no film")
    browser.wait("document.querySelectorAll('.film').length === 2")
    assert browser.value("window.kept.every((one) => one.isConnected)")
    browser.open("about:blank")
    browser.errors.clear()  # there are no pictures of what is no film


@pytest.mark.parametrize("written", ["-", "175"])
def test_a_height_that_is_no_number_of_metres_starts_nothing(browser, client, written):
    browser.open(client.address)
    browser.value("document.querySelector('.height').focus()")
    for key in written:
        browser.press(key)
    browser.push("[data-command=track]")
    browser.wait("document.querySelector('.asks').innerText.startsWith('The height is no number')")
    assert state(client)["films"][0]["work"] is None


def test_a_run_fills_the_fields_and_what_was_corrected_by_hand_goes_only_when_told(browser, client, folder):
    run = a_run(folder, height=1.7, options={"anchors": True}, start={})
    (run / "start.keypoints.csv").write_text("frame,keypoint,x,y\n3,hip,1,1\n")
    (folder / "walk.mp4").write_bytes(b"no film")
    browser.open(client.address)
    assert browser.each(".facing, .height", "one.value") == ["right", "1.7"]
    browser.value("window.confirm = (words) => { window.asked = words; return false; }; 0")
    browser.push("[data-command=track]")
    assert browser.value("window.asked") == (
        "This run was corrected by hand in 1 frame. Follow again without the corrections?"
    )
    assert state(client)["films"][0]["work"] is None
    browser.value("window.confirm = () => true; 0")
    browser.push("[data-command=track]")
    browser.wait("document.querySelector('.said p.fault')")
    browser.open("about:blank")
    browser.errors.clear()  # there is no picture of what is no film


def test_the_program_has_ended_only_where_it_does_not_answer(browser, client, folder, monkeypatch):
    browser.open(client.address)
    with monkeypatch.context() as broken:
        broken.setattr(client.server.desk, "told", lambda: (folder / "none").read_bytes())
        browser.wait("document.querySelector('#wrong').innerText.includes('No such file')")
    browser.wait("document.querySelector('#wrong').hidden")
    browser.value("window.fetch = () => Promise.reject(new TypeError()); 0")
    browser.wait("document.querySelector('#wrong').innerText.startsWith('figtrack app has ended')")
    browser.open("about:blank")
    browser.errors.clear()


@pytest.mark.whole
def test_a_page_that_is_open_is_linked_though_somebody_was_searched_before_it(browser, client):
    browser.open(client.address)
    browser.push("[data-command=annotate]")
    browser.wait("document.querySelector('.task a')")
    browser.push(".stop")
    browser.wait("document.querySelector('.said .fault')")
    assert "http" not in browser.text(".said")
    assert "Ctrl-C" not in browser.text(".said")
