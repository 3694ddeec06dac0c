"""Folders of finished runs, made up for tests, and the validators of exported files."""

import importlib.util
import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from tests.kinematics.figures import WALKER
from tests.tracker.strolls import stroll
from tests.tracker.tracks import random_track
from tracker.gait.figures import gait_of
from tracker.run.read import read_run
from tracker.run.write import write_tables

FPS, SIZE = 25.0, (640, 480)
FIRST, T, FRAMES = 1, 6, 8  # frames 1 to 6 of 8 were followed


def made_track(rng, *, facing=1, figure=WALKER, outcomes=("ok", "hidden", "ok", "lost", "outside", "ok")):
    """Poses near a standing one, so that what is measured on them makes sense."""
    track = random_track(rng, T, first=FIRST, facing=facing, figure=figure)
    return replace(track, q=0.2 * rng.normal(size=track.q.shape), outcome=outcomes)


def write_folder(track, folder, *, length=FRAMES, video="späte Läufe/walk 1.mp4", **changes):
    """The tables and run.json of a run; returns the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    write_tables(track, folder, length, FPS)
    news = {
        "figtrack": "0",
        "video": video,
        "fps": FPS,
        "frames": length,
        "size": SIZE,
        "rate": 1.0,
        "facing": track.view.side,
        "warnings": [],
    }
    news = {key: value for key, value in (news | changes).items() if value is not None}
    (folder / "run.json").write_text(json.dumps(news))
    return folder


def walked(folder, *, height=None, facing=1, **walk):
    """The folder of a stroll's run with its gait figures."""
    track = stroll(**walk)
    track = replace(track, view=replace(track.view, facing=facing))
    write_folder(track, folder, length=len(track), fps=30.0, height=height)
    (folder / "gait.json").write_text(json.dumps(gait_of(track).summary()))
    return folder


def made_record(rng, folder, **made):
    """A run of a track that is `made_track`, read back."""
    return read_run(write_folder(made_track(rng, **made), folder))


def tools():
    """The folder of the validators, or a skip: they lie beside the data, not in the project."""
    data = os.environ.get("FIGTRACK_DATA")
    folder = Path(data).parent / "tools" if data else None
    if folder is None or not folder.is_dir():
        pytest.skip("the validators lie beside $FIGTRACK_DATA, which is not set here")
    return folder


def validated(tool, *words):
    """What a validator prints of a file that it finds right; it runs by itself, with nothing of ours."""
    command = [sys.executable, tools() / tool, *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def validator(tool):
    """The validator's module."""
    spec = importlib.util.spec_from_file_location(Path(tool).stem, tools() / tool)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
