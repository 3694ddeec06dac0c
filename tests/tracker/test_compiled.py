"""Compiled functions where nothing can be kept: a service user, a container that cannot be written."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SUMS = """
import numpy as np
from tracker.compiled import tell_unkept
from tracker.outline.viterbi import best_path
from tracker.progress import Progress
print(best_path(np.eye(3, dtype=np.float32)[:, :, None, None], 1.0, 0.1, 1).tolist())
for _ in range(2):
    tell_unkept(Progress("plain"))
"""


@pytest.fixture
def sealed(tmp_path):
    """The packages, in which not even root can keep what it compiles."""
    for package in ("tracker", "kinematics", "dynamics", "videos"):
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    for place in [path for path in tmp_path.rglob("*") if path.is_dir()]:
        (place / "__pycache__").write_text("no folder")
    return tmp_path


def test_where_neither_package_nor_home_can_be_written_it_is_compiled_all_the_same_and_said_once(sealed):
    away = {"HOME": os.devnull, "XDG_CACHE_HOME": os.devnull, "LOCALAPPDATA": os.devnull}
    environment = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    done = subprocess.run(
        [sys.executable, "-c", SUMS],
        env=environment | away | {"PYTHONPATH": str(sealed)},
        cwd=sealed,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert (done.returncode, done.stdout) == (0, "[[0, 0, 0], [1, 0, 0], [2, 0, 0]]\n"), done.stderr
    assert done.stderr.count("NUMBA_CACHE_DIR names a folder that keeps it") == 1
    assert len(done.stderr.splitlines()) == 1
