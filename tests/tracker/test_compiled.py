"""Compiled functions: kept from run to run, and where nothing can be kept, as in a sealed container."""

import importlib
import os
import shutil
from typing import get_type_hints

import numba
import pytest

from tests.tracker.processes import ROOT, printed_by

SUMS = """
import sys
import numpy as np
from tracker.compiled import tell_unkept
from tracker.outline.viterbi import best_phases
from tracker.progress import Progress
print(best_phases(np.array([[0.0, 0.5]]), np.ones(1), 1.0, 1.0)[0])
sys.stderr = sys.stdout
for _ in range(2):
    tell_unkept(Progress("plain"))
"""


OUTLINES = """
import hashlib
import numpy as np
from kinematics.figure_file import load_figure
from tracker.outline.shape import Grid, Shape
rng, grid = np.random.default_rng(1), Grid((-1.2, 1.2), 24.0, (60, 60))
figure = load_figure()
shape = Shape.of(figure)
q = 0.15 * rng.normal(size=(20, len(figure.freedoms)))
odds = rng.normal(size=(20, 60, 60)).astype(np.float32)
found = *shape.painted(q, grid), *shape.under(q, odds, 0.5 * odds, grid)
print(hashlib.sha256(b"".join(each.tobytes() for each in found)).hexdigest())
"""


def kept(module):
    """The functions of a module whose compiled form is kept from run to run."""
    found = [each for each in vars(module).values() if isinstance(each, numba.core.dispatcher.Dispatcher)]
    return [each.py_func for each in found if each.stats.cache_path]


def test_kept_functions_take_nothing_whose_class_may_be_renamed_or_their_index_stops_the_next_version():
    files = [path for room in ("dynamics", "tracker") for path in (ROOT / room).rglob("*.py")]
    some = [path.relative_to(ROOT) for path in files if "compiled import compiled" in path.read_text("utf-8")]
    modules = [importlib.import_module(".".join(path.with_suffix("").parts)) for path in some]
    functions = [each for module in modules for each in kept(module)]
    assert len(functions) >= 15
    named = [kind for each in functions for kind in get_type_hints(each).values() if hasattr(kind, "_fields")]
    assert named == []


@pytest.fixture
def sealed(tmp_path):
    """The packages, in which not even root can keep what it compiles."""
    for package in ("tracker", "kinematics", "dynamics", "videos"):
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    for place in [path for path in tmp_path.rglob("*") if path.is_dir()]:
        (place / "__pycache__").write_text("no folder")
    return tmp_path


@pytest.mark.whole
def test_where_neither_package_nor_home_can_be_written_it_is_compiled_all_the_same_and_said_once(sealed):
    away = {"HOME": os.devnull, "XDG_CACHE_HOME": os.devnull, "LOCALAPPDATA": os.devnull}
    environment = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    said, aside = printed_by(SUMS, sealed, environment | away)
    assert said == "0.5"
    assert "NUMBA_CACHE_DIR names a folder that keeps it" in aside


@pytest.mark.whole
def test_outlines_are_the_same_to_the_last_bit_compiled_anew_or_as_kept(tmp_path):
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    anew = printed_by(OUTLINES, environment=environment)
    code = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.nbc")}
    again = printed_by(OUTLINES, environment=environment)
    assert again == anew
    assert code
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.nbc")} == code  # nothing is compiled
