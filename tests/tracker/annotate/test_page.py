"""The page in a real browser: clicks, drags, keys, touches, and the pixels that end up in the table."""

import re
import socket
import threading
import time
from contextlib import contextmanager, suppress

import cv2
import numpy as np
import pytest

from tests.tracker.clips import figtrack, write_table
from tests.tracker.processes import started
from tracker.annotate.marks import Table
from tracker.annotate.server import Server
from tracker.annotate.session import Session
from tracker.foreign.start_marks import Taken
from tracker.tables.keypoints import KEYPOINTS, Mark, read_keypoints

TO_WINDOW = """(() => {{
  const place = new DOMPoint({x}, {y}).matrixTransform(document.querySelector('#picture').getScreenCTM());
  return [place.x, place.y];
}})()"""
SAVED = "document.querySelector('#saved').textContent.startsWith('Saved')"
WHOLE = "document.querySelector('#image').getAttribute('href').startsWith('data:image/png')"
HUNDREDTH = 0.011  # pixels, in which places are written


class Page:
    """The page of one session, and what a person does on it."""

    def __init__(self, browser, address, **window):
        self.browser, self.address = browser, address
        browser.open(address, **window)
        browser.wait("document.querySelectorAll('#joints button').length === 9")

    def window(self, x, y):
        """Where a pixel of the frame is in the window."""
        return self.browser.value(TO_WINDOW.format(x=x, y=y))

    def click(self, x, y):
        self.browser.click(*self.window(x, y))

    def mark(self, places):
        """Click joints in the order in which the page asks for them."""
        for name in KEYPOINTS:
            assert self.browser.text("#guide").startswith(f"Click the {name.replace('_', ' ')}")
            self.click(*places[name])

    def drag(self, start, *others):
        self.browser.drag(*(self.window(*place) for place in (start, *others)))

    def press(self, *keys):
        for key in keys:
            self.browser.press(*key.split("+")[::-1])

    def points(self):
        """Where the page shows the marks, in pixels of the frame."""
        what = "[one.dataset.joint, one.cx.baseVal.value, one.cy.baseVal.value]"
        return {name: (x, y) for name, x, y in self.browser.each("#points circle[data-joint]", what)}

    def save(self):
        self.browser.push("#save")
        self.browser.wait(SAVED)

    def advice(self, words):
        """Until the page says this of the marks; the style gives a note a capital."""
        self.browser.wait(
            f"document.querySelector('#advice').innerText.toLowerCase().includes({words.lower()!r})"
        )

    def can_be_read(self, width):
        """Whether nothing sticks out of a window and words stand out from what is behind them."""
        assert self.browser.value("document.documentElement.scrollWidth") <= width
        contrasts = self.browser.value(CONTRASTS)
        assert len(contrasts) > 15
        assert {words: ratio for words, ratio in contrasts if ratio < 4.5} == {}

    def turn_to(self, frame, *keys):
        """Press keys, and wait until a frame is shown."""
        self.press(*keys)
        self.browser.wait(f"document.querySelector('#picture').ariaLabel === 'Frame {frame} of walk.mp4'")


@pytest.fixture
def table(tmp_path):
    return tmp_path / "k.csv"


@pytest.fixture
def page(browser, clip, table):
    """The page of a session on the rendered walk."""
    with session_page(browser, clip.video, table) as page:
        yield page


def session_page(browser, video, table, *, taken=None, **window):
    session = Session(video, Table(table), taken.frame if taken else 0, taken)
    return served(browser, session, **window)


@contextmanager
def served(browser, session, **window):
    """The page of a session."""
    with Server(session) as server:
        threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True).start()
        page = Page(browser, server.address, **window)
        page.server = server
        yield page
        browser.open("about:blank")  # a page that outlives its server complains
        server.shutdown()


@pytest.fixture
def truth(clip):
    """The joints of frame 0, hundredths of pixels."""
    return {name: tuple(np.round(places[0], 2).tolist()) for name, places in clip.joints.items()}


def near(place, wanted, within=HUNDREDTH):
    return np.hypot(*np.subtract(place, wanted)) <= within * np.sqrt(2.0)


def test_what_is_clicked_dragged_and_hidden_on_the_commands_page_is_in_its_table(browser, clip, table, truth):
    command = started("annotate", clip.video, "--out", table, "--empty", "--no-browser")
    page = Page(browser, re.search(r"http://\S+", command.stdout.readline())[0])
    page.mark(truth)
    page.drag(truth["hip"], (truth["hip"][0] + 40, 90), (truth["hip"][0] + 2, truth["hip"][1] + 1))
    browser.push("button[data-joint=far_knee]")
    browser.push("#hidden")
    page.advice("seems to face right")
    browser.push("#close")
    browser.wait("document.querySelector('.over')")
    assert "figtrack track" in browser.text(".over")
    out, errors = command.communicate(timeout=120)
    assert (command.returncode, errors) == (0, "")
    assert out.splitlines()[-2:] == [
        f"1 frame marked in {table}",
        f"next: figtrack track {clip.video} --keypoints {table}",
    ]

    marks = read_keypoints(table)[0]
    wanted = truth | {"hip": (truth["hip"][0] + 2, truth["hip"][1] + 1)}
    assert list(marks) == list(KEYPOINTS)
    for name, place in wanted.items():
        assert near((marks[name].x, marks[name].y), place), name
    assert [name for name, mark in marks.items() if not mark.visible] == ["far_knee"]

    out = table.parent / "followed"
    result = figtrack("track", clip.video, "--keypoints", table, "--model", "cv", "--stop", 1, "--out", out)
    assert result.exit_code == 0, result.stderr
    assert (out / "run.json").exists()


def test_the_middle_of_a_pixel_as_seen_is_that_pixel_in_the_table(browser, tmp_path, table):
    image = np.full((48, 64, 3), 60, np.uint8)
    image[21, 37] = 255
    (tmp_path / "v").mkdir()
    cv2.imwrite(str(tmp_path / "v" / "1.png"), image)
    with session_page(browser, tmp_path / "v", table) as page:
        browser.picture(tmp_path / "seen.png")
        (left, top), (right, bottom) = (np.round(page.window(*at)).astype(int) for at in ((0, 0), (63, 47)))
        seen = cv2.imread(str(tmp_path / "seen.png"), cv2.IMREAD_GRAYSCALE)[top:bottom, left:right]
        ys, xs = np.nonzero(seen == 255)
        assert len(xs) > 100
        browser.click(xs.mean() + left + 0.5, ys.mean() + top + 0.5)
        page.save()
    mark = read_keypoints(table)[0]["head_top"]
    assert near((mark.x, mark.y), (37, 21), 0.06)


def test_steps_are_undone_one_by_one_and_done_again(page, browser, truth):
    page.mark(truth)
    whole = page.points()
    page.drag(truth["neck"], (30, 40))
    moved = page.points()
    assert near(moved["neck"], (30, 40))
    browser.push("#undo")
    assert page.points() == whole
    page.press("Control+z", "Control+z")
    assert page.points().keys() == set(KEYPOINTS) - {"far_toe", "far_ankle"}
    assert browser.text("#guide").startswith("Click the far ankle")
    page.press("Control+y", "Control+Shift+Z")
    browser.push("#redo")
    assert page.points() == moved
    assert browser.value("document.querySelector('#redo').disabled")


def test_a_point_that_is_grabbed_beside_its_middle_does_not_jump(page, truth):
    page.mark(truth)
    x, y = truth["head_top"]
    page.drag((x + 2, y - 3), (x + 20, y + 20), (x + 12, y + 7))
    assert near(page.points()["head_top"], (x + 10, y + 10))


def test_the_wheel_zooms_to_the_pointer(page, browser, truth):
    at = page.window(*truth["hip"])
    for _ in range(4):
        browser.mouse("mouseWheel", *at, deltaX=0, deltaY=-240)
    browser.wait("document.querySelector('#picture').classList.contains('near')")
    # A wheel's place is in whole window pixels, and what is cut off is magnified.
    assert near(page.window(*truth["hip"]), at, 5.0)
    one, other = page.window(0, 0), page.window(1, 0)
    assert other[0] - one[0] > 7.0
    page.click(*truth["hip"])
    assert near(page.points()["head_top"], truth["hip"])
    page.press("0")
    assert browser.value("document.querySelector('#picture').getScreenCTM().a") < 3.0


def test_dragging_the_picture_moves_it_and_marks_nothing(page, browser):
    before = page.window(100, 100)
    page.drag((100, 100), (130, 90), (150, 120))
    shift = np.subtract(page.window(100, 100), before)
    assert shift[0] > 50
    assert page.points() == {}
    browser.push("#fit")
    assert near(page.window(100, 100), before)


def test_a_click_on_a_point_marks_the_joint_asked_for_where_legs_cross(page, truth):
    page.mark(truth | {"far_knee": truth["near_knee"]})
    assert near(page.points()["far_knee"], truth["near_knee"])
    assert near(page.points()["near_knee"], truth["near_knee"])


def test_arrow_keys_nudge_the_chosen_joint(page, browser, truth):
    page.mark(truth)
    page.press("3", "ArrowRight", "ArrowRight", "ArrowUp", "Shift+ArrowLeft", "Control+ArrowDown")
    x, y = truth["hip"]
    assert near(page.points()["hip"], (x + 1.75, y + 9), 2 * HUNDREDTH)
    browser.push("#undo")
    assert near(page.points()["hip"], truth["hip"])


def test_a_figure_can_be_marked_and_saved_with_the_keyboard_alone(page, browser, table):
    for step in ("Up", "Down", "Right", "Down", "Down", "Right", "Left", "Down", "Left"):
        page.press(*[f"Control+Arrow{step}"] * 2, "Enter")
    page.press("Control+s")
    browser.wait(SAVED)
    assert list(read_keypoints(table)[0]) == list(KEYPOINTS)


def test_the_keyboard_stays_on_the_joint_that_it_chose(page, browser):
    browser.value("document.querySelector('button[data-joint=near_knee]').focus()")
    page.press("Enter")
    assert browser.value("document.activeElement.dataset.joint") == "near_knee"
    assert browser.value("document.activeElement.getAttribute('aria-current')") == "true"
    assert browser.value("getComputedStyle(document.activeElement).outlineStyle") == "solid"


def test_joints_can_be_skipped_deleted_and_hidden_before_they_are_placed(page, browser, table, truth):
    for name in KEYPOINTS:
        if name == "near_toe":
            browser.push("#skip")
            continue
        if name == "far_ankle":
            page.press("h")
        page.click(*truth[name])
    page.press("9", "Delete", "s")
    assert "Left out: near toe, far toe" in browser.text("#guide")
    page.save()
    marks = read_keypoints(table)[0]
    assert [name for name in KEYPOINTS if name not in marks] == ["near_toe", "far_toe"]
    assert [name for name, mark in marks.items() if not mark.visible] == ["far_ankle"]


def test_every_frame_has_marks_of_its_own(page, browser, table, truth):
    page.click(*truth["head_top"])
    browser.push("#ahead1")
    page.turn_to(1)
    page.press("1")
    page.click(50, 60)
    page.turn_to(2, ".")
    browser.value(
        "(f => {f.value = 7; f.dispatchEvent(new Event('change'))})(document.querySelector('#frame'))"
    )
    page.turn_to(7)
    page.press("1")
    page.click(70, 80)
    page.turn_to(5, ",", ",")
    browser.push("#marked button:first-of-type")
    page.turn_to(0)
    assert near(page.points()["head_top"], truth["head_top"])
    page.save()
    assert {t: list(marks) for t, marks in read_keypoints(table).items()} == {
        t: ["head_top"] for t in (0, 1, 7)
    }


@pytest.mark.parametrize("key", ["p", " "])
def test_the_film_is_played_and_where_it_stops_the_frame_comes_whole(page, browser, key):
    page.server.session._frames.fps = 2.0  # or it might end before it is stopped
    browser.open(page.address)
    page.press(key)
    browser.wait("Number(document.querySelector('#frame').value) > 0")
    assert browser.text("#play") == "Stop"
    page.press(key)
    assert browser.text("#play") == "Play"
    browser.wait(WHOLE)
    assert page.points() == {}
    stopped = browser.value("document.querySelector('#frame').value")
    assert browser.value("document.querySelector('#slider').value") == stopped
    page.turn_to(int(stopped))


def test_keys_that_change_marks_stop_the_film(page, browser):
    page.server.session._frames.fps = 0.01
    browser.open(page.address)
    for key in ("Enter", "ArrowUp", "h", "s", "x", "Delete", "Control+z", "Control+y"):
        page.press("p")
        assert browser.text("#play") == "Stop"
        page.press(key)
        assert (browser.text("#play"), key) == ("Play", key)


def test_a_joint_that_is_held_while_another_frame_comes_is_moved_in_neither(browser, clip, table):
    write_table(table, [(0, "hip", 100, 90, 1), (1, "hip", 110, 80, 1)])
    with session_page(browser, clip.video, table) as page:
        page.server.session._frames.fps = 0.01
        browser.open(page.address)
        page.press("p")
        button = {"button": "left", "clickCount": 1}
        browser.mouse("mouseMoved", *page.window(100, 90))
        browser.mouse("mousePressed", *page.window(100, 90), **button)
        assert browser.text("#play") == "Play"
        browser.mouse("mouseMoved", *page.window(130, 90), button="left", buttons=1)
        page.turn_to(1, ".")
        browser.mouse("mouseMoved", *page.window(140, 95), button="left", buttons=1)
        browser.mouse("mouseReleased", *page.window(140, 95), **button)
        assert page.points() == {"hip": (110, 80)}
        page.turn_to(0, ",")
        assert page.points() == {"hip": (100, 90)}


def test_a_film_that_is_played_to_its_end_stops_there_and_begins_anew(page, browser):
    browser.push("#play")
    page.turn_to(9)
    browser.wait("document.querySelector('#play').textContent === 'Play'")
    browser.wait(WHOLE)
    page.server.session._frames.fps = 2.0
    page.press("p")
    browser.wait("Number(document.querySelector('#frame').value) < 9")


def test_the_slider_passes_frames_and_stops_at_one(page, browser):
    box = browser.value(
        "(b => [b.x, b.y + b.height / 2, b.width])(document.querySelector('#slider').getBoundingClientRect())"
    )
    browser.drag(*((box[0] + share * box[2], box[1]) for share in (0.02, 0.3, 0.9, 0.5)))
    browser.wait("['4', '5'].includes(document.querySelector('#frame').value)")
    browser.wait(WHOLE)


def test_keys_still_do_their_work_where_the_slider_was_used_last(page, browser, truth):
    page.mark(truth)
    browser.value("document.querySelector('#slider').focus()")
    page.turn_to(1, ".")
    page.turn_to(0, ",")
    page.press("x")
    assert near(page.points()["near_knee"], truth["far_knee"])


def test_a_marked_frame_is_judged_where_playing_stops(browser, clip, table, truth):
    x, y = truth["near_ankle"]
    too_long = truth | {"near_ankle": (x, y + 60.0)}
    marks = [(t, name, *place, 1) for t, of in enumerate((truth, too_long)) for name, place in of.items()]
    write_table(table, marks)
    with session_page(browser, clip.video, table) as page:
        page.server.session._frames.fps = 0.5
        browser.open(page.address)
        page.press("p")
        browser.wait("document.querySelector('#frame').value === '1'")
        time.sleep(0.4)  # longer than a mark that is set waits to be judged
        page.press("p")
        page.advice("times as far")


def test_the_slider_stays_where_it_is_held_while_earlier_frames_come(page, browser):
    held = browser.value(
        """new Promise(done => {
          const [slider, picture] = ['#slider', '#picture'].map(id => document.querySelector(id));
          const held = [];
          new MutationObserver(() => {
            held.push(slider.value);
            if (picture.ariaLabel.startsWith('Frame 4 ')) done(held);
          }).observe(picture, {attributeFilter: ['aria-label']});
          for (const at of [8, 4]) {slider.value = at; slider.dispatchEvent(new Event('input'))}
        })"""
    )
    assert held == ["4", "4"]


def test_a_further_frame_begins_with_the_nearest_that_is_marked_and_its_hip_carries_all(page, browser, truth):
    page.mark(truth)
    first = page.points()
    page.turn_to(1, ".")
    assert page.points() == first
    assert "The figure is that of frame 0" in browser.text("#guide")
    assert browser.text("#marked").split()[-1] == "0"  # nothing is marked by looking
    x, y = truth["hip"]
    page.drag((x, y), (x + 7, y - 2))
    assert all(near(place, np.add(truth[name], (7, -2))) for name, place in page.points().items())
    page.drag(page.points()["near_toe"], (90.0, 91.0))
    assert near(page.points()["near_toe"], (90.0, 91.0))
    assert near(page.points()["hip"], (x + 7, y - 2))
    page.press("Control+z", "Control+z")
    assert page.points() == first
    page.press("Enter")
    assert browser.text("#marked").split()[-1] == "1"
    browser.push("#clear")
    assert browser.text("#marked").split()[-1] == "0"


def test_arrow_keys_carry_the_whole_figure_of_a_further_frame_as_long_as_they_go_on(page, truth):
    page.mark(truth)
    first = page.points()
    page.turn_to(1, ".")
    page.press("3", *["Control+ArrowRight"] * 3, "ArrowUp")
    assert all(near(place, np.add(first[name], (30, -1))) for name, place in page.points().items())
    page.press("2", "ArrowUp", "3", "ArrowUp")
    moved = {name for name, place in page.points().items() if not near(place, np.add(first[name], (30, -1)))}
    assert moved == {"neck", "hip"}
    page.press(*["Control+z"] * 3)
    assert page.points() == first


def test_which_way_the_figure_faces_is_seen_or_said(page, browser, table, truth):
    page.mark(truth)
    browser.wait("document.querySelector('#right').ariaPressed === 'true'")
    browser.push("#left")
    page.advice("or choose faces right")
    browser.push("#close")
    browser.wait("document.querySelector('#doubt').open")
    browser.push("#leave")
    browser.wait("document.querySelector('.over')")
    assert "--facing left" in browser.text(".over")


def test_a_frame_beyond_the_end_is_said_and_the_page_stays_where_it_is(page, browser):
    page.press(">")
    browser.wait("document.querySelector('#saved').textContent.includes('ends with frame 9')")
    assert browser.value("document.querySelector('#frame').value") == "0"
    (refused,) = browser.errors
    assert refused.endswith("/frame/10")
    browser.errors.clear()


def test_what_cannot_be_right_is_said_at_once_and_again_before_closing(page, browser, clip, table):
    apart = int(np.argmax(np.abs(clip.joints["near_ankle"][:, 0] - clip.joints["far_ankle"][:, 0])))
    places = {name: joints[apart] for name, joints in clip.joints.items()}
    places |= {"near_ankle": places["far_ankle"], "far_ankle": places["near_ankle"]}
    page.mark(places)
    page.advice("near ankle and far ankle")
    browser.push("#close")
    browser.wait("document.querySelector('#doubt').open")
    assert "frame 0: near ankle and far ankle" in browser.text("#doubts").replace(
        "near knee and far knee, or ", ""
    )
    browser.push("#stay")
    page.drag(places["near_ankle"], places["far_ankle"])
    assert table.exists()


def test_missing_joints_are_said_when_the_rest_is_done(page, browser, truth):
    page.press("s")
    for name in KEYPOINTS[1:]:
        page.click(*truth[name])
    page.advice("Tracking cannot start from this frame without head top")


def test_a_table_that_exists_is_opened_and_extended(browser, clip, table):
    rows = [(0, "hip", 100, 90, 1, "me"), (4, "neck", 7, 8, 0, "you")]
    write_table(table, rows, ("frame", "keypoint", "x", "y", "visible", "by"))
    with session_page(browser, clip.video, table) as page:
        assert page.points() == {"hip": (100, 90)}
        assert browser.text("#marked").split()[-2:] == ["0", "4"]
        page.click(120, 40)
        page.save()
    first, *others = table.read_text().splitlines()[1:]
    assert others == ["0,hip,100,90,1,me", "4,neck,7,8,0,you"]
    assert first.startswith("0,head_top,")


def test_taken_marks_are_shown_unsaved_and_can_be_undone(browser, clip, table):
    taken = Taken(3, {"hip": Mark(50.5, 60.25, visible=False)}, "took 1 joint from somewhere")
    with session_page(browser, clip.video, table, taken=taken) as page:
        assert page.points() == {"hip": (50.5, 60.25)}
        assert browser.text("#saved") == "took 1 joint from somewhere"
        assert browser.value("document.title").startswith("* ")
        assert not table.exists()
        page.press("Control+z")
        assert page.points() == {}
        page.press("Control+y")
        page.save()
    assert read_keypoints(table) == {3: {"hip": Mark(50.5, 60.25, visible=False)}}


def test_fingers_tap_drag_and_pinch(browser, clip, table):
    with session_page(browser, clip.video, table, width=390, height=844, touch=True) as page:
        browser.touch("touchStart", page.window(200, 120))
        browser.touch("touchEnd")
        assert near(page.points()["head_top"], (200, 120), 0.7)
        before = browser.value("document.querySelector('#picture').getScreenCTM().a")
        (x, y) = page.window(240, 135)
        browser.touch("touchStart", (x - 20, y), (x + 20, y))
        for apart in (30, 40, 50, 60):
            browser.touch("touchMove", (x - apart, y), (x + apart, y))
        browser.touch("touchEnd")
        assert browser.value("document.querySelector('#picture').getScreenCTM().a") == pytest.approx(
            3.0 * before, rel=0.05
        )
        assert list(page.points()) == ["head_top"]


@pytest.mark.parametrize("width", [1280, 390])
@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_nothing_sticks_out_and_words_stand_out_from_what_is_behind_them(browser, clip, table, width, dark):
    with session_page(
        browser, clip.video, table, width=width, height=800, dark=dark, touch=width < 500
    ) as page:
        page.press("s")
        page.can_be_read(width)
        assert (
            browser.value("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
        ) != dark


# Every element with words of its own: the ratio of luminances of its ink and of what it stands on (WCAG 2).
CONTRASTS = """(() => {
  const numbers = (colour) => colour.match(/[0-9.]+/g).map(Number);
  const light = (colour) => {
    const [r, g, b] = numbers(colour).map((v) => v / 255)
      .map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const ground = (element) => {
    const colour = getComputedStyle(element).backgroundColor;
    return numbers(colour)[3] === 0 ? ground(element.parentElement) : colour;
  };
  const worded = [...document.querySelectorAll('body *')].filter((element) =>
    !element.closest('svg, script, style, :disabled, dialog') && element.getClientRects().length &&
    [...element.childNodes].some((node) => node.nodeType === 3 && node.textContent.trim()));
  return worded.map((element) => {
    const [one, other] = [light(getComputedStyle(element).color), light(ground(element))];
    return [element.innerText, (Math.max(one, other) + 0.05) / (Math.min(one, other) + 0.05)];
  });
})()"""


def test_every_control_has_a_name(page, browser):
    named = "one.ariaLabel || one.textContent.trim() || one.labels?.length ? '' : one.outerHTML"
    assert not any(browser.each("button, input, [role=application], [role=group], section", named))


def test_a_server_that_is_gone_is_said_and_the_marks_stay(browser, clip, table, truth):
    with session_page(browser, clip.video, table) as page:
        page.server.shutdown()
        page.server.server_close()
        # The process that ends takes along what the browser connected beforehand.
        for connection in tuple(page.server.waiting):
            with suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)
        page.click(*truth["head_top"])
        browser.push("#save")
        browser.wait("document.querySelector('#saved').textContent.includes('does not answer any more')")
        assert list(page.points()) == ["head_top"]
        browser.errors.clear()
