"""The arrows drawn in ARCHITECTURE.md: every import of the packages is read; one not drawn there fails."""

import ast
import re
import sys
from collections import Counter
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("kinematics", "dynamics", "videos", "tracker")
TOP = "top"  # in a picture: the modules of a package that lie in none of its folders
EVERYWHERE = {"numpy", *sys.stdlib_module_names}
FOR_EVERY_ROOM = {
    f"tracker.{name}" for name in ("settings", "errors", "progress", "compiled", "often", "__version__")
}
NO_FILES = ("tracker.picture", "tracker.registration", "tracker.loop")
FILES = {"csv", "io", "json", "os", "pathlib", "shutil", "tempfile", "videos"}
MOST_LINES = 400
SAME_NAME = {"app", "page"}


def drawn(text):
    """What each room may import beside itself, by the pictures of a text.

    A picture is headed by a package, as in 'tracker/', and has a line for each room: its name and, after an
    arrow, whence it imports, 'loop --> picture, dynamics'. A room of that package stands for itself,
    any other name for a package or a module.
    """
    arrows, package = {}, None
    for line in text.splitlines():
        if head := re.match(r"    (\w+)/", line):
            package = head[1]
        elif room := re.fullmatch(r"        (\w+)(?: +--> +([\w.]+(?:, [\w.]+)*))?(?:  .*)?", line):
            arrows[f"{package}.{room[1]}"] = set((room[2] or "").split(", ")) - {""}
    for room, names in arrows.items():
        rooms = {name: f"{room.partition('.')[0]}.{name}" for name in names}
        arrows[room] = {rooms[name] if rooms[name] in arrows else name for name in names}
    return arrows


def imported(source):
    """Dotted names that a module imports anywhere in it, functions and type checking included."""
    names = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"write the whole name of {node.module or node.names[0].name}"
            names.update({node.module, *(f"{node.module}.{alias.name}" for alias in node.names)})
    return names


@cache
def modules(package):
    """Path of every module by its dotted name."""
    paths = (ROOT / package).rglob("*.py")
    return {".".join(path.relative_to(ROOT).with_suffix("").parts): path for path in paths}


@cache
def imports_of(package):
    """What every module of a package imports, by its dotted name."""
    return {name: imported(path.read_text(encoding="utf-8")) for name, path in modules(package).items()}


@cache
def house():
    """The arrows of ARCHITECTURE.md."""
    return drawn((ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8"))


def room_of(name, arrows):
    """The room that a dotted name lies in, or the name of another package."""
    package, _, rest = name.partition(".")
    if package not in PACKAGES or not rest:
        return package
    room = ".".join(name.split(".")[:2])
    return room if room in arrows else f"{package}.{TOP}"


def undrawn(module, names, arrows):
    """The names that a module imports although no arrow leads from its room to theirs."""
    room = room_of(module, arrows)
    allowed = arrows.get(room, set()) | EVERYWHERE | {room}
    if room.startswith("tracker."):
        allowed |= FOR_EVERY_ROOM
        names = {name for name in names if name.partition(".")[0] in {*PACKAGES, "tests"}} - {"tracker"}
    return {name for name in names if not stands_for(name, arrows) & allowed}


def stands_for(name, arrows):
    """What in a picture an imported name may stand for: itself, its module, its room, its package."""
    return {name, name.rpartition(".")[0], room_of(name, arrows), name.partition(".")[0]}


def test_every_import_stands_for_an_arrow_of_the_picture():
    wrong = {
        f"{module} -> {name}"
        for package in PACKAGES
        for module, names in imports_of(package).items()
        for name in undrawn(module, names, house())
    }
    assert not wrong


def test_every_arrow_of_the_picture_stands_for_an_import():
    seen = {}
    for package in PACKAGES:
        for module, names in imports_of(package).items():
            reached = seen.setdefault(room_of(module, house()), set())
            reached.update(*(stands_for(name, house()) for name in names))
    idle = {f"{room} --> {name}" for room, names in house().items() for name in names - seen.get(room, set())}
    assert not idle


def test_every_folder_is_a_room_of_the_picture():
    folders = {".".join(name.split(".")[:2]) for p in PACKAGES for name in modules(p) if name.count(".") > 1}
    assert folders <= set(house())


def assert_no_circle(reached):
    """Nothing can be reached from itself, by what each name reaches beside itself."""
    try:
        TopologicalSorter({name: others - {name} for name, others in reached.items()}).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))


def test_rooms_lead_down():
    assert_no_circle(house())


@pytest.mark.parametrize("room", NO_FILES)
def test_what_happens_to_a_frame_knows_no_files(room):
    reading = {
        f"{module} -> {name}"
        for module, names in imports_of("tracker").items()
        if module.startswith(f"{room}.")
        for name in names
        if name.partition(".")[0] in FILES
    }
    assert not reading


@pytest.mark.parametrize("package", PACKAGES)
def test_no_modules_import_each_other_in_a_circle(package):
    ours = set(modules(package))
    assert_no_circle({module: names & ours for module, names in imports_of(package).items()})


@pytest.mark.parametrize("package", [*PACKAGES, "tests"])
def test_a_module_stays_short_enough_to_read(package):
    lines = {
        name: len(path.read_text(encoding="utf-8").splitlines()) for name, path in modules(package).items()
    }
    assert {name: count for name, count in lines.items() if count > MOST_LINES} == {}


@pytest.mark.parametrize("package", PACKAGES)
def test_a_name_says_which_module_is_meant(package):
    folders = {part for name in modules(package) for part in name.split(".")[1:-1]}
    count = Counter([*folders, *(name.rpartition(".")[2] for name in modules(package))])
    twice = {name for name, number in count.items() if number > 1} - {"__init__", *SAME_NAME}
    assert not twice


PICTURE = """
    tracker/
        high --> low, dynamics.kalman     words
        low  --> kinematics
    dynamics/
        learning --> top
        top
    videos/
        top --> cv2
"""


@pytest.mark.parametrize(
    ("module", "name"),
    [
        ("tracker.low.a", "tracker.high.b"),
        ("videos.frames", "matplotlib.pyplot"),
        ("tracker.low.a", "videos.frames"),
        ("tracker.high.a", "dynamics.viterbi"),
        ("tracker.high.a", "tests.oracles"),
        ("dynamics.kalman", "dynamics.learning.em"),
    ],
)
def test_an_import_without_an_arrow_is_found(module, name):
    assert undrawn(module, {name}, drawn(PICTURE)) == {name}


def test_an_import_is_found_wherever_it_is_written():
    source = """
import numpy as np, av.container
from typing import TYPE_CHECKING
if TYPE_CHECKING:
    from tracker.clip.follow import Job
def f():
    from tracker import report
"""
    assert {"numpy", "av.container", "tracker.clip.follow", "tracker.report"} <= imported(source)
