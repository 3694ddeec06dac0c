"""MOT, OpenSim's table of joint angles, with the signs of its gait models (gait2354, gait2392).

The pelvis is upright here, since its tilt is unknown: hip flexion is the thigh's angle from the vertical,
ahead +; knee flexion is negative; the ankle's angle is that between the line from ankle to toe and the shank,
toes up +, which is below 0 for a flat foot; lumbar extension is the trunk's lean from the vertical, ahead
negative, and `trunk_angle` the same with ahead +. With a known scale the pelvis is at the hip, metres. Arms
are as in the models with arms (Rajagopal 2016): `arm_flex` relative to the trunk and `elbow_flex`, ahead +.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dynamics.gaussian import Array
from kinematics.sides import SIDES
from tracker.foreign.points import side_seen
from tracker.foreign.scale import Scale
from tracker.foreign.text_files import ForeignError
from tracker.run.read import Record

NOTES = (
    "Units are S.I. units (second, meters, Newtons, ...)",
    "Angles are in degrees, with the signs of gait2354 and gait2392: hip flexion +, knee flexion -.",
    "ankle_angle is from ankle to toe tip, square to the shank 0, toes up +; a flat foot is below 0.",
    "trunk_angle is the lean from the vertical, ahead +, lumbar_extension its negative; pelvis upright.",
)


def write_mot(record: Record, facing: int, scale: Scale | None, path: Path) -> str:
    """Write every tracked frame in the layout of OpenSim; returns a remark on frames that are left out or
    were not measured. ForeignError: a figure without these angles."""
    wanted = {"torso", *(f"{joint}_{side}" for joint in ("hip", "knee") for side in SIDES)}
    if lacks := wanted - set(record.freedoms):
        raise ForeignError(
            f"a MOT has {', '.join(sorted(lacks))}, which this run's figure has not; leave it out"
        )
    columns = _columns(record, facing, scale)
    there = np.isfinite(np.sum(list(columns.values()), axis=0))
    said = _said(record, there, scale)
    table = np.stack([record.times, *columns.values()], axis=1)[there]
    header = (
        "Coordinates",
        "version=1",
        f"nRows={len(table)}",
        f"nColumns={table.shape[1]}",
        "inDegrees=yes",
        "",
        *NOTES,
        *([said] if said else []),
        "",
        "endheader",
        "\t".join(["time", *columns]),
    )
    rows = ("\t".join(f"{number:.6f}" for number in row) for row in table)
    path.write_text("\n".join([*header, *rows]) + "\n", encoding="utf-8")
    return said


def _columns(record: Record, facing: int, scale: Scale | None) -> dict[str, Array]:
    # If the figure is declared to face the other way, all angles in the picture's plane change sign.
    sign = facing * record.facing
    degrees = {name: sign * np.degrees(record.angle(name)) for name in record.freedoms}
    columns: dict[str, Array] = {}
    if scale is not None:
        ahead, up = scale.to_metres(record.place("hip")).T
        columns |= {"pelvis_tx": ahead, "pelvis_ty": up}
    columns["trunk_angle"] = degrees["torso"]
    for letter, side in (("r", "right"), ("l", "left")):
        own = side_seen(side, facing)
        columns[f"hip_flexion_{letter}"] = degrees[f"hip_{own}"]
        columns[f"knee_angle_{letter}"] = -degrees[f"knee_{own}"]
        for name, angle in (("ankle_angle", "ankle"), ("arm_flex", "shoulder"), ("elbow_flex", "elbow")):
            values = sign * np.degrees(record.angle(f"{angle}_{own}"))
            if np.isfinite(values).any():
                columns[f"{name}_{letter}"] = values
    columns["lumbar_extension"] = -degrees["torso"]
    return columns


def _said(record: Record, there: NDArray[np.bool_], scale: Scale | None) -> str:
    said = []
    if not there.all():
        said.append(f"{int((~there).sum())} frames without a pose are left out")
    unseen = int((there & ~record.measured).sum())
    if unseen:
        said.append(f"{unseen} frames were lost or out of the picture: their angles are the model's forecast")
    if scale is None:
        said.append("no pelvis position, since no height or scale is known")
    return "; ".join(said)
