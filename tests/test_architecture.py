"""The arrows of ARCHITECTURE.md: every import of the four packages is read, and one not drawn there fails."""

import ast
import sys
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

# What each package may import beside itself and the standard library; None: whatever is installed.
ALLOWED = {
    "kinematics": {"numpy"},
    "dynamics": {"numpy", "scipy"},
    "videos": {"numpy", "cv2", "av"},
    "tracker": None,
}
# The loop takes arrays: only the ends of tracker know of files of pictures.
SEE_VIDEOS = {
    "cli",
    "clip",
    "reel",
    "comparison",
    "demo",
    "drawing",
    "report.pictures",
    "annotate.frames",
    "annotate.server",
    "faults",
    "motion.plots",
    "motion.clip",
    "reproduce.plots",
}
MOST_LINES = 400


def imported(source, package=""):
    """Dotted names that a module imports anywhere in it, functions and type checking included.

    Args:
        source: the module's text.
        package: dotted name of the package it is in, for relative imports.
    """
    names = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[: len(package.split(".")) + 1 - node.level] if node.level else []
            base = ".".join([*above, *([node.module] if node.module else [])])
            names.update({base, *(f"{base}.{alias.name}" for alias in node.names)})
    return names


@cache
def modules(package):
    """Path of every module by its dotted name."""
    paths = (ROOT / package).rglob("*.py")
    return {".".join(path.relative_to(ROOT).with_suffix("").parts): path for path in paths}


@cache
def imports_of(package):
    """What every module of a package imports, by its dotted name."""
    return {
        name: imported(path.read_text(encoding="utf-8"), name.rpartition(".")[0])
        for name, path in modules(package).items()
    }


@pytest.mark.parametrize("package", [name for name, allowed in ALLOWED.items() if allowed is not None])
def test_a_package_imports_only_what_is_drawn(package):
    allowed = ALLOWED[package] | {package} | sys.stdlib_module_names
    wrong = {
        f"{module} -> {name}"
        for module, names in imports_of(package).items()
        for name in names
        if name.partition(".")[0] not in allowed
    }
    assert not wrong


def test_in_tracker_only_its_ends_import_videos():
    seen = {
        module
        for module, names in imports_of("tracker").items()
        if any(name.partition(".")[0] == "videos" for name in names)
    }
    assert {module.removeprefix("tracker.") for module in seen} <= SEE_VIDEOS


@pytest.mark.parametrize("package", ALLOWED)
def test_no_modules_import_each_other_in_a_circle(package):
    ours = set(modules(package))
    graph = {module: (names & ours) - {module} for module, names in imports_of(package).items()}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))


def test_nothing_imports_the_tests():
    for package in ALLOWED:
        for module, names in imports_of(package).items():
            assert not any(name.partition(".")[0] == "tests" for name in names), module


@pytest.mark.parametrize("package", ALLOWED)
def test_a_module_stays_short_enough_to_read(package):
    lines = {
        name: len(path.read_text(encoding="utf-8").splitlines()) for name, path in modules(package).items()
    }
    assert {name: count for name, count in lines.items() if count >= MOST_LINES} == {}


def test_every_package_has_modules_to_check():
    for package in ALLOWED:
        assert len(modules(package)) > 3


def test_an_import_is_found_wherever_it_is_written():
    source = """
import numpy as np, av.container
from typing import TYPE_CHECKING
if TYPE_CHECKING:
    from tracker.clip.follow import Job
def f():
    from . import report
    from .store import save
    from ..videos import frames
"""
    wanted = {
        "numpy",
        "av.container",
        "tracker.clip.follow",
        "a.tracker.report",
        "a.tracker.store",
        "a.videos.frames",
    }
    assert wanted <= imported(source, "a.tracker")
