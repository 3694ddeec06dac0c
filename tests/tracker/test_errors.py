"""What is told of a failure, and what is left to be a traceback."""

import errno
import os

import numpy as np
import pytest

from dynamics.store import ModelError
from tracker.errors import fault
from tracker.run.folder import FolderError
from videos.container import VideoError


@pytest.mark.parametrize("kind", [ValueError, ModelError, FolderError, VideoError])
def test_what_the_house_says_is_told_as_it_is(kind):
    assert fault(kind("a.csv lacks x; add it")) == "a.csv lacks x; add it"


@pytest.mark.parametrize(
    "error", [KeyError("x"), AttributeError("x"), TypeError("x"), np.linalg.LinAlgError("x")]
)
def test_a_mistake_of_ours_is_not_told_as_one_of_the_users(error):
    with pytest.raises(type(error), match="x"):
        fault(error)


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EFBIG, errno.EDQUOT])
def test_a_full_disk_is_told_without_the_name_of_a_file_that_is_gone(number):
    said = fault(OSError(number, os.strerror(number), "/data/.out.x1y2z3a4.part/new/pose.csv"))
    assert said == f"no room to write ({os.strerror(number)}); make some, or choose another --out"


def test_what_the_system_refuses_is_told_with_the_file():
    assert fault(PermissionError(errno.EACCES, "Permission denied", "a.csv")) == "Permission denied: a.csv"
    assert fault(OSError("no device")) == "no device"


def test_want_of_memory_is_told():
    with pytest.raises(MemoryError) as caught:
        np.zeros((2**40, 2**10))
    assert "not enough memory" in fault(caught.value)


def test_a_name_that_would_break_the_line_or_move_the_cursor_does_not():
    assert (
        fault(ValueError("no video at a\nb\x1b[2J\udcff.mp4; 走る"))
        == "no video at a\\nb\\x1b[2J\\udcff.mp4; 走る"
    )
