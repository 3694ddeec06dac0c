"""Tiny rendered clips with known joints, and the commands run on them."""

import csv
import json
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from typer.testing import CliRunner

from tracker.cli.app import app
from tracker.foreign.points import Points
from tracker.progress import Progress
from tracker.scene.film import render, truth_table
from videos.writer import Writer

HEADER = ("frame", "keypoint", "x", "y", "visible")
RUN_FILES = {"keypoints.csv", "pose.csv", "overlay.mp4", "track.npz", "run.json", "gait.json", "report.html"}
RUN_FILES |= {"start.keypoints.csv"}
FPS = 30.0
QUIET = Progress("quiet")


@dataclass(frozen=True)
class Clip:
    """A video, its keypoints file, and what is known of it.

    joints : (T, 2) pixels for each keypoint
    leg_px : thigh + shank, pixels
    """

    video: Path
    keypoints: Path
    images: list
    joints: dict
    leg_px: float

    def __len__(self):
        return len(self.images)

    def rows(self, frames=None):
        """Rows of the keypoints table, of all frames or these."""
        return [
            (t, name, *places[t], 1)
            for t in (range(len(self)) if frames is None else frames)
            for name, places in self.joints.items()
        ]

    def errors(self, path):
        """(T,) mean distance of a keypoints.csv from the truth, leg lengths; toes do not count."""
        found = {
            (int(r["frame"]), r["keypoint"]): (float(r["x"]), float(r["y"])) for r in read_csv(path) if r["x"]
        }
        names = [name for name in self.joints if "toe" not in name]
        away = [[np.hypot(*(self.joints[n][t] - found[t, n])) for n in names] for t in range(len(self))]
        return np.mean(away, axis=1) / self.leg_px


def make_clip(folder):
    """Ten frames of a walker whom nothing hides, walking to the right."""
    scene = render(11, frames=10, size=(480, 270), shrubs=False)
    clip = Clip(folder / "walk.mp4", folder / "walk.keypoints.csv", scene.images, scene.joints, scene.leg_px)
    write_video(clip.video, scene.images)
    write_table(clip.keypoints, truth_table(scene))  # hidden joints are marked 0, as by hand
    return clip


def points_of(joints):
    """The joints (T, 2) of every name as a network's points, all of them certain."""
    places = np.stack([*joints.values()], axis=1)
    return Points(tuple(joints), places, np.ones(places.shape[:2]))


def write_video(path, images, times=None, fps=FPS):
    height, width = images[0].shape[:2]
    with Writer(path, fps, (width, height), crf=16) as writer:
        for image, time in zip(images, times or np.arange(len(images)) / fps, strict=True):
            writer.write(image, time)


def write_images(folder, images):
    """A folder of the pictures, numbered."""
    folder.mkdir()
    for t, image in enumerate(images):
        cv2.imwrite(str(folder / f"{t}.png"), cv2.cvtColor(image, cv2.COLOR_RGB2BGR))
    return folder


def write_table(path, rows, header=HEADER):
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(header)
        writer.writerows(rows)


def read_csv(path):
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def read_json(path):
    return json.loads(path.read_text(encoding="utf-8"))


def figtrack(*words):
    """The command's result: exit_code, stdout, stderr."""
    result = CliRunner().invoke(app, [str(word) for word in words])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


def succeeds(*words):
    """The result of a command that ends well."""
    result = figtrack(*words)
    assert result.exit_code == 0, result.output
    return result


def printed(*words):
    """What a quiet command prints that ends well and warns of nothing."""
    result = succeeds(*words, "--quiet")
    assert result.stderr == ""
    return result.stdout


def refused(*words):
    """The one line on stderr of a command that could not be done."""
    result = figtrack(*words, "--quiet")
    assert result.exit_code == 1, result.output
    lines = result.stderr.splitlines()
    assert len(lines) == 1
    assert lines[0].startswith("error: ")
    return lines[0]


def everything(folder):
    """The bytes of every file below a folder."""
    return {p.relative_to(folder): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}
