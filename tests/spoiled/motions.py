"""Settings, models, pose tables and captures."""

from tests.spoiled.case import HUGE, cases
from tests.spoiled.spoil import copied, cut, encoded, flipped, replaced, separated, written

SETTINGS = cases(
    "track",
    "s.toml",
    ("is a video", copied("walk.mp4"), "s.toml is no TOML"),
    ("cut in a line", written("noise = "), "s.toml is no TOML"),
    ("nested without end", written("noise = " + "[" * 9999), "s.toml is no TOML"),
    ("has one nobody knows", written("colour = 1\n"), "colour: no such setting"),
    ("has one of another type", written("noise = 'much'\n"), "noise: "),
    ("has one that is a flag", written("noise = true\n"), "noise: input should be a valid number, got True"),
    ("has a list of flags", written("blurs = [true]\n"), "blurs.0: input should be a valid number, got True"),
    ("has one that is not a number", written("noise = nan\n"), "noise: "),
    (
        "has a share of a step",
        written("iterations = 2.5\n"),
        "iterations: input should be a valid integer, got 2.5",
    ),
    (
        "has a word for a flag",
        written("camera = 'yes'\n"),
        "camera: input should be a valid boolean, got 'yes'",
    ),
    ("has a number for a list", written("blurs = 0.05\n"), "blurs: input should be a valid array, got 0.05"),
    ("has one too fine to be", written("spacing = 1e-300\n"), "spacing: "),
    ("has one too large to be", written("mark = 1e200\n"), "mark: "),
    ("has one of too many digits", written(f"hypotheses = {'9' * 5000}\n"), "s.toml"),
)

MODELS = [
    *cases(
        "track",
        "m.npz",
        ("cut", cut(), "m.npz is no model file or is damaged"),
        ("has a flipped bit", flipped(1), "m.npz is no model file"),
    ),
    *cases("synthesise", "m.npz", ("is a video", copied("walk.mp4"), "m.npz is no model file")),
    *cases("classify", "m.npz", ("is a run's", copied("run/track.npz"), "m.npz is no model file")),
]

POSES = [
    *cases(
        "classify",
        "poses.csv",
        ("with semicolons", separated(b";"), "semicolons"),
        ("with a header alone", replaced(r"(?s)\n.*", "\n"), "has no poses"),
        (
            "with a huge angle",
            replaced(r"\n0,1,(\S+?),(\S+?),[-\d.]+", r"\n0,1,\1,\2,1e300"),
            "out of all range",
        ),
        ("are marks", copied("marks.csv"), "is no pose table"),
        ("with a word", replaced(r"\n0,1,[-\d.]+", "\n0,1,x"), "line 3: root_x must be a finite number"),
        ("with empty cells", replaced(r"(?m)^0,(\d+),.*", r"0,\1" + 8 * ",", 0), "poses.csv"),
    ),
    *cases(
        "predict",
        "poses.csv",
        ("cut in a row", cut(0.6), "poses.csv line"),
        (
            "with infinity",
            replaced(r"\n0,1,(\S+?),(\S+?),[-\d.]+", r"\n0,1,\1,\2,-inf"),
            "finite number or empty",
        ),
    ),
    *cases(
        "interpolate",
        "poses.csv",
        ("of a huge frame", replaced(r"\n0,1,", f"\n0,{HUGE},"), "poses.csv"),
        ("of a far frame", replaced(r"\n0,1,", "\n0,99999999,"), "at most 1000000 frames"),
    ),
    *cases(
        "learn",
        "poses.csv",
        ("in Latin-1", encoded("latin-1"), "poses.csv as a UTF-8"),
        ("are a video", copied("walk.mp4"), "poses.csv as a UTF-8"),
        ("too few", cut(0.1), "poses.csv"),
    ),
]

CAPTURES = [
    *cases(
        "learn captures",
        "trials.csv",
        ("is no text", written("\0\1"), "lacks the column"),
        ("lacks a column", replaced("trial,", "", 1), "lacks the column 'trial'; add it"),
        ("with a header alone", replaced(r"(?s)\n.*", "\n"), "leaves no sequences of 'walk'; check --label"),
        ("with a word", replaced("walk,30", "walk,fast"), "line 2: fps 'fast'"),
        ("with a segment past the end", replaced("0-60", "0-999"), "its segment is 0-999"),
    ),
    *cases("reproduce", "trials.csv", ("of nothing", replaced(r"(?s)\n.*", "\n"), "leaves no walk or run")),
    *cases("reproduce", "c1.bvh", ("cut", cut(0.7), "c1.bvh")),
    *cases(
        "learn captures",
        "c0.bvh",
        ("has a flipped bit", flipped(4), "c0.bvh"),
        ("stands still", replaced(r"-?\d+\.\d{6}", "0.000000", 0), "c0.bvh"),
        ("has huge numbers", replaced(r"\n-?\d+\.\d{6}", "\n1e300", 0), "c0.bvh"),
        ("in no time", replaced(r"Frame Time: \S+", "Frame Time: 1e-300"), "c0.bvh"),
        ("is a video", copied("walk.mp4"), "c0.bvh"),
    ),
]
