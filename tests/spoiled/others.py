"""Runs that are exported, tables of jobs, and files of other programs."""

from tests.spoiled.case import HUGE, Case
from tests.spoiled.spoil import (
    copied,
    cut,
    emptied,
    encoded,
    file_instead,
    flipped,
    folder_instead,
    nothing,
    removed,
    replaced,
    written,
)
from tests.spoiled.stock import FOREIGN

RUNS = [
    Case("run absent", "dlc", removed("run"), "run holds no complete run"),
    Case("run is a file", "trc", file_instead("run"), "run holds no complete run"),
    Case("run.json absent", "mot", removed("run/run.json"), "run holds no complete run"),
    Case("run.json empty", "trc", emptied("run/run.json"), "run/run.json"),
    Case("run.json cut", "myogait", cut("run/run.json"), "run/run.json"),
    Case("run.json of another program", "dlc", written("run/run.json", '{"name": 1}'), "run/run.json"),
    Case(
        "run.json says too many frames",
        "dlc",
        replaced("run/run.json", '"frames": 4', f'"frames": {HUGE}'),
        "keypoints.csv",
    ),
    Case(
        "run.json says endless frames a second",
        "trc",
        replaced("run/run.json", '"fps": [\\d.]+', '"fps": 1e999'),
        "run/run.json",
    ),
    Case("run's poses absent", "mot", removed("run/pose.csv"), "run/pose.csv"),
    Case("run's poses empty", "mot", emptied("run/pose.csv"), "run/pose.csv"),
    Case("run's poses cut", "trc", cut("run/pose.csv", 0.7), "run/pose.csv"),
    Case("run's poses lack a column", "trc", replaced("run/pose.csv", "knee_far", "knee"), "run/pose.csv"),
    Case("run's poses in UTF-16", "mot", encoded("run/pose.csv", "utf-16"), "run/pose.csv"),
    Case("run's keypoints cut", "openpose", cut("run/keypoints.csv", 0.5), "run/keypoints.csv"),
    Case(
        "run's keypoints are no numbers",
        "sports2d",
        replaced("run/keypoints.csv", r"hip,[\d.]+", "hip,left"),
        "run/keypoints.csv",
    ),
    Case(
        "run's keypoints are infinite",
        "sports2d",
        replaced("run/keypoints.csv", r"hip,[\d.]+", "hip,inf"),
        "run/keypoints.csv",
    ),
    Case("run's keypoints are a folder", "dlc", folder_instead("run/keypoints.csv"), "run/keypoints.csv"),
    Case("run's track absent", "trc", removed("run/track.npz"), "run/track.npz"),
    Case("run's track cut", "trc", cut("run/track.npz"), "run/track.npz"),
    Case("run's track with a flipped bit", "trc", flipped("run/track.npz", 8, 500), "run/track.npz"),
    Case(
        "run of several models",
        "export compared --to dlc --quiet --overwrite --out run.dlc.csv",
        nothing,
        "one of the runs in it",
    ),
]

JOBS = [
    Case("jobs absent", "batch", removed("jobs.csv"), "no table of jobs jobs.csv"),
    Case("jobs empty", "batch", emptied("jobs.csv"), "jobs.csv is no table of jobs"),
    Case("jobs in UTF-16", "batch", encoded("jobs.csv", "utf-16"), "jobs.csv as a UTF-8"),
    Case("jobs in Latin-1", "batch", encoded("jobs.csv", "latin-1"), "jobs.csv as a UTF-8"),
    Case("jobs are a folder", "batch", folder_instead("jobs.csv"), "jobs.csv"),
    Case("jobs with a header alone", "batch", replaced("jobs.csv", r"(?s)\n.*", "\n"), "has no jobs"),
    Case(
        "a job starts nowhere",
        "batch",
        written("jobs.csv", f"video,keypoints,start\nwalk.mp4,marks.csv,{'9' * 5000}\n"),
        "start must be",
    ),
    Case(
        "a job's rate is not a number",
        "batch",
        written("jobs.csv", "video,keypoints,rate\nwalk.mp4,marks.csv,nan\n"),
        "rate must be",
    ),
    Case(
        "two jobs in one folder",
        "batch",
        written("jobs.csv", "video,keypoints,out\nwalk.mp4,marks.csv,a\nwalk.mp4,marks.csv,a\n"),
        "have the same out",
    ),
    Case(
        "a summary of something else",
        "batch",
        written("summary.csv", "mine\n"),
        "summary.csv is of something else",
    ),
]

SOURCES = [
    Case(
        f"{how[0]} {name}", f"annotate walk.mp4 --no-browser --out new.csv --from {name}", how[1](name), name
    )
    for name in FOREIGN
    for how in (
        ("absent", removed),
        ("empty", emptied),
        ("cut", cut),
        ("UTF-16", lambda name: encoded(name, "utf-16")),
        ("video instead of", lambda name: copied("walk.mp4", name)),
    )
] + [
    Case(
        "nested without end",
        "annotate walk.mp4 --no-browser --out new.csv --from pose.json",
        written("pose.json", "[" * 99999),
        "pose.json is no JSON",
    ),
    Case(
        "huge places",
        "annotate walk.mp4 --no-browser --out new.csv --from coco.json",
        replaced("coco.json", r'"image_id": 10', f'"image_id": {HUGE}'),
        "coco.json",
    ),
]
