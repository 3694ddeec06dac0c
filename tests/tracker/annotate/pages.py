"""The marking page of a session, and what a person does on it in a browser."""

from contextlib import contextmanager

import numpy as np

from tests.tracker.annotate.clients import serving
from tracker.annotate.marks import Table
from tracker.annotate.server import Server
from tracker.annotate.session import Session
from tracker.tables.keypoints import KEYPOINTS

TO_WINDOW = """(() => {{
  const place = new DOMPoint({x}, {y}).matrixTransform(document.querySelector('#picture').getScreenCTM());
  return [place.x, place.y];
}})()"""
SAVED = "document.querySelector('#saved').textContent.startsWith('Saved')"
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


def session_page(browser, video, table, *, taken=None, **window):
    session = Session(video, Table(table), 0)
    if taken:
        session.start_from(taken)
    return served(browser, session, **window)


@contextmanager
def served(browser, session, **window):
    """The page of a session."""
    with serving(Server(session)) as client:
        try:
            page = Page(browser, client.address, **window)
            page.server = client.server
            yield page
        finally:
            browser.open("about:blank")  # a page that outlives its server complains


def near(place, wanted, within=HUNDREDTH):
    return np.hypot(*np.subtract(place, wanted)) <= within * np.sqrt(2.0)


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
