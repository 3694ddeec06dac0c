"""Each command on each file that it reads, spoiled in every way that any file may be."""

from tests.spoiled.case import Case
from tests.spoiled.spoil import edited, emptied, encoded, folder_instead, linked, piped, removed, written

BINARY = bytes(range(256)) * 8
# Of any file.
ANY = {
    "absent": removed,
    "empty": emptied,
    "a folder": folder_instead,
    "a pipe": piped,
    "without end": linked("/dev/zero"),
    "a link to itself": linked("itself"),
    "binary": written(BINARY),
}
# Of text.
TEXT = {
    "in UTF-16": encoded("utf-16"),
    "with NUL in the middle": edited(lambda data: data[: len(data) // 2] + b"\0" + data[len(data) // 2 :]),
    "prose": written("It was a bright day,\nand the clocks were striking.\n"),
}
OUT = "--quiet --overwrite --out"
FOLLOW = f"track walk.mp4 --keypoints marks.csv --model m.npz {OUT} new"
# Command, the file that is spoiled, and whether that is text.
READ = (
    (f"find walk.mp4 {OUT} people.csv", "walk.mp4", False),
    (f"batch one.csv --workers 1 {OUT} all", "one.csv", True),
    (f"compare walk.mp4 --keypoints marks.csv --model cv {OUT} new", "marks.csv", True),
    (f"compare walk.mp4 --keypoints marks.csv --model m.npz {OUT} new", "m.npz", False),
    (f"{FOLLOW} --measure net.csv", "net.csv", True),
    (f"{FOLLOW} --measure pose.json", "pose.json", True),
    (f"{FOLLOW} --measure px.trc", "px.trc", True),
    (f"{FOLLOW} --settings s.toml", "s.toml", True),
    (f"{FOLLOW} --figure mine.toml", "mine.toml", True),
    ("annotate walk.mp4 --no-browser --figure mine.toml --out new.csv", "mine.toml", True),
    ("correct run --no-browser --quiet", "run/run.json", True),
    ("correct run --no-browser --quiet", "run/track.npz", False),
    ("compare-runs run run2 --overwrite --out new.html", "run/run.json", True),
    ("compare-runs run run2 --overwrite --out new.html", "run2/gait.json", True),
    ("dlc", "run/run.json", True),
    ("openpose", "run/track.npz", False),
    ("classify", "m.npz", False),
    ("predict", "m.npz", False),
    ("interpolate", "m.npz", False),
    ("predict", "poses.csv", True),
    ("interpolate", "poses.csv", True),
    ("learn", "poses.csv", True),
    ("learn", "quick.toml", True),
    ("learn captures", "trials.csv", True),
    ("learn captures", "c0.bvh", True),
    (f"learn poses.csv --figure mine.toml {OUT} m2.npz", "mine.toml", True),
    ("reproduce", "trials.csv", True),
)

# Settings that are not told are the usual ones.
FINE = {("s.toml", "empty"), ("quick.toml", "empty")}

FIRST = {file: command for command, file, _ in reversed(READ)}


def ways(command, file, text):
    """How a file is spoiled for a command: in every way for the first of those that read it alike."""
    if FIRST[file] != command:
        return {wrong: ANY[wrong] for wrong in ("absent", "empty", "a folder", "binary")}
    return ANY | TEXT if text else ANY


EVERY = [
    Case(f"{command}: {file} {wrong}, as any may be", command, file.rpartition("/")[2], spoil, file)
    for command, file, text in READ
    for wrong, spoil in ways(command, file, text).items()
    if (file, wrong) not in FINE
]
