"""labelme's JSON: one image a file, points as shapes, people distinguished by their group.

labelme's origin is the picture's top-left corner: the centre of the top-left pixel is (0.5, 0.5) there.
"""

from pathlib import Path
from typing import Any

from tracker.foreign.people import People, Sighting, frame_number, sighting
from tracker.foreign.text_files import ForeignError, laid_out, load_json

CORNER = 0.5
HIDDEN_FLAGS = ("hidden", "occluded")


def read_people(path: Path) -> People:
    """All people in the file; the frame is the number in the image's name, or in the file's own, else 0."""
    content = load_json(path)
    groups: dict[Any, dict[str, Sighting]] = {}
    with laid_out(path, "labelme file", "save it again"):
        for shape in content["shapes"]:
            if shape.get("shape_type", "point") != "point":
                continue
            x, y = shape["points"][0]
            flags = shape.get("flags") or {}
            point = sighting(x, y, visible=not any(flags.get(flag) for flag in HIDDEN_FLAGS))
            if point is not None:
                placed = Sighting(point.x - CORNER, point.y - CORNER, visible=point.visible)
                group, label = groups.setdefault(shape.get("group_id"), {}), str(shape["label"])
                if label in group:
                    raise ForeignError(
                        f"{path} has two points {label!r} in a group; give each person a group of their own"
                    )
                group[label] = placed
    numbers = (frame_number(str(content.get("imagePath") or "")), frame_number(path.name))
    frame = next((number for number in numbers if number is not None), 0)
    return {frame: list(groups.values())} if groups else {}
