"""Runs that are exported, tables of jobs, and files of other programs."""

from tests.spoiled.case import HUGE, cases, refusals
from tests.spoiled.spoil import (
    copied,
    cut,
    emptied,
    encoded,
    file_instead,
    flipped,
    removed,
    replaced,
    written,
)
from tests.spoiled.stock import FOREIGN

RUNS = [
    *cases("dlc", "run", ("absent", removed, "run holds no complete run")),
    *cases("trc", "run", ("is a file", file_instead, "run holds no complete run")),
    *cases("myogait", "run/run.json", ("cut", cut(), "run/run.json")),
    *cases(
        "trc",
        "run/run.json",
        ("of endless frames a second", replaced('"fps": [\\d.]+', '"fps": 1e999'), "run/run.json"),
    ),
    *cases(
        "dlc",
        "run/run.json",
        ("of another program", written('{"name": 1}'), "run/run.json"),
        ("of too few frames", replaced('"frames": 4', '"frames": 3'), "it holds frames 0 to 3 of 3"),
    ),
    *cases(
        "trc",
        "run/track.npz",
        ("cut", cut(), "run/track.npz"),
        ("has a flipped bit", flipped(8, 500), "run/track.npz"),
    ),
    *refusals(
        ("run of several models", "export compared --to dlc --quiet --out x.csv", "one of the runs in it")
    ),
]

JOBS = [
    *cases(
        "batch",
        "jobs.csv",
        ("in Latin-1", encoded("latin-1"), "jobs.csv as a UTF-8"),
        ("with a header alone", replaced(r"(?s)\n.*", "\n"), "has no jobs"),
        ("lack a column", replaced("video", "film"), "column 'video' is missing"),
        (
            "start nowhere",
            written(f"video,keypoints,start\nwalk.mp4,marks.csv,{'9' * 5000}\n"),
            "start must be",
        ),
        ("at no rate", written("video,keypoints,rate\nwalk.mp4,marks.csv,nan\n"), "rate must be"),
        (
            "in one folder",
            written("video,keypoints,out\n" + "walk.mp4,marks.csv,a\n" * 2),
            "have the same out",
        ),
    ),
    *cases("batch", "summary.csv", ("of something else", written("mine\n"), "is of something else")),
]

SOURCES = [
    case
    for name in FOREIGN
    for case in cases(
        f"annotate walk.mp4 --no-browser --out new.csv --from {name}",
        name,
        ("absent", removed, name),
        ("empty", emptied, name),
        ("cut", cut(), name),
        ("in UTF-16", encoded("utf-16"), name),
        ("is a video", copied("walk.mp4"), name),
        *{
            "pose.json": [("nested without end", written("[" * 99999), "pose.json is no JSON")],
            "coco.json": [
                ("of a huge place", replaced('"image_id": 10', f'"image_id": {HUGE}'), "coco.json")
            ],
        }.get(name, []),
    )
] + [
    case
    for name in FOREIGN
    for case in cases(
        f"track walk.mp4 --keypoints {name} --model m.npz --quiet --out new",
        name,
        ("cut", cut(), name),
        ("in UTF-16", encoded("utf-16"), name),
    )
]
