"""COCO's keypoints JSON: a data set's annotations, or a detector's list of results."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tracker.foreign.people import People, frame_number, person, triples
from tracker.foreign.text_files import ForeignError, laid_out, load_json

COCO_17 = (
    *("nose", "left_eye", "right_eye", "left_ear", "right_ear"),
    *("left_shoulder", "right_shoulder", "left_elbow", "right_elbow", "left_wrist", "right_wrist"),
    *("left_hip", "right_hip", "left_knee", "right_knee", "left_ankle", "right_ankle"),
)
OCCLUDED, LABELLED = 1, 2  # visibility flags of a data set; 0 means no point


def read_people(path: Path) -> People:
    """All people in the file, by frame; ForeignError: another kind of file, or a malformed annotation.

    Frame numbers are those in a data set's image file names, or the `image_id` of a list of results. Points
    have the names in the category, if any. Crowds and annotations without points are left out.
    """
    content = load_json(path)
    with laid_out(path, "COCO keypoints file"):
        frames, people = _labelled(content) if isinstance(content, Mapping) else _detected(content)
    if len(set(frames.values())) < len(frames):
        raise ForeignError(
            f"{path} has two images of a frame; give a file of one video, whose images are numbered"
        )
    return people


def _labelled(content: Mapping[str, Any]) -> tuple[Mapping[Any, int], People]:
    """The frame of each image, and the people in it."""
    names = {
        category["id"]: category.get("keypoints") or COCO_17 for category in content.get("categories", [])
    }
    frames: dict[Any, int] = {}
    for image in content.get("images", []):
        number = frame_number(str(image["file_name"]))
        frames[image["id"]] = int(image["id"]) if number is None else number
    people: People = {}
    for one in content["annotations"]:
        if one.get("iscrowd") or not any(one.get("keypoints") or []):
            continue
        points = triples(names.get(one.get("category_id"), COCO_17), one["keypoints"])
        flagged = {
            name: (x, y, 1.0 if flag in (OCCLUDED, LABELLED) else 0.0, flag == LABELLED)
            for name, (x, y, flag) in points.items()
        }
        image = one["image_id"]
        if image not in frames:
            frames[image] = int(image)
        people.setdefault(frames[image], []).append(person(flagged))
    return frames, people


def _detected(content: list[Any]) -> tuple[Mapping[Any, int], People]:
    """The frame of each image, and the people in it."""
    frames: dict[Any, int] = {}
    people: People = {}
    for one in content:
        image = one["image_id"]
        frames[image] = (frame_number(image) or 0) if isinstance(image, str) else int(image)
        people.setdefault(frames[image], []).append(person(triples(COCO_17, one["keypoints"])))
    return frames, people
