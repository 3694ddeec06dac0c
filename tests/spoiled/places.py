"""Options, and the places that results go to."""

from tests.spoiled.case import HUGE, Case
from tests.spoiled.spoil import (
    file_instead,
    folder_instead,
    foreign_instead,
    nothing,
    piped,
    renamed,
)
from tests.spoiled.stock import ASIDE, FOLLOWED, OF_MARKS

OPTIONS = [
    Case("start huge", "track", nothing, f"frame {HUGE} is not marked", f"--start {HUGE}"),
    Case("stop huge", "track", nothing, "--stop", f"--stop {HUGE}", exit=2),
    Case("rate is not a number", "track", nothing, "--rate", "--rate nan", exit=2),
    Case("frames a second are not a number", "predict", nothing, "--fps", "--fps nan", exit=2),
    Case("height is not a number", "trc", nothing, "--height", "--height nan", exit=2),
    Case("noise is not a number", "learn", nothing, "--noise", "--noise nan", exit=2),
    Case("weight is not a number", "classify", nothing, "--pose-weight", "--pose-weight nan", exit=2),
    Case("height in centimetres", "trc", nothing, "--height", "--height 175", exit=2),
    Case("scale of endless metres", "mot", nothing, "metres between", "--scale-points 0,0,9,9,inf"),
    Case("scale points in one place", "mot", nothing, "two points apart", "--scale-points 5,5,5,5,1"),
    Case("scale points are four", "mot", nothing, "five numbers", "--scale-points 0,0,9,9", exit=2),
    Case("horizon huge", "predict", nothing, "--horizon", f"--horizon {HUGE}", exit=2),
    Case("port taken by nobody we know", "annotate", nothing, "--port", "--port 99999", exit=2),
    Case("a model that does not ship", "track", nothing, "no model 'swim' ships", "--model swim"),
    Case("a sequence that is not there", "predict", nothing, "no sequence 'b' to show", "--show b"),
    Case(
        "a picture of another kind",
        "classify poses.csv --model m.npz --plot a.doc --out labels.csv",
        nothing,
        "--plot wants",
    ),
    Case(
        "a scheduler that is none",
        "batch jobs.csv --quiet --scheduler nowhere",
        nothing,
        "answers at nowhere",
    ),
    Case("a seed of many digits", "synthesise", nothing, "", f"--seed {HUGE}", exit=0),
]

PLACES = [
    Case(
        "a file where the run's folder should be",
        "track",
        file_instead("run"),
        "run is a file; --out wants a folder",
    ),
    Case("a file where the comparison should be", "compare", file_instead("compared"), "compared is a file"),
    Case("a file where the demo should be", "demo", file_instead("shown"), "shown is a file"),
    Case(
        "a file where the experiments should be",
        "reproduce",
        file_instead("reproduced"),
        "reproduced is a file",
    ),
    Case("somebody's folder for the run", "track", foreign_instead("run"), "holds files that are no run"),
    Case("somebody's folder for the poses", "openpose", foreign_instead("run-openpose"), "run-openpose"),
    Case("a folder where the model should be", "learn", folder_instead("m2.npz"), "m2.npz is a folder"),
    Case(
        "a folder where the labels should be",
        "classify",
        folder_instead("labels.csv"),
        "labels.csv is a folder",
    ),
    Case("a folder where the export should be", "trc", folder_instead("run.trc"), "run.trc is a folder"),
    Case("a folder where the settings should be", "settings", folder_instead("s.toml"), "s.toml is a folder"),
    Case(
        "a folder below a file", f"track walk.mp4 {FOLLOWED}/../marks.csv/run", nothing, "cannot write into"
    ),
    Case("a pipe for a file", "settings --overwrite --out pipe", piped("pipe"), "pipe is no ordinary file"),
    Case("a pipe for a folder", f"track walk.mp4 {OF_MARKS} --out pipe", piped("pipe"), "pipe is a file"),
    Case(
        "a name too long for a folder", f"track walk.mp4 {FOLLOWED}{'n' * 300}", nothing, "File name too long"
    ),
    Case("a name too long for a file", f"settings --out {'n' * 300}", nothing, "File name too long"),
    Case(
        "a place that only the system writes to",
        "settings --out /proc/s.toml",
        nothing,
        "cannot write into /proc",
    ),
    Case("what is there, without leave", "settings --out s.toml", nothing, "replace it with --overwrite"),
    Case(
        "a run there, without leave",
        "track walk.mp4 --keypoints marks.csv --out run",
        nothing,
        "replace it with --overwrite",
    ),
    Case(
        "its own input for its output",
        f"interpolate poses.csv --model m.npz --out poses.csv {ASIDE}",
        nothing,
        "poses.csv is what the work reads",
    ),
    Case(
        "its own table for its model",
        "learn poses.csv --states 1 --rounds 1 --out poses.csv --overwrite",
        nothing,
        "poses.csv",
    ),
    Case(
        "its own run for its output",
        "export run --to dlc --overwrite --out run/keypoints.csv",
        nothing,
        "keypoints.csv is what the work reads",
    ),
    Case(
        "its own video for its marks",
        "annotate walk.mp4 --overwrite --out walk.mp4",
        nothing,
        "walk.mp4 is what the work reads",
    ),
    Case(
        "its own source for its marks",
        "annotate walk.mp4 --overwrite --from net.csv --out net.csv",
        nothing,
        "net.csv is what the work reads",
    ),
    Case(
        "the folder with the video for its output",
        f"track run/overlay.mp4 {FOLLOWED}",
        nothing,
        "would be replaced, and with it",
    ),
]

# Names that are nothing but unusual are followed, not refused.
NAMES = [
    Case(
        "a clip and its marks",
        "track 'späte Läufe 走る.mp4' --keypoints 'ключ 1.csv' --stop 1 --out 'été #1 [a]%'",
        renamed({"walk.mp4": "späte Läufe 走る.mp4", "marks.csv": "ключ 1.csv"}),
        "",
        exit=0,
    ),
    Case(
        "a folder of images",
        "track 'Bilder %05d ñ' --keypoints marks.csv --stop 1 --out '-- ü'",
        renamed({"images": "Bilder %05d ñ"}),
        "",
        exit=0,
    ),
    Case(
        "poses and a model",
        f"classify '$ü; {{poses}}.csv' --model 'модель 1.npz' --out 'a&b.csv' {ASIDE}",
        renamed({"poses.csv": "$ü; {poses}.csv", "m.npz": "модель 1.npz"}),
        "",
        exit=0,
    ),
    Case(
        "a run",
        "export 'Läufe/走る' --to openpose --quiet --out 'ein Ort/für alles'",
        lambda folder: [(folder / "Läufe").mkdir(), renamed({"run": "Läufe/走る"})(folder)],
        "",
        exit=0,
    ),
]
