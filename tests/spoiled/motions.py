"""Settings, models, pose tables and captures."""

from tests.spoiled.case import HUGE, Case
from tests.spoiled.spoil import (
    copied,
    cut,
    edited,
    emptied,
    encoded,
    flipped,
    folder_instead,
    removed,
    replaced,
    written,
)

SETTINGS = [
    Case("settings absent", "track", removed("s.toml"), "no settings file s.toml"),
    Case("settings are a folder", "track", folder_instead("s.toml"), "s.toml"),
    Case("settings in UTF-16", "track", encoded("s.toml", "utf-16"), "s.toml is no TOML"),
    Case("settings are a video", "track", copied("walk.mp4", "s.toml"), "s.toml is no TOML"),
    Case("settings cut in a line", "track", written("s.toml", "noise = "), "s.toml is no TOML"),
    Case(
        "settings nested without end",
        "track",
        written("s.toml", "noise = " + "[" * 9999),
        "s.toml is no TOML",
    ),
    Case("a setting nobody knows", "track", written("s.toml", "colour = 1\n"), "colour: no such setting"),
    Case("a setting of another type", "track", written("s.toml", "noise = 'much'\n"), "noise: "),
    Case("a setting that is not a number", "track", written("s.toml", "noise = nan\n"), "noise: "),
    Case("a setting too fine to be", "track", written("s.toml", "spacing = 1e-300\n"), "spacing: "),
    Case("a setting too large to be", "track", written("s.toml", "mark = 1e200\n"), "mark: "),
    Case(
        "a setting of too many digits", "track", written("s.toml", f"hypotheses = {'9' * 5000}\n"), "s.toml"
    ),
]

MODELS = [
    Case("model absent", "track", removed("m.npz"), "no model file m.npz"),
    Case("model empty", "track", emptied("m.npz"), "m.npz is no model file"),
    Case("model cut", "track", cut("m.npz"), "m.npz is no model file"),
    Case("model with a flipped bit", "track", flipped("m.npz", 1), "m.npz is no model file"),
    Case("model is a folder", "track", folder_instead("m.npz"), "m.npz"),
    Case("model is a video", "synthesise", copied("walk.mp4", "m.npz"), "m.npz is no model file"),
    Case(
        "model is a run's track.npz", "classify", copied("run/track.npz", "m.npz"), "m.npz is no model file"
    ),
]

POSES = [
    Case("poses absent", "classify", removed("poses.csv"), "no pose table poses.csv"),
    Case("poses empty", "predict", emptied("poses.csv"), "poses.csv is no pose table"),
    Case("poses are a folder", "interpolate", folder_instead("poses.csv"), "poses.csv"),
    Case("poses in UTF-16", "classify", encoded("poses.csv", "utf-16"), "poses.csv as a UTF-8"),
    Case("poses in Latin-1", "learn", encoded("poses.csv", "latin-1"), "poses.csv as a UTF-8"),
    Case("poses cut in a row", "predict", cut("poses.csv", 0.6), "poses.csv line"),
    Case(
        "poses with semicolons",
        "classify",
        edited("poses.csv", lambda d: d.replace(b",", b";")),
        "semicolons",
    ),
    Case("poses are a video", "learn", copied("walk.mp4", "poses.csv"), "poses.csv as a UTF-8"),
    Case("poses with a header alone", "classify", replaced("poses.csv", r"(?s)\n.*", "\n"), "has no poses"),
    Case(
        "a pose's frame is huge", "interpolate", replaced("poses.csv", r"\n0,1,", f"\n0,{HUGE},"), "poses.csv"
    ),
    Case(
        "a pose's frame is far",
        "interpolate",
        replaced("poses.csv", r"\n0,1,", "\n0,99999999,"),
        "at most 1000000 frames",
    ),
    Case(
        "an angle is huge",
        "classify",
        replaced("poses.csv", r"\n0,1,(\S+?),(\S+?),[-\d.]+", r"\n0,1,\1,\2,1e300"),
        "out of all range",
    ),
    Case(
        "an angle is infinite",
        "predict",
        replaced("poses.csv", r"\n0,1,(\S+?),(\S+?),[-\d.]+", r"\n0,1,\1,\2,-inf"),
        "finite number or empty",
    ),
    Case("a table of marks", "classify", copied("marks.csv", "poses.csv"), "is no pose table"),
    Case("too few poses", "learn", cut("poses.csv", 0.1), "poses.csv"),
    Case("captures absent", "learn captures", removed("trials.csv"), "trials.csv"),
    Case("captures empty", "learn captures", emptied("trials.csv"), "trials.csv lacks the column"),
    Case("captures in UTF-16", "reproduce", encoded("trials.csv", "utf-16"), "trials.csv"),
    Case(
        "captures of nothing", "reproduce", replaced("trials.csv", r"(?s)\n.*", "\n"), "leaves no walk or run"
    ),
    Case("a capture absent", "learn captures", removed("c0.bvh"), "c0.bvh"),
    Case("a capture empty", "learn captures", emptied("c0.bvh"), "c0.bvh"),
    Case("a capture cut", "reproduce", cut("c1.bvh", 0.7), "c1.bvh"),
    Case("a capture with a flipped bit", "learn captures", flipped("c0.bvh", 4), "c0.bvh"),
    Case(
        "a capture that stands still",
        "learn captures",
        replaced("c0.bvh", r"-?\d+\.\d{6}", "0.000000", 0),
        "c0.bvh",
    ),
    Case(
        "a capture of huge numbers",
        "learn captures",
        replaced("c0.bvh", r"\n-?\d+\.\d{6}", "\n1e300", 0),
        "c0.bvh",
    ),
    Case(
        "a capture in no time",
        "learn captures",
        replaced("c0.bvh", r"Frame Time: \S+", "Frame Time: 1e-300"),
        "c0.bvh",
    ),
    Case("a capture is a video", "learn captures", copied("walk.mp4", "c0.bvh"), "c0.bvh"),
    Case(
        "a segment past the end",
        "learn captures",
        replaced("trials.csv", "0-60", "0-999"),
        "its segment is 0-999",
    ),
]
