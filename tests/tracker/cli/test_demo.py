"""The demo on few frames: the whole of it, but short."""

import shutil
from contextlib import redirect_stderr
from io import StringIO

import numpy as np
import pytest

from tests.tracker.clips import read_json
from tracker.cli import demo
from tracker.cli.demo import write_scene
from tracker.progress import Progress
from tracker.run.folder import fresh_folder
from tracker.scene.film import render
from tracker.tables.keypoints import KEYPOINTS, read_keypoints
from videos.frames import Video

pytestmark = pytest.mark.whole

FEW = 6


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """A short demo's folder, what it gave and what it told on the way."""
    out, shown = tmp_path_factory.mktemp("demo") / "out", Progress("plain")
    with redirect_stderr(StringIO()) as said, pytest.MonkeyPatch.context() as patch:
        patch.setattr(demo, "MODELS", ["cv"])
        patch.setattr(demo, "FRAMES", FEW)
        page, table = demo.run_demo(out, 2, overwrite=False, progress=shown)
    return out, page, table, said.getvalue()


def test_a_demo_tells_of_every_picture_and_leaves_the_clip_its_truth_and_a_comparison(done):
    out, page, table, said = done
    assert f"rendering a walk: {FEW} of {FEW} in" in said
    assert {path.name for path in out.iterdir()} == {
        "walk.mp4", "walk.keypoints.csv", "cv",
        "compare.json", "failure.png", "errors.png", "report.html", "demo.json",
    }  # fmt: skip
    assert page == out / "report.html"
    assert table.splitlines()[1].startswith("cv")
    assert read_json(out / "demo.json")["seed"] == 2
    assert read_json(out / "compare.json")["models"]["cv"]["truth_frames"] == FEW - 1


def test_all_that_it_leaves_goes_when_it_is_replaced(done, tmp_path):
    copy = shutil.copytree(done[0], tmp_path / "out")
    with fresh_folder(copy, overwrite=True) as aside:
        (aside / "new").touch()
    assert [path.name for path in copy.iterdir()] == ["new"]


def test_its_results_name_the_clip_where_it_came_to_lie_and_say_that_it_is_rendered(done):
    out, page, *_ = done
    assert read_json(out / "cv" / "run.json")["video"] == str(out / "walk.mp4")
    assert "A rendered clip" in page.read_text(encoding="utf-8")


def test_the_clip_and_its_marks_are_those_of_the_scene(tmp_path):
    scene = render(1, frames=3, size=(320, 180))
    video, keypoints = write_scene(scene, tmp_path)
    images = [frame.image for frame in Video(video)]
    assert len(images) == 3
    for image, wanted in zip(images, scene.images, strict=True):
        # A strongly compressed copy is a few grey levels off, another picture some dozens.
        assert np.abs(image.astype(float) - wanted).mean() < 8.0
    marks = read_keypoints(keypoints)
    assert sorted(marks) == [0, 1, 2]
    for t, marked in marks.items():
        assert set(marked) == set(KEYPOINTS)
        for name, mark in marked.items():
            assert (mark.x, mark.y) == pytest.approx(tuple(scene.joints[name][t]), abs=0.0051)
            assert mark.visible == scene.visible[name][t]
