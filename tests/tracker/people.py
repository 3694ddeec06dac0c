"""One walker as other programs would write it down: their files, made here."""

import csv
import json

from tracker.foreign.coco import COCO_17
from tracker.foreign.openpose import BODY_25

# Somebody who faces right: the toes ahead of the ankles, the left leg swinging ahead.
WALKER = {
    "nose": (116.0, 42.0),
    "left_ear": (106.0, 40.0),
    "right_ear": (106.0, 40.0),
    "left_shoulder": (101.0, 70.0),
    "right_shoulder": (99.0, 70.0),
    "left_hip": (102.0, 130.0),
    "right_hip": (98.0, 130.0),
    "right_knee": (95.0, 175.0),
    "right_ankle": (80.0, 215.0),
    "right_toe": (95.0, 221.0),
    "left_knee": (120.0, 172.0),
    "left_ankle": (124.0, 217.0),
    "left_toe": (141.0, 213.0),
}
LEGS = {  # as ours are named: the right leg of who faces right is the nearer one
    f"{ours}_{part}": WALKER[f"{theirs}_{part}"]
    for ours, theirs in (("near", "right"), ("far", "left"))
    for part in ("knee", "ankle", "toe")
}
LIKELIHOOD = 0.95  # of every point of a DeepLabCut table
OPENPOSE_NAMES = {
    "right_toe": "RBigToe",
    "left_toe": "LBigToe",
    "nose": "Nose",
    **{f"{side}_{part}": side[0].upper() + part.title() for side in ("right", "left") for part in
       ("ear", "shoulder", "hip", "knee", "ankle")},
}  # fmt: skip


def moved(points, dx=0.0, dy=0.0, size=1.0):
    """The same person elsewhere, larger or smaller."""
    return {name: (dx + size * x, dy + size * y) for name, (x, y) in points.items()}


def mirrored(points):
    """The same person facing the other way, seen from the other side: right and left exchanged."""
    other = {"right": "left", "left": "right"}
    return {
        "_".join(other.get(word, word) for word in name.split("_")): (300.0 - x, y)
        for name, (x, y) in points.items()
    }


def openpose(path, people, confidence=0.9):
    """One frame's file."""
    listed = []
    for points in people:
        named = {OPENPOSE_NAMES[name]: place for name, place in points.items()}
        numbers = [[*named[name], confidence] if name in named else [0.0, 0.0, 0.0] for name in BODY_25]
        listed.append({"person_id": [-1], "pose_keypoints_2d": [n for point in numbers for n in point]})
    path.write_text(json.dumps({"version": 1.3, "people": listed}), encoding="utf-8")
    return path


def coco(path, by_image, flags=None):
    """A data set's file; `flags` by point, 2 (seen) unless given."""
    images = [{"id": 10 + i, "file_name": name} for i, name in enumerate(by_image)]
    annotations = [
        {
            "id": 1,
            "image_id": 10 + i,
            "category_id": 1,
            "iscrowd": 0,
            "keypoints": coco_numbers(points, flags),
        }
        for i, people in enumerate(by_image.values())
        for points in people
    ]
    category = {"id": 1, "name": "person", "keypoints": list(COCO_17)}
    content = {"images": images, "annotations": annotations, "categories": [category]}
    path.write_text(json.dumps(content), encoding="utf-8")
    return path


def coco_numbers(points, flags=None):
    flags = flags or {}
    triples = [[*points[n], flags.get(n, 2)] if n in points else [0, 0, 0] for n in COCO_17]
    return [number for triple in triples for number in triple]


def labelme(path, people, image="walk_0012.png", hidden=()):
    """One image's file, a group a person; labelme counts from the corner of the picture."""
    shapes = [
        {"label": name, "points": [[x + 0.5, y + 0.5]], "group_id": group, "shape_type": "point",
         "flags": {"hidden": name in hidden}}
        for group, points in enumerate(people)
        for name, (x, y) in points.items()
    ]  # fmt: skip
    content = {"version": "5.4.1", "flags": {}, "shapes": shapes, "imagePath": image}
    path.write_text(json.dumps(content), encoding="utf-8")
    return path


def trc(path, people):
    """One row a person, in pixels; a TRC has one person a frame."""
    names = list(WALKER)
    keys = ("DataRate", "CameraRate", "NumFrames", "NumMarkers", "Units")
    rows = [["PathFileType", "4", "(X/Y/Z)", path.name], keys, [25, 25, len(people), len(names), "px"]]
    rows += [["Frame#", "Time", *(cell for name in names for cell in (name, "", ""))], ["", "", "X1"]]
    for t, points in enumerate(people):
        cells = [n for name in names for n in (*points.get(name, ("nan", "nan")), 0.0)]
        rows.append([t + 1, t / 25.0, *cells])
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, delimiter="\t").writerows(rows)
    return path


def dlc(path, by_row, names=None, individuals=None):
    """A table; `by_row` by what stands in front of a row, a list of people where there are individuals."""
    people = [None] if individuals is None else individuals
    names = list(WALKER) if names is None else names
    columns = [(who, name, coord) for who in people for name in names for coord in ("x", "y", "likelihood")]
    rows = [["scorer", *["net"] * len(columns)]]
    if individuals is not None:
        rows.append(["individuals", *[who for who, _, _ in columns]])
    rows += [
        ["bodyparts", *[name for _, name, _ in columns]],
        ["coords", *[coord for _, _, coord in columns]],
    ]
    for front, entry in by_row.items():
        cells = [front]
        for points in [entry] if individuals is None else entry:
            for name in names:
                cells += [*points[name], LIKELIHOOD] if name in points else ["", "", ""]
        rows.append(cells)
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows(rows)
    return path
