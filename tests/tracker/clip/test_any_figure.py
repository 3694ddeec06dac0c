"""A figure that is a TOML file and no code: one with five legs is marked, followed, learned and exported."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from kinematics.figure_file import load_figure
from kinematics.spm import View, joints
from tests.tracker.clips import QUIET, figtrack, read_csv, refused, write_table, write_video
from tests.tracker.painted import Painted
from tracker.annotate.marks import Table
from tracker.annotate.session import MarksRequest, Session
from tracker.api import follow
from tracker.foreign.dlc import read_people
from tracker.tables.keypoints import points, read_keypoints

FILE = Path(__file__).parents[1] / "five_legs.toml"
FIVE = load_figure(FILE)
VIEW = View(origin=(45.0, 70.0), unit=60.0, facing=1)
FRAMES, STRIDE = 16, 20.0  # frames


@dataclass(frozen=True)
class Film:
    """Where the film and its marks lie, and the joints (T, J, 2) in pixels."""

    video: Path
    marks: Path
    joints: np.ndarray

    def errors(self, folder):
        """(T, J) pixels from the joints that a run found, in the order of the figure."""
        found = read_keypoints(folder / "keypoints.csv", FIVE.joints)
        places = [[points(found[t])[name] for name in FIVE.joints] for t in range(FRAMES)]
        return np.hypot(*np.moveaxis(np.array(places) - self.joints, -1, 0))


def walk():
    """(T, D) poses of a walk in which every leg has a phase of its own."""
    q = np.zeros((FRAMES, len(FIVE.freedoms)))
    q[:, 0] = 0.03 * np.arange(FRAMES)
    for leg in range(1, 6):
        phase = 2.0 * np.pi * (np.arange(FRAMES) / STRIDE + leg / 5.0)
        q[:, FIVE.index(f"knee_{leg}_turn")] = 0.3 * np.sin(phase)
        q[:, FIVE.index(f"foot_{leg}_turn")] = 0.4 + 0.3 * np.cos(phase)
    q[:, FIVE.index("wag")] = 0.2
    return q


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    folder, poses = tmp_path_factory.mktemp("five"), walk()
    painted = Painted(np.random.default_rng(4), FIVE, view=VIEW, size=(256, 150), fine=2)
    write_video(folder / "five.mp4", [painted.picture(q) for q in poses])
    places = np.stack([VIEW.to_pixels(joints(FIVE, q)) for q in poses])
    rows = [
        (t, name, *places[t, FIVE.joints.index(name)].round(2), 1)
        for t in (0, 5, 10, 15)
        for name in FIVE.marks
    ]
    write_table(folder / "marks.csv", rows)
    return Film(folder / "five.mp4", folder / "marks.csv", places)


@pytest.fixture(scope="module")
def run(film):
    folder = film.video.with_name("run")
    words = ["--keypoints", film.marks, "--figure", FILE, "--model", "cv", "--out", folder]
    figtrack("track", film.video, *words)
    return folder


def test_it_is_followed_and_all_names_are_its_own(film, run):
    apart = film.errors(run)
    marked = [FIVE.joints.index(name) for name in FIVE.marks]
    assert apart[:, marked].mean() < 0.04 * VIEW.unit
    # A knee that is never marked is where its links meet.
    assert np.median(apart[:, FIVE.joints.index("knee_5")]) < 0.06 * VIEW.unit
    assert {row["outcome"] for row in read_csv(run / "pose.csv")} <= {"ok", "hidden"}
    header = list(read_csv(run / "pose.csv")[0])
    assert header[2 : 2 + len(FIVE.learned_freedoms)] == list(FIVE.learned_freedoms)
    assert header[-1] == "wag"
    assert {row["keypoint"] for row in read_csv(run / "keypoints.csv")} == set(FIVE.joints)
    assert "knee 3 turn" in (run / "report.html").read_text()
    assert not (run / "gait.json").exists()


def test_what_was_followed_is_learned_and_followed_again(film, run, tmp_path):
    figtrack("learn", run / "pose.csv", "--figure", FILE, "--states", "1", "--out", tmp_path / "five.npz")
    track = follow(film.video, film.marks, figure=FILE, model=tmp_path / "five.npz", stop=8)
    apart = np.hypot(*np.moveaxis(track.joints() - film.joints[: len(track)], -1, 0))
    assert apart.mean() < 0.05 * VIEW.unit
    assert track.labels == ("motion", "free")


def test_models_are_compared_by_its_own_joints(film, tmp_path):
    words = ["--keypoints", film.marks, "--figure", FILE, "--model", "cv", "--stop", "6"]
    said = figtrack("compare", film.video, *words, "--out", tmp_path / "compared").stdout
    assert "1 of 1" in said
    page = (tmp_path / "compared" / "report.html").read_text()
    assert "over snout, rump, knee 1, foot 1," in page


def test_deeplabcut_takes_any_figure_and_what_is_of_people_says_so(run, tmp_path):
    figtrack("export", run, "--to", "dlc", "--out", tmp_path / "five.csv")
    (points,) = read_people(tmp_path / "five.csv")[3]
    assert set(points) == set(FIVE.joints)
    for to in ("trc", "mot", "sports2d", "openpose", "myogait"):
        said = refused("export", run, "--to", to, "--out", tmp_path / f"five_px.{to}")
        assert said == (
            f"error: {to} has places for people's joints alone, which this run's figure has not; "
            "--to dlc takes any figure"
        )


def test_points_under_its_own_names_measure_it_and_start_it(film, run, tmp_path):
    figtrack("export", run, "--to", "dlc", "--out", tmp_path / "five.csv")
    alone = {"figure": FILE, "model": "cv", "measure": tmp_path / "five.csv", "templates": False}
    track = follow(film.video, tmp_path / "five.csv", start=0, stop=4, **alone)
    assert np.hypot(*np.moveaxis(track.joints() - film.joints[:5], -1, 0)).mean() < 0.05 * VIEW.unit


def test_what_cannot_be_is_said_in_a_line(film, tmp_path):
    marked = ["track", film.video, "--keypoints", film.marks, "--figure", FILE, "--out", tmp_path / "run"]
    assert refused("track", film.video, "--figure", FILE, "--model", "cv", "--out", tmp_path / "run") == (
        "error: a five-legs is not found by itself; mark one frame with 'figtrack annotate --figure "
        f"{FILE}' and give --keypoints"
    )
    said = refused(*marked)
    assert "the model speaks of root_x, root_y, torso" in said
    assert said.endswith("learn a model for this figure, or take --model cv")
    said = refused(*marked, "--model", "cv", "--height", "1.75")
    assert said == "error: height and scale are for people; leave them out, or follow a walker"
    assert "known are snout, rump, knee_1" in refused(
        "track", film.video, "--keypoints", _one_mark(tmp_path, "knee_5"), "--figure", FILE
    )


def test_captures_are_of_people(tmp_path):
    (tmp_path / "t.csv").write_text("file,subject,trial,activity,fps,segments,tags,licence\n")
    said = refused("learn", "--trials", tmp_path / "t.csv", "--figure", FILE, "--out", tmp_path / "m.npz")
    assert said == "error: captures are of people; learn a five-legs from pose tables"


def _one_mark(folder, name):
    write_table(folder / "one.csv", [(0, name, 5.0, 5.0, 1)])
    return folder / "one.csv"


def test_the_marking_page_asks_for_its_joints_in_its_order(film, tmp_path):
    session = Session(film.video, Table(tmp_path / "k.csv", figure=FIVE), 0, figure=str(FILE))
    opening = session.opening()
    assert [joint["name"] for joint in opening["joints"]] == list(FIVE.marks)
    assert opening["base"] == "rump"
    told = {joint["name"]: joint for joint in opening["joints"]}
    assert {name: told[name]["before"] for name in ("foot_5", "foot_1", "rump")} == {
        "foot_5": "rump",
        "foot_1": "knee_1",
        "rump": None,
    }
    assert [told[f"knee_{leg}"]["twin"] for leg in (1, 2, 3)] == ["knee_5", "knee_4", "knee_3"]
    assert {name for name in told if told[name]["needed"]} == set(FIVE.needed)
    assert [told[name]["side"] for name in ("knee_1", "snout", "foot_5")] == ["near", "trunk", "far"]
    rows = read_csv(film.marks)[: len(FIVE.marks)]
    marks = {row["keypoint"]: {"x": float(row["x"]), "y": float(row["y"])} for row in rows}
    advice = session.check(MarksRequest(frames={0: marks}))
    assert (advice["missing"], advice["faults"], advice["faces"]) == ((), (), "right")
    assert session.next_command().endswith(f"--figure {FILE}")


def test_a_run_of_it_can_be_put_right(film, run):
    from tracker.annotate.correction import Correction

    session = Correction(run, None, QUIET)
    shown = session.opening()["frame"]["figure"]
    assert set(shown) == set(FIVE.marks)
    truth = film.joints[0, [FIVE.joints.index(name) for name in shown]]
    assert [(mark["x"], mark["y"]) for mark in shown.values()] == pytest.approx(truth, abs=0.05 * VIEW.unit)
