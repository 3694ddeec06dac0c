"""Random command lines, and the folder in which each is run."""

import shutil
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from tests.benchmarks.soak.films import damaged, shot, write_film, write_marks
from tests.tracker.gaits import both as walk_and_run
from tests.tracker.gaits import gait_model, saved, sequence, write_poses
from tests.tracker.records import walked
from tracker.tables.table import write_table

Rng = np.random.Generator
Words = list[str]

FORMATS = ("dlc", "trc", "mot", "sports2d", "openpose", "myogait", "all")
MODELS = ("cv", "walk-run", "walk-run-1", "gait", "m.npz")


def stock(folder: Path) -> Path:
    """What commands read besides films: two runs, a model, poses, and settings for quick learning."""
    rng = np.random.default_rng(1)
    saved(folder / "m.npz", gait_model())
    poses, labels = walk_and_run(rng)
    write_poses(folder / "poses.csv", sequence(poses, labels=labels), further=("label",))
    (folder / "quick.toml").write_text("rounds = 2\n", encoding="utf-8")
    for name, period in (("run", 1.1), ("other", 1.0)):
        walked(folder / name, height=1.7, period=period)
    return folder


def furnish(folder: Path, stocked: Path, rng: Rng) -> None:
    """A copy of the stock, a film of two and marks; one of all files may be damaged."""
    shutil.copytree(stocked, folder, dirs_exist_ok=True)
    for name in ("one", "two"):
        film = shot(rng)
        write_film(folder, name, film, rng)
        write_marks(folder / f"{name}.csv", film, rng)
    if rng.random() < 0.15:
        files = sorted(path for path in folder.rglob("*") if path.is_file())
        spoilt = files[rng.integers(len(files))]
        spoilt.write_bytes(damaged(spoilt.read_bytes(), rng))


def line(folder: Path, rng: Rng) -> Words:
    """A command with some of its options, on what the folder holds."""
    makers: Sequence[Callable[[Path, Rng], Words]] = (
        *[_track] * 8,
        *[_find] * 3,
        *[_export] * 3,
        *[_batch] * 2,
        *(_compare, _classify, _predict, _interpolate, _synthesise, _learn, _compare_runs, _settings),
    )
    words = makers[rng.integers(len(makers))](folder, rng)
    how = ["--quiet"] if rng.random() < 0.7 else ["--progress", str(rng.choice(["plain", "json"]))]
    if words[0] in ("compare-runs", "settings"):
        how = []
    return [*words, *how, *_some(rng, 0.8, "--overwrite")]


def film_of(folder: Path, name: str) -> str:
    """How the film of this name is called with its ending."""
    return next(path.name for path in sorted(folder.iterdir()) if path.stem == name and path.suffix != ".csv")


def _some(rng: Rng, share: float, *words: object) -> Words:
    """The words, or none."""
    return list(map(str, words)) if rng.random() < share else []


def _frame(rng: Rng) -> int:
    return int(rng.choice([0, 1, 5, 10, 20, 39, 40, 1000], p=[0.2, 0.1, 0.2, 0.2, 0.2, 0.05, 0.03, 0.02]))


def _following(rng: Rng, marked: bool) -> Words:
    return [
        *_some(rng, 0.6, "--model", rng.choice(MODELS)),
        *_some(rng, 0.2, "--from", _frame(rng)),
        *_some(rng, 0.08, "--start", _frame(rng)),
        *_some(rng, 0.3, "--stop", _frame(rng)),
        *_some(rng, 0.1, "--rate", round(float(rng.uniform(0.2, 4.2)), 2)),
        *_some(rng, 0.1, "--facing", rng.choice(["left", "right"])),
        *_some(rng, 0.1, "--no-smooth"),
        *_some(rng, 0.1, "--height", 1.7),
        *_some(rng, 0.05, "--figure", rng.choice(["walker-arms", "horse"])),
        *_some(rng, 0.2 if marked else 0.02, "--anchors"),
        *_some(rng, 0.02 if marked else 0.3, "--near", rng.choice(["ahead", "behind"])),
        *_some(rng, 0.02 if marked else 0.1, "--person", rng.integers(1, 3)),
    ]


def _track(folder: Path, rng: Rng) -> Words:
    marked = bool(rng.random() < 0.6)
    return [
        *("track", film_of(folder, "one")),
        *(["--keypoints", "one.csv"] if marked else []),
        *_following(rng, marked),
        *_some(rng, 0.4, "--no-overlay"),
        *_some(rng, 0.3, "--no-report"),
        *("--out", str(rng.choice(["run", "new"]))),
    ]


def _compare(folder: Path, rng: Rng) -> Words:
    models = [word for name in rng.choice(MODELS, 2) for word in ("--model", str(name))]
    return ["compare", film_of(folder, "one"), "--keypoints", "one.csv", *models, "--out", "compared"]


def _find(folder: Path, rng: Rng) -> Words:
    return ["find", film_of(folder, "one"), *_some(rng, 0.5, "--out", "people.csv")]


def _export(folder: Path, rng: Rng) -> Words:
    return ["export", "run", "--to", str(rng.choice(FORMATS)), *_some(rng, 0.3, "--height", 1.8)]


def _batch(folder: Path, rng: Rng) -> Words:
    rows = [
        (film_of(folder, name), f"{name}.csv" if rng.random() < 0.7 else "", "cv", name)
        for name in ("one", "two")
    ]
    write_table(folder / "jobs.csv", ("video", "keypoints", "model", "out"), rows)
    return ["batch", "jobs.csv", "--out", "batch", "--workers", str(rng.integers(1, 3))]


def _classify(folder: Path, rng: Rng) -> Words:
    return [
        *("classify", "poses.csv", "--out", "labels.csv"),
        *_some(rng, 0.5, "--model", rng.choice(["m.npz", "gait", "walk-run"])),
        *_some(rng, 0.5, "--inference", rng.choice(["viterbi", "gpb2", "variational", "hmm"])),
        *_some(rng, 0.3, "--use", "all"),
        *_some(rng, 0.2, "--fps", rng.choice([1, 24, 60, 1000])),
        *_some(rng, 0.5, "--no-plot"),
    ]


def _predict(folder: Path, rng: Rng) -> Words:
    ahead = _some(rng, 0.5, "--horizon", rng.choice([1, 5, 200]))
    return ["predict", "run/pose.csv", "--out", "ahead.csv", *ahead, *_some(rng, 0.5, "--no-plot")]


def _interpolate(folder: Path, rng: Rng) -> Words:
    path = folder / "poses.csv"
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    gap = int(rng.integers(1, max(2, len(lines) - 20)))
    path.write_text("\n".join(lines[:gap] + lines[gap + int(rng.integers(20)) :]) + "\n", encoding="utf-8")
    model = _some(rng, 0.5, "--model", rng.choice(["m.npz", "walk-run", "stride"]))
    return ["interpolate", "poses.csv", "--out", "filled.csv", *model, *_some(rng, 0.5, "--no-plot")]


def _synthesise(folder: Path, rng: Rng) -> Words:
    return [
        *("synthesise", "--out", "made.csv", "--frames", str(rng.choice([1, 2, 30, 300]))),
        *_some(rng, 0.5, "--model", rng.choice(["m.npz", "walk-run", "stride", "cv"])),
        *_some(rng, 0.3, "--label", rng.choice(["walk", "run", "swim"])),
        *_some(rng, 0.3, "--fps", rng.choice([1, 24, 1000])),
        *_some(rng, 0.5, "--no-plot"),
        *_some(rng, 0.5, "--no-clip"),
    ]


def _learn(folder: Path, rng: Rng) -> Words:
    way = rng.choice(["viterbi", "gpb2", "variational", "hmm", "stride"])
    tables = ["poses.csv", *_some(rng, 0.3, "run/pose.csv")]
    states = _some(rng, 0.7, "--states", rng.choice([1, 2]))
    return ["learn", *tables, *states, "--settings", "quick.toml", "--inference", str(way), "--out", "m2.npz"]


def _compare_runs(folder: Path, rng: Rng) -> Words:
    return ["compare-runs", "run", "other", *_some(rng, 0.5, "--out", "both.html")]


def _settings(folder: Path, rng: Rng) -> Words:
    return ["settings", "--out", "s.toml"]
