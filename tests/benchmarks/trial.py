"""A new user's first minutes: from a clone to the files of other programs, by what the README says.

`make trial` clones what is committed here into a folder of its own, does `make demo` there, marks the figure
of the demo's clip in a real browser, follows it, looks at what came of it, exports it, and prints the seconds
of each step. Only the clone's own environment is used for that; the browser is driven from this one.
"""

import math
import os
import re
import shlex
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from tests.tracker.annotate.pages import Page
from tests.tracker.browser import chromium
from tests.tracker.clips import read_csv

ROOT = Path(__file__).parents[2]
ENDINGS = {
    "dlc": ".dlc.csv",
    "trc": ".trc",
    "mot": ".mot",
    "sports2d": "_px.trc",
    "openpose": "-openpose",
    "myogait": ".myogait.json",
}
RUN = "walk-track"


class Terminal:
    """What a person types in a folder, with an environment's commands at hand.

    seconds : of each step done so far
    """

    def __init__(self, folder: Path, commands: Path, **variables: str) -> None:
        self.folder, self.seconds = folder, dict[str, float]()
        path = f"{commands}{os.pathsep}{os.environ['PATH']}"
        self.environment = {**os.environ, "PATH": path, **variables}

    def type(self, line: str) -> str:
        """What a command prints; AssertionError unless it ends well."""
        done = subprocess.run(
            shlex.split(line),
            cwd=self.folder,
            env=self.environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, f"{line}\n{done.stdout}{done.stderr}"
        return done.stdout

    def start(self, line: str) -> "subprocess.Popen[str]":
        """A command that goes on."""
        pipe = subprocess.PIPE
        return subprocess.Popen(
            shlex.split(line), cwd=self.folder, env=self.environment, stdout=pipe, stderr=pipe, text=True
        )

    def timed(self, step: str, work: Callable[[], None]) -> None:
        began = time.perf_counter()
        work()
        self.seconds[step] = time.perf_counter() - began


def first_minutes(terminal: Terminal, demo: str, profile: Path) -> None:
    """From the demo to the exports, each step timed; AssertionError where something is not as it should be.

    Args:
        demo: the line that makes the demo.
        profile: a folder for the browser.
    """
    terminal.timed("demo", lambda: _demo(terminal, demo))
    terminal.timed("mark, follow, look", lambda: _mark_and_follow(terminal, profile))
    terminal.timed("export", lambda: _export(terminal))


def exports(folder: Path) -> dict[str, Path]:
    """Where each export lies."""
    return {to: folder / f"{RUN}{ending}" for to, ending in ENDINGS.items()}


def errors(folder: Path) -> list[float]:
    """How far each joint of each frame but the first is from the truth, in lengths of the near leg."""
    truth, found = (
        _places(folder / name) for name in ("figtrack-demo/walk.keypoints.csv", f"{RUN}/keypoints.csv")
    )
    hip, knee, ankle = (truth["0", name] for name in ("hip", "near_knee", "near_ankle"))
    leg = math.dist(hip, knee) + math.dist(knee, ankle)
    return [math.dist(place, found[key]) / leg for key, place in truth.items() if key[0] != "0"]


def _demo(terminal: Terminal, line: str) -> None:
    out = terminal.type(line)
    assert "open figtrack-demo/report.html" in out
    assert re.search(r"^walk-run +never", out, re.MULTILINE), out


def _mark_and_follow(terminal: Terminal, profile: Path) -> None:
    """Click the true joints of frame 0, then type what the command says comes next, and open the report."""
    truth = _places(terminal.folder / "figtrack-demo" / "walk.keypoints.csv")
    joints = {name: place for (frame, name), place in truth.items() if frame == "0"}
    with chromium(profile) as browser:
        command = terminal.start("figtrack annotate figtrack-demo/walk.mp4 --empty --no-browser")
        assert command.stdout is not None
        page = Page(browser, re.search(r"http://\S+", command.stdout.readline())[0])
        page.mark(joints)
        browser.push("#close")
        browser.wait("document.querySelector('.over')")
        out, said = command.communicate(timeout=120)
        assert (command.returncode, said, browser.errors) == (0, "", [])
        print(terminal.type(out.splitlines()[-1].removeprefix("next: ")).rstrip())
        report = terminal.folder / RUN / "report.html"
        if report.exists():
            browser.open(report.as_uri())
            assert browser.errors == []


def _export(terminal: Terminal) -> None:
    terminal.type(f"figtrack export {RUN} --to all --height 1.75")
    assert all(path.exists() for path in exports(terminal.folder).values())


def _places(path: Path) -> dict[tuple[str, str], tuple[float, float]]:
    return {(row["frame"], row["keypoint"]): (float(row["x"]), float(row["y"])) for row in read_csv(path)}


def main() -> None:
    """The whole of it in a clone, which is left for a look where something went wrong."""
    place = Path(tempfile.mkdtemp(prefix="figtrack-trial-"))
    clone, began = place / "figtrack", time.perf_counter()
    subprocess.run(["git", "clone", "--quiet", str(ROOT), str(clone)], check=True)
    terminal = Terminal(clone, clone / ".venv" / "bin")
    print(f"in {clone}")
    first_minutes(terminal, "make demo", place / "browser")
    total, off = time.perf_counter() - began, errors(clone)
    for step, seconds in terminal.seconds.items():
        print(f"{step}: {seconds:.0f} s")
    print(f"in all {total:.0f} s; joints off by {sum(off) / len(off):.3f} leg lengths at the mean")


if __name__ == "__main__":
    sys.exit(main())
