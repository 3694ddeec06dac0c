"""The folder in which the documentation's commands are run, and how each of them is run.

Every page is run from its top to its end in a folder of its own, as its reader would. A command that several
pages run on the same files is run once; the other pages get what it left. Commands that take minutes or wait
for somebody are run in the form that IN_ITS_PLACE tells of; those in NOT_RUN are not run, for the reason it
gives.
"""

import os
import shutil
import signal
import subprocess
import sys
import time
from contextlib import chdir
from functools import cache
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from kinematics.figure_file import load_figure
from tests.handbook.blocks import FIGTRACK, PYTHON, ROOT
from tests.tracker.annotate.clients import running
from tests.tracker.annotate.marked import told
from tests.tracker.clips import everything, figtrack, write_table
from tests.tracker.models.captures import COLUMNS, FPS, T, write_walk
from tests.tracker.records import walked
from tracker.cli import demo
from tracker.experiments import reproduce as experiments
from tracker.experiments import runtime
from tracker.foreign.dlc import write_dlc
from tracker.foreign.points import Points
from tracker.scene import film
from tracker.tables.keypoints import read_keypoints

FRAMES, SIZE = 24, (480, 270)  # enough for the walker to be found
SEED = 1  # of a walker who is seen so clearly that no second search is needed
SCHEDULER = "tcp://10.0.0.1:8786"  # of the pages; the address of a real one is put in its place

LEFT = {}  # the files that a command left, by its words and the files that these name

DASK = "DASK_DISTRIBUTED__COMM__TLS__"  # variables of its settings
OF_PEM = "--tls-ca-file cluster.pem --tls-cert cluster.pem --tls-key cluster.pem"

NOT_RUN = {
    "dask scheduler --host 10.0.0.1": "the address of another machine",
    "dask worker tcp://10.0.0.1:8786 --nthreads 1 --nworkers 8": "of that scheduler",
    "export MALLOC_TRIM_THRESHOLD_=1000000000 MALLOC_MMAP_THRESHOLD_=1000000000": "for those workers",
    "openssl req -x509 -newkey rsa:2048 -nodes -subj /CN=batch -keyout key.pem -out cert.pem": "OpenSSL's",
    "cat cert.pem key.pem > cluster.pem": "needs that certificate",
    f"dask scheduler --protocol tls {OF_PEM}": "a scheduler that stays",
    f"dask worker tls://10.0.0.1:8786 {OF_PEM}": "of that scheduler",
    f"export {DASK}CA_FILE=cluster.pem {DASK}CLIENT__CERT=cluster.pem": "for that scheduler",
    f"export {DASK}CLIENT__KEY=cluster.pem": "for that scheduler",
    "figtrack batch jobs.csv --scheduler tls://10.0.0.1:8786": "asks that scheduler",
}
IN_ITS_PLACE = {
    "make": "what it would do (-n), and of that the commands of ours: it also installs and runs all tests",
    "demo": "one walk of fewer frames for every seed, also in place of the film that is fetched",
    "annotate": "without a browser: what one clicks is sent, then Save and close",
    "correct": "without a browser: a frame is kept as it was followed, then Follow on, then Save and close",
    "app": "without a browser: the films are asked for, then Ctrl-C",
    "compare-runs": "of two made-up walks: the clips here are too short for strides",
    "reproduce": "--quick, and one experiment of the six",
    "batch": "by the processes of one cluster for all: each takes seconds to begin",
}
# What a page takes for granted and does not make itself.
FOUND = {
    "docs/annotate.md": ("walk-track",),
    "docs/classify.md": ("walk-track", "mine.npz"),
    "docs/formats.md": ("walk-track",),
    "docs/interpolate.md": ("walk-track", "mine.npz"),
    "docs/predict.md": ("walk-track", "mine.npz"),
    "docs/python.md": ("walk-track",),
}


class CommandFailedError(AssertionError):
    """A command of the documentation that does not do what its page says."""


@cache
def rendered():
    """A small rendered walk, once for all; short as it is, nothing hides the walker."""
    return film.render(SEED, frames=FRAMES, size=SIZE, shrubs=False)


def furnish(folder):
    """All that any page may find: a clip and its marks, tables of clips and captures, a run and a model."""
    demo.write_scene(rendered(), folder)
    for name in ("anna 1", "ben"):
        shutil.copy(folder / "walk.mp4", folder / f"{name}.mp4")
        shutil.copy(folder / "walk.keypoints.csv", folder / f"{name}.keypoints.csv")
    (folder / "films").mkdir()
    shutil.copy(folder / "walk.mp4", folder / "films")
    jobs = [
        ("anna 1.mp4", "anna 1.keypoints.csv", "", "walk-run", "anna 1"),
        ("ben.mp4", "ben.keypoints.csv", 12, "", "ben"),
    ]
    write_table(folder / "jobs.csv", jobs, ("video", "keypoints", "start", "model", "out"))
    (folder / "captures").mkdir()
    rows = []
    for i, who in enumerate("abc"):
        for label, stride, size in (("walk", 31.0 + i, 1.0), ("run", 20.0 + i, 1.0), ("stand", 31.0, 0.0)):
            write_walk(folder / "captures" / f"{who}_{label}.bvh", stride, i, size)
            rows.append((f"captures/{who}_{label}.bvh", who, label, label, FPS, f"0-{T}", "", "free"))
    write_table(folder / "trials.csv", rows, COLUMNS.split(","))
    write_points(folder)
    with chdir(folder):
        run_once(["track", "walk.mp4", "--keypoints", "walk.keypoints.csv"], folder)
        run_once(["learn", "--trials", "trials.csv", "--states", "2", "--out", "mine.npz"], folder)
    return folder


def write_points(folder):
    """What a pose network might have found in the clip: its marks, as a DeepLabCut CSV."""
    marks = read_keypoints(folder / "walk.keypoints.csv")
    places = np.array([[(at.x, at.y) for at in marks[t].values()] for t in sorted(marks)])
    write_dlc(Points(tuple(marks[0]), places, np.ones(places.shape[:2])), folder / "walk.dlc.csv")


def set_up(stage, folder, name):
    """What the reader of a page has before its first line."""
    made = {"walk-track", "mine.npz"} - set(FOUND.get(name, ()))
    shutil.copytree(stage, folder, ignore=shutil.ignore_patterns(*made), dirs_exist_ok=True)


def run(words, folder, scheduler):
    """Run one command in the folder one is in; `scheduler` gives the address of a Dask scheduler."""
    program, *rest = words
    if program == "make":
        recipe = run_process(["make", "-n", *rest], cwd=ROOT)
        for line in recipe.splitlines():
            if line.startswith(FIGTRACK):
                run(line.split(), folder, scheduler)
    elif program in PYTHON:
        run_process([sys.executable, *rest], cwd=folder)
    elif program not in FIGTRACK:
        raise CommandFailedError(f"{program} is no program that the test knows how to run")
    elif rest[0] == "annotate":
        mark(rest[1:], folder)
    elif rest[0] == "correct":
        correct(rest[1:], folder)
    elif rest[0] == "app":
        look(rest[1:], folder)
    elif rest[0] == "compare-runs":
        set_side_by_side(rest, folder)
    elif rest[0] == "reproduce":
        run_once([*rest, "--quick"], folder)
    elif rest[0] == "batch":
        workers = rest.index("--workers") if "--workers" in rest else len(rest)
        asked = [*rest[:workers], *rest[workers + 2 :]]
        more = () if SCHEDULER in rest else ("--scheduler", scheduler())
        run_once([*(scheduler() if word == SCHEDULER else word for word in asked), *more], folder)
    else:
        run_once(rest, folder)


def shorten(monkeypatch):
    """The demo on a short walk, the papers' experiments but one."""
    monkeypatch.setattr(demo, "render", lambda *_, **__: rendered())
    monkeypatch.setattr(demo, "FRAMES", FRAMES)
    monkeypatch.setattr(demo, "fetch", lambda folder: demo.write_scene(rendered(), folder)[0])
    monkeypatch.setattr(experiments, "EXPERIMENTS", (runtime,))


def mark(words, folder):
    """Mark the frame that the page shows as it was rendered."""
    figure = load_figure(words[words.index("--figure") + 1] if "--figure" in words else "walker")
    truth = read_keypoints((folder / words[0]).with_suffix(".keypoints.csv"), figure.marks)
    with running(*words, cwd=folder) as (process, client):
        opening = client.opening()
        frame = opening["frame"]["index"]
        answer = client.post("save", {"frames": {str(frame): told(truth[frame])}, "close": True})[1]
        _, errors = process.communicate(timeout=120)
    if "saved" not in answer or process.returncode:
        raise CommandFailedError(f"annotate {' '.join(words)}: {answer} {errors}")


def correct(words, folder):
    """Keep a frame as it was followed, and follow the figure again through it."""
    with running(*words, cwd=folder, command="correct") as (process, client):
        figure = client.opening()["frame"]["figure"]
        answer = client.post("follow", {"frames": {"3": figure}, "anyway": True})[1]
        while answer.get("follows") or "wait" in answer.get("error", ""):
            time.sleep(0.2)
            answer = client.post("save", {"frames": {}, "close": True, "anyway": True})[1]
        _, errors = process.communicate(timeout=120)
    if "closed" not in answer or process.returncode:
        raise CommandFailedError(f"correct {' '.join(words)}: {answer} {errors}")


def look(words, folder):
    """See which films there are, and end."""
    with running(*words, cwd=folder, command="app") as (process, client):
        films = [film["name"] for film in client.opening()["films"]]
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=120)
    if not films or process.returncode:
        raise CommandFailedError(f"app {' '.join(words)}: {films} {errors}")


def set_side_by_side(words, folder):
    """Compare two runs that have the names of the command's."""
    with TemporaryDirectory() as aside:
        for number, name in enumerate(words[1:3]):
            walked(Path(aside) / name, period=1.1 - 0.1 * number)
        run_figtrack(words[0], *(Path(aside) / name for name in words[1:3]), *words[3:])


def run_once(words, folder):
    """Run a command of ours; where it read the same before, and none of what it left is there, take that."""
    named = [folder / word for word in words if (folder / word).exists()]
    read = [everything(path) if path.is_dir() else path.read_bytes() for path in named]
    key = sha256(repr((words, read)).encode()).digest()
    if key not in LEFT or any((folder / name).exists() for name in LEFT[key]):
        before = everything(folder)
        run_figtrack(*words)
        LEFT[key] = dict(everything(folder).items() - before.items())
        return
    for name, data in LEFT[key].items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(data)


def run_figtrack(*words):
    """What a command of ours prints; it must succeed."""
    result = figtrack(*words)
    if result.exit_code:
        raise CommandFailedError(f"figtrack {' '.join(map(str, words))}: {result.output}")
    return result.stdout


def run_process(words, cwd):
    """What another program prints; it must succeed."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(words, cwd=cwd, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        raise CommandFailedError(f"{' '.join(words)}: {done.stdout}{done.stderr}")
    return done.stdout
