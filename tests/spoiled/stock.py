"""A folder in which every command succeeds: what it reads, and results of before where it writes."""

import shlex
import shutil
from importlib import resources

from tests.tracker import people
from tests.tracker.clips import figtrack, write_images, write_table, write_video
from tests.tracker.gaits import gait_model, saved
from tests.tracker.models.captures import write_trials
from tests.tracker.people import WALKER

FRAMES = 4  # of the clip
OF_MARKS = "--keypoints marks.csv --model m.npz --quiet --overwrite"
FOLLOWED = f"{OF_MARKS} --out run"
ASIDE = "--no-plot --quiet --overwrite"
LEARNED = "--states 1 --settings quick.toml --quiet --overwrite --out m2.npz"

# Each command as it is meant, run in that folder; with --overwrite only a fault keeps it from ending well.
COMMANDS = {
    "track": f"track walk.mp4 --settings s.toml {FOLLOWED}",
    "track images": f"track images --rate 1 {FOLLOWED}",
    "compare": f"compare walk.mp4 --truth truth.csv --out compared {OF_MARKS}",
    "learn": f"learn poses.csv {LEARNED}",
    "learn captures": f"learn --trials trials.csv --label walk {LEARNED}",
    "classify": f"classify poses.csv --model m.npz --out labels.csv {ASIDE}",
    "predict": f"predict poses.csv --model m.npz --out ahead.csv {ASIDE}",
    "interpolate": f"interpolate poses.csv --model m.npz --out filled.csv {ASIDE}",
    "synthesise": f"synthesise --model m.npz --frames 5 --no-clip --out made.csv {ASIDE}",
    "dlc": "export run --to dlc --quiet --overwrite --out run.dlc.csv",
    "trc": "export run --to trc --height 1.7 --quiet --overwrite --out run.trc",
    "mot": "export run --to mot --quiet --overwrite --out run.mot",
    "sports2d": "export run --to sports2d --quiet --overwrite --out run_px.trc",
    "openpose": "export run --to openpose --quiet --overwrite --out run-openpose",
    "myogait": "export run --to myogait --quiet --overwrite --out run.myogait.json",
    "batch": "batch jobs.csv --quiet --overwrite --workers 1",
    "settings": "settings --overwrite --out s.toml",
    "annotate": "annotate walk.mp4 --no-browser --out marks.csv",
    "correct": "correct run --no-browser --quiet",
    "reproduce": "reproduce --trials trials.csv --quick --quiet --overwrite --out reproduced",
    "demo": "demo --quiet --overwrite --out shown",
}
# Those by which the folder is filled.
BEFOREHAND = ("settings", "track", "compare", "trc", "openpose", "learn")
# Other programs' files that marks are taken from, and how each is written.
FOREIGN = {
    "net.csv": lambda path: people.dlc(path, {"0": WALKER, "1": WALKER}),
    "pose.json": lambda path: people.openpose(path, [WALKER]),
    "coco.json": lambda path: people.coco(path, {"walk_0000.png": [WALKER]}),
    "labelme.json": lambda path: people.labelme(path, [WALKER]),
    "px.trc": lambda path: people.trc(path, [WALKER, WALKER]),
}


def words(command):
    """A command line, its beginning up to the first option by its key."""
    key, dashes, more = command.partition(" --")
    return shlex.split(COMMANDS.get(key, key) + dashes + more)


def fill(folder, clip):
    """Everything that the commands read, and results of before wherever they write."""
    write_video(folder / "walk.mp4", clip.images[:FRAMES])
    write_images(folder / "images", clip.images[:FRAMES])
    write_table(folder / "marks.csv", clip.rows([0]))
    write_table(folder / "truth.csv", clip.rows(range(FRAMES)))
    for name in ("jobs.csv", "one.csv"):
        job = ("walk.mp4", "marks.csv", "cv", "job")
        write_table(folder / name, [job], ("video", "keypoints", "model", "out"))
    (folder / "mine.toml").write_bytes((resources.files("kinematics") / "figures/walker.toml").read_bytes())
    saved(folder / "m.npz", gait_model())
    (folder / "quick.toml").write_text("rounds = 1\n")
    for name, write in FOREIGN.items():
        write(folder / name)
    write_trials(folder, [("s0", "walk", 34.0), ("s1", "walk", 31.0), ("s2", "run", 22.0)])
    _done(words("synthesise --frames 40 --out poses.csv"))
    for command in BEFOREHAND:
        _done(words(command))
    shutil.copytree(
        folder / "run", folder / "run2", ignore=shutil.ignore_patterns("overlay.mp4", "report.html")
    )


def _done(line):
    result = figtrack(*line)
    assert (result.exit_code, result.stderr) == (0, ""), result.output
