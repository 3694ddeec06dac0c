"""A real browser, headless, driven over the DevTools protocol: Debian's Chromium, nothing downloaded."""

import base64
import itertools
import json
import shutil
import subprocess
import time
from contextlib import contextmanager
from http.client import HTTPConnection

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
PATIENCE = 30.0  # seconds for anything the browser is asked for
LEFT = "Inspected target navigated", "Execution context was destroyed"  # how errors of such scripts begin
MODIFIERS = {"Alt": 1, "Control": 2, "Meta": 4, "Shift": 8}
KEY_CODES = {
    "Enter": 13,
    "Escape": 27,
    "Delete": 46,
    "Tab": 9,
    " ": 32,
    ",": 188,
    ".": 190,
    "<": 188,
    ">": 190,
}
KEY_CODES |= {f"Arrow{way}": 37 + i for i, way in enumerate(("Left", "Up", "Right", "Down"))}
OPTIONS = (
    "--headless=new --no-sandbox --disable-gpu --disable-dev-shm-usage --no-first-run --no-proxy-server "
    "--remote-debugging-port=0"
)


class PageLeftError(AssertionError):
    """A script of a page that was left for another before it was done."""


class Browser:
    """One page.

    errors : what its console complained of, uncaught errors and refused resources too
    """

    def __init__(self, socket):
        self._socket, self._numbers, self.errors = socket, itertools.count(1), []
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def call(self, method, **params):
        """One command, and its answer; what comes meanwhile is looked at."""
        number = next(self._numbers)
        self._socket.send(json.dumps({"id": number, "method": method, "params": params}))
        while True:
            message = json.loads(self._socket.recv())
            if message.get("id") == number:
                if message.get("error", {}).get("message", "").startswith(LEFT):
                    raise PageLeftError(message)
                assert "error" not in message, message
                return message["result"]
            self._heard(message)

    def open(self, address, *, width=1280, height=800, dark=False, touch=False):
        """Show a page in a window of this size, and wait until it is there."""
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.call("Emulation.setEmulatedMedia", features=[scheme])
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": touch}
        self.call("Emulation.setDeviceMetricsOverride", **size)
        self.call("Emulation.setTouchEmulationEnabled", enabled=touch)
        self.call("Page.navigate", url=address)
        self.wait("document.readyState === 'complete'")

    def value(self, script):
        """What a script comes to."""
        answer = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def wait(self, script):
        """Until a script's value is true."""
        end = time.monotonic() + PATIENCE
        while not self._true(script):
            assert time.monotonic() < end, f"never came true: {script}"
            time.sleep(0.02)

    def _true(self, script):
        """Whether a script's value is true; nothing is of a page that is just left for another."""
        try:
            return self.value(f"Boolean({script})")
        except PageLeftError:
            return False

    def text(self, selector):
        return self.value(f"document.querySelector({json.dumps(selector)}).innerText")

    def each(self, selector, what):
        """What a script comes to of each element, which it calls `one`."""
        return self.value(f"[...document.querySelectorAll({json.dumps(selector)})].map(one => {what})")

    def box(self, selector, i=0):
        """Left, top, width and height of an element, pixels of the window."""
        boxes = "(b => [b.x, b.y, b.width, b.height])(one.getBoundingClientRect())"
        return self.each(selector, boxes)[i]

    def press(self, key, *held):
        """One key, others held down."""
        flags = sum(MODIFIERS[name] for name in held)
        code = KEY_CODES.get(key, ord(key[0].upper()))
        event = {"key": key, "modifiers": flags, "windowsVirtualKeyCode": code}
        text = {"text": "\r" if key == "Enter" else key} if len(key) == 1 or key == "Enter" else {}
        self.call("Input.dispatchKeyEvent", type="keyDown", **event, **({} if flags & 7 else text))
        self.call("Input.dispatchKeyEvent", type="keyUp", **event)

    def mouse(self, kind, x, y, **more):
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def click(self, x, y):
        """Move there and click."""
        self.drag((x, y))

    def drag(self, *places):
        """Press at the first place, go through the others, let go at the last."""
        button = {"button": "left", "clickCount": 1}
        self.mouse("mouseMoved", *places[0])
        self.mouse("mousePressed", *places[0], **button)
        for place in places[1:]:
            self.mouse("mouseMoved", *place, button="left", buttons=1)
        self.mouse("mouseReleased", *places[-1], **button)

    def touch(self, kind, *points):
        self.call("Input.dispatchTouchEvent", type=kind, touchPoints=[{"x": x, "y": y} for x, y in points])

    def push(self, selector):
        """Click the middle of an element."""
        self.value(f"document.querySelector({json.dumps(selector)}).scrollIntoView({{block: 'center'}})")
        left, top, width, height = self.box(selector)
        self.click(left + width / 2, top + height / 2)

    def picture(self, path):
        """A screenshot as PNG."""
        path.write_bytes(base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"]))

    def _heard(self, message):
        params = message.get("params", {})
        kind = message.get("method")
        if kind == "Runtime.exceptionThrown":
            details = params["exceptionDetails"]
            self.errors.append(details["text"] + str(details.get("exception")))
        elif kind == "Runtime.consoleAPICalled" and params["type"] in ("error", "warning", "assert"):
            self.errors.append(str(params["args"]))
        elif kind == "Log.entryAdded" and params["entry"]["level"] in ("error", "warning"):
            self.errors.append(f"{params['entry']['text']} {params['entry'].get('url', '')}")
        elif kind == "Page.javascriptDialogOpening":
            method = "Page.handleJavaScriptDialog"
            answer = {"id": next(self._numbers), "method": method, "params": {"accept": True}}
            self._socket.send(json.dumps(answer))


@contextmanager
def chromium(folder):
    """A browser with an empty page; the test is skipped where there is none.

    Args:
        folder: for its profile.
    """
    found = next((path for name in NAMES if (path := shutil.which(name))), None)
    if found is None:
        pytest.skip("no Chromium here; Debian's package chromium has one")
    websocket = pytest.importorskip(
        "websocket", reason="websocket-client is not installed; it is among [dev]"
    )
    command = [found, *OPTIONS.split(), f"--user-data-dir={folder}", "about:blank"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        page = _page(folder / "DevToolsActivePort")
        socket = websocket.create_connection(page, timeout=PATIENCE, suppress_origin=True)
        try:
            yield Browser(socket)
        finally:
            socket.close()
    finally:
        process.terminate()
        process.wait(PATIENCE)


def _page(announcement):
    """Address of the first page's socket, once the browser has announced its port."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        if announcement.exists() and (lines := announcement.read_text().split()):
            connection = HTTPConnection("127.0.0.1", int(lines[0]), timeout=PATIENCE)
            connection.request("GET", "/json/list")
            pages = [one for one in json.load(connection.getresponse()) if one["type"] == "page"]
            connection.close()
            if pages:
                return pages[0]["webSocketDebuggerUrl"]
        time.sleep(0.05)
    raise TimeoutError("Chromium did not announce its debugging port")
