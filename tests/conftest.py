"""Fixtures shared by every room."""

import os
import signal
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from tests.tracker.browser import Browser, chromium
from tests.tracker.clips import Clip, make_clip, write_video
from tests.tracker.outline.films import FIRST, a_walk
from tracker.models.cluster import local_cluster

if TYPE_CHECKING:
    from distributed import Client

# Started in the background of a script, or by nohup, tests would hand on that these are ignored.
signal.signal(signal.SIGINT, signal.default_int_handler)
if hasattr(signal, "SIGHUP"):
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20)


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """The folder of real captures and clips; its tests skip where it is not given."""
    folder = os.environ.get("FIGTRACK_DATA")
    if not folder:
        pytest.skip("FIGTRACK_DATA names no folder of captures and clips")
    return Path(folder)


@pytest.fixture(scope="session")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Clip:
    """Ten frames of a rendered walk; not to be written to."""
    return make_clip(tmp_path_factory.mktemp("clip"))


@pytest.fixture(scope="session")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A film of who walks to the right, from within a stride on; not to be written to."""
    path = tmp_path_factory.mktemp("film") / "walk.mp4"
    write_video(path, a_walk().images[FIRST:])
    return path


@pytest.fixture(scope="session")
def cluster() -> Iterator["Client"]:
    """A real Dask cluster of two processes of this machine, which lets everybody in as a user's own may."""
    from distributed import Security

    with ExitStack() as stack:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(Security, "temporary", Security)
            client = stack.enter_context(local_cluster(2))
        yield client


@pytest.fixture(scope="session")
def _chromium(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with chromium(tmp_path_factory.mktemp("profile")) as browser:
        yield browser


@pytest.fixture
def browser(_chromium: Browser) -> Iterator[Browser]:
    """A real browser, whose console has nothing to complain of; its tests skip where there is none."""
    _chromium.errors.clear()
    yield _chromium
    _chromium.open("about:blank")
    assert _chromium.errors == []
