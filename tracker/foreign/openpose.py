"""OpenPose's JSON: one file a frame with all people, a point as x, y, confidence; 0, 0, 0 for none."""

import json
import re
from pathlib import Path

import numpy as np

from tracker.foreign.people import People, Person, frame_number, person, triples
from tracker.foreign.points import HALPE, Points
from tracker.foreign.text_files import ForeignError, laid_out, load_json

BODY_25 = (
    *("Nose", "Neck", "RShoulder", "RElbow", "RWrist", "LShoulder", "LElbow", "LWrist"),
    *("MidHip", "RHip", "RKnee", "RAnkle", "LHip", "LKnee", "LAnkle"),
    *("REye", "LEye", "REar", "LEar"),
    *("LBigToe", "LSmallToe", "LHeel", "RBigToe", "RSmallToe", "RHeel"),
)
# The older layout has neither MidHip nor feet.
COCO_18 = tuple(name for name in BODY_25[:19] if name != "MidHip")
LAYOUTS = {3 * len(names): names for names in (BODY_25, COCO_18)}
# BODY_25 has no head top, and figtrack tracks no nose.
NAMES = {"MidHip" if name == "Hip" else name: joint for name, joint in HALPE.items() if name != "Head"}
OTHERS = ("face", "hand_left", "hand_right")
FILE = re.compile(r"(?!\.)(.*_)?(\d+)_keypoints\.json")  # no hidden ones, as macOS adds to copies


def write_openpose(points: Points, folder: Path, prefix: str) -> None:
    """Write PREFIX_000000000000_keypoints.json and so on, with one person in each."""
    for t in range(len(points)):
        one = {"person_id": [-1], "pose_keypoints_2d": _numbers(points, t)}
        one |= {f"{part}_keypoints_2d": [] for part in OTHERS}
        one |= {f"{part}_keypoints_3d": [] for part in ("pose", *OTHERS)}
        path = folder / f"{prefix}_{t:012d}_keypoints.json"
        path.write_text(json.dumps({"version": 1.3, "people": [one]}) + "\n", encoding="utf-8")


def holds_frames(folder: Path) -> bool:
    """Whether the folder holds files of frames and nothing else."""
    return folder.is_dir() and all(FILE.fullmatch(path.name) for path in folder.iterdir())


def read_people(path: Path) -> People:
    """All people in a file, or in all files of a folder; the frame is the number in its name, else 0."""
    if not path.is_dir():
        return {_frame(path): _people(path)}
    files = sorted(file for file in path.iterdir() if FILE.fullmatch(file.name))
    if not files:
        raise ForeignError(f"{path} holds no files NAME_000000000000_keypoints.json; give OpenPose's folder")
    people = {_frame(file): _people(file) for file in files}
    if len(people) < len(files):
        raise ForeignError(f"{path} has two files of a frame; give a folder of one video")
    return people


def _numbers(points: Points, t: int) -> list[float]:
    numbers = np.zeros((len(BODY_25), 3))
    for j, name in enumerate(points.names):
        if points.likelihood[t, j] > 0:
            numbers[BODY_25.index(name)] = [*points.places[t, j], points.likelihood[t, j]]
    return [round(float(number), 4) for number in numbers.ravel()]


def _frame(path: Path) -> int:
    named = FILE.fullmatch(path.name)
    return int(named[2]) if named else frame_number(path.name) or 0


def _people(path: Path) -> list[Person]:
    content = load_json(path)
    with laid_out(path, "OpenPose file"):
        of_each = [one["pose_keypoints_2d"] for one in content["people"]]
        return [person(triples(LAYOUTS.get(len(numbers), BODY_25), numbers)) for numbers in of_each]
