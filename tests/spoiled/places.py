"""Options, and the places that results go to."""

import os

from tests.spoiled.case import HUGE, Case, cases, refusals
from tests.spoiled.spoil import file_instead, folder_instead, foreign_instead, renamed
from tests.spoiled.stock import ASIDE, FOLLOWED, OF_MARKS

OPTIONS = [
    *refusals(
        ("start huge", f"track --start {HUGE}", f"frame {HUGE} is not marked"),
        ("scale of endless metres", "mot --scale-points 0,0,9,9,inf", "metres between"),
        ("scale points in one place", "mot --scale-points 5,5,5,5,1", "two points apart"),
        ("a model that does not ship", "track --model swim", "no model 'swim' ships; there are gait"),
        ("a motion that is not there", "synthesise --label swim", "has no motion 'swim'; it has walk, run"),
        ("a scheduler that is none", "batch jobs.csv --quiet --scheduler nowhere", "answers at nowhere"),
    ),
    *refusals(
        ("stop huge", f"track --stop {HUGE}", "--stop"),
        ("rate is not a number", "track --rate nan", "--rate"),
        ("frames a second are not a number", "predict --fps nan", "--fps"),
        ("height is not a number", "trc --height nan", "--height"),
        ("noise is not a number", "learn --noise nan", "--noise"),
        ("height in centimetres", "trc --height 175", "--height"),
        ("scale points are four", "mot --scale-points 0,0,9,9", "five numbers"),
        ("horizon huge", f"predict --horizon {HUGE}", "--horizon"),
        ("workers and a scheduler", "batch --workers 2 --scheduler tcp://127.0.0.1:9", "--scheduler"),
        ("no workers", "batch --workers 0", "--workers"),
        ("an inference nobody knows", "classify --inference guess", "--inference"),
        ("no frame ahead", "predict --horizon 0", "--horizon"),
        ("no frames a second", "interpolate --fps 0", "--fps"),
        ("no frames", "synthesise --frames 0", "--frames"),
        ("no starts", "learn --order 3", "--order"),
        ("port taken by nobody we know", "annotate --port 99999", "--port"),
        exit=2,
    ),
    *refusals(("a seed of many digits", f"synthesise --seed {HUGE}", ""), exit=0),
]

PLACES = [
    *cases(
        "track",
        "run",
        ("is a file", file_instead, "run is a file; --out wants a folder"),
        ("is somebody's", foreign_instead, "holds files that are no run"),
    ),
    *cases("compare", "compared", ("is a file", file_instead, "compared is a file")),
    *cases("demo", "shown", ("is a file", file_instead, "shown is a file")),
    *cases("reproduce", "reproduced", ("is a file", file_instead, "reproduced is a file")),
    *cases("openpose", "run-openpose", ("is somebody's", foreign_instead, "run-openpose")),
    *cases("learn", "m2.npz", ("is a folder", folder_instead, "m2.npz is a folder")),
    *cases("classify", "labels.csv", ("is a folder", folder_instead, "labels.csv is a folder")),
    *cases("trc", "run.trc", ("is a folder", folder_instead, "run.trc is a folder")),
    *cases("settings", "s.toml", ("is a folder", folder_instead, "s.toml is a folder")),
    # A named pipe is no device that a test could harm, and as little to be replaced by a file.
    *cases("settings --overwrite --out pipe", "pipe", ("for a file", os.mkfifo, "pipe is no ordinary file")),
    *cases(f"track walk.mp4 {OF_MARKS} --out pipe", "pipe", ("for a folder", os.mkfifo, "pipe is a file")),
    *refusals(
        ("a folder below a file", f"track walk.mp4 {FOLLOWED}/../marks.csv/run", "cannot write into"),
        ("a name too long for a folder", f"track walk.mp4 {FOLLOWED}{'n' * 300}", "File name too long"),
        ("a name too long for a file", f"settings --out {'n' * 300}", "File name too long"),
        ("where only the system writes", "settings --out /proc/s.toml", "cannot write into /proc"),
        ("what is there, without leave", "classify poses.csv --out s.toml", "replace it with --overwrite"),
        (
            "a run there, without leave",
            "track walk.mp4 --keypoints marks.csv --out run",
            "run holds a complete run; choose another --out, or replace it with --overwrite",
        ),
        (
            "its own input for its output",
            f"interpolate poses.csv --model m.npz --out poses.csv {ASIDE}",
            "poses.csv is what the work reads",
        ),
        ("its own table for its model", "learn --out poses.csv", "poses.csv"),
        ("its own run", "dlc --out run/keypoints.csv", "keypoints.csv is what the work reads"),
        ("its own video", "annotate --overwrite --out walk.mp4", "walk.mp4 is what the work reads"),
        (
            "its own source for its marks",
            "annotate walk.mp4 --overwrite --from net.csv --out net.csv",
            "net.csv is what the work reads",
        ),
        (
            "the folder with the video for its output",
            f"track run/overlay.mp4 {FOLLOWED}",
            "would be replaced, and with it",
        ),
    ),
]

# Names that are nothing but unusual are followed, not refused.
NAMES = [
    Case(wrong, command, "", renamed(**names), exit=0)
    for wrong, command, names in (
        (
            "names of a clip and its marks",
            "track 'späte Läufe 走る.mp4' --keypoints 'ключ 1.csv' --stop 1 --out 'été #1 [a]%'",
            {"walk_mp4": "späte Läufe 走る.mp4", "marks_csv": "ключ 1.csv"},
        ),
        (
            "name of a folder of images",
            "track 'Bilder %05d ñ' --keypoints marks.csv --stop 1 --out '-- ü'",
            {"images": "Bilder %05d ñ"},
        ),
        (
            "names of poses and a model",
            f"classify '$ü; {{poses}}.csv' --model 'модель 1.npz' --out 'a&b.csv' {ASIDE}",
            {"poses_csv": "$ü; {poses}.csv", "m_npz": "модель 1.npz"},
        ),
        (
            "name of a run",
            "export 'Läufe/走る' --to openpose --quiet --out 'ein Ort/für alles'",
            {"run": "Läufe/走る"},
        ),
    )
]
