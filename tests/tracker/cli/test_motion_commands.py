"""classify, predict, interpolate, synthesise: what they leave, what they say, and how they fail."""

import json
import sys
from dataclasses import replace
from types import ModuleType

import av
import numpy as np
import pytest

from kinematics.mocap import POSE_COLUMNS
from tests.tracker.clips import everything, printed, read_csv, refused, succeeds, write_table
from tests.tracker.gaits import HEADER, both, gait, gait_hmm, gait_model, saved, sequence, write_poses
from tracker.models.learn import NOISE
from tracker.motion import commands
from tracker.tables.poses import pose_cells, read_poses

pytestmark = pytest.mark.whole

SD = [f"{name}_sd" for name in POSE_COLUMNS]
ON_TABLES = ("classify", "predict", "interpolate")
PNG = b"\x89PNG"


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    return saved(tmp_path_factory.mktemp("model") / "gait.npz", gait_model())


@pytest.fixture(scope="module")
def hmm(tmp_path_factory):
    return saved(tmp_path_factory.mktemp("hmm") / "hmm.npz", gait_hmm())


@pytest.fixture
def poses(tmp_path, rng):
    """Two sequences; one has its own labels, a gap and an empty cell, the other a number written oddly."""
    y, labels = both(rng, frames=30)
    y[20:24] = np.nan
    y[40, 4] = np.nan
    further = sequence(gait("walk", 30, rng), "b", first=5, labels=("",) * 30)
    odd = list(further.cells)
    odd[4] = (*odd[4][:4], "1.50e1", *odd[4][5:])
    further = replace(further, cells=tuple(odd))
    return write_poses(tmp_path / "poses.csv", sequence(y, "a", labels=labels), further, further=["label"])


@pytest.fixture
def few(tmp_path, rng):
    """A table of few poses, where what is made of them does not matter."""
    return write_poses(tmp_path / "few.csv", sequence(gait("walk", 12, rng)))


@pytest.mark.parametrize("inference", ["viterbi", "variational", "hmm", None])
def test_classify_leaves_a_row_a_frame_with_probabilities(tmp_path, poses, model, hmm, inference):
    asked = [] if inference is None else ["--inference", inference]
    out = tmp_path / "l.csv"
    said = printed("classify", poses, "--model", hmm if inference == "hmm" else model, *asked, "--out", out)
    rows = read_csv(out)
    shares = [] if inference == "viterbi" else ["p_walk", "p_run"]
    assert list(rows[0]) == ["seq", "frame", "label", "state", *shares]
    assert [(row["seq"], int(row["frame"])) for row in rows] == [
        *(("a", t) for t in range(60)), *(("b", t) for t in range(5, 35))
    ]  # fmt: skip
    assert {row["label"] for row in rows} == {"walk", "run"}
    for row in rows:
        chances = [float(row[name]) for name in shares]
        assert not chances or sum(chances) == pytest.approx(1.0, abs=2e-6)
        assert not chances or row["label"] == ["walk", "run"][int(np.argmax(chances))]
    first, second, last = said.splitlines()
    assert first.startswith("86 frames in 2 sequences: walk 6")
    assert second.startswith("the table's own label on 9") or second.startswith(
        "the table's own label on 100"
    )
    assert "of 56 frames that have one" in second  # rows that are not there have no label
    assert last == f"see {out}, {out.with_suffix('.png')}"
    assert out.with_suffix(".png").read_bytes().startswith(PNG)


def test_predict_leaves_a_forecast_a_row_and_as_many_past_the_end(tmp_path, poses, model):
    out, horizon = tmp_path / "p.csv", 4
    said = printed("predict", poses, "--model", model, "--horizon", horizon, "--out", out)
    rows = read_csv(out)
    assert list(rows[0]) == [*HEADER, *SD]
    frames = [int(row["frame"]) for row in rows if row["seq"] == "b"]
    assert frames == list(range(5, 35 + horizon))
    for row in rows:
        early = int(row["frame"]) < horizon + (5 if row["seq"] == "b" else 0)
        assert all((row[name] == "") == early for name in (*POSE_COLUMNS, *SD))
    assert said.startswith(f"forecasts {horizon} frame{'s' * (horizon > 1)} ahead in 2 sequences: ")
    assert "degrees RMSE" in said
    assert out.with_suffix(".png").read_bytes().startswith(PNG)


def test_interpolate_fills_what_is_empty_and_leaves_the_rest_to_the_letter(tmp_path, poses, model):
    out = tmp_path / "i.csv"
    said = printed("interpolate", poses, "--model", model, "--out", out)
    assert said.startswith("33 cells filled in 5 frames of 2 sequences, angles to ")
    rows = {(row["seq"], row["frame"]): row for row in read_csv(out)}
    assert rows["b", "9"]["hip_near"] == "1.50e1"
    given = {(row["seq"], row["frame"]): row for row in read_csv(poses)}
    assert list(next(iter(rows.values()))) == [*HEADER, *SD]
    assert len(rows) == 90
    assert len(given) == 86
    for key, row in rows.items():
        for name in POSE_COLUMNS:
            before = given[key][name] if key in given else ""
            assert row[name] == before if before else float(row[name]) < 1e3
            assert (row[f"{name}_sd"] == "") == bool(before)
    assert out.with_suffix(".png").read_bytes().startswith(PNG)


@pytest.mark.parametrize("command", ON_TABLES)
def test_lost_rows_are_as_good_as_missing(tmp_path, rng, model, command):
    y = gait("walk", 40, rng)
    lost = [("a", t, *pose_cells(y[t] + 9.0), "walk", "lost") for t in range(20, 25)]
    good = [("a", t, *pose_cells(y[t]), "walk", "ok") for t in range(40) if not 20 <= t < 25]
    said = []
    for rows in (good, [*good, *lost]):
        table, out = tmp_path / "p.csv", tmp_path / f"{len(rows)}.csv"
        write_table(table, rows, (*HEADER, "label", "outcome"))
        said.append(printed(command, table, "--model", model, "--no-plot", "--out", out).splitlines()[:-1])
    assert (tmp_path / "35.csv").read_bytes() == (tmp_path / "40.csv").read_bytes()
    assert said[1] == [*said[0], "5 frames lost or outside, taken as missing"]


def test_interpolate_is_the_same_for_a_seed_and_a_sequence_alone(tmp_path, model, rng):
    y, _ = both(rng, frames=12)
    y[5:19] = np.nan  # somewhere in it, which is drawn, walking becomes running
    for name, sequences in {"one": "a", "two": "ba", "again": "ba"}.items():
        poses = write_poses(tmp_path / f"{name}.csv", *(sequence(y, seq) for seq in sequences))
        printed("interpolate", poses, "--model", model, "--no-plot", "--out", tmp_path / f"{name}.out.csv")
    one, two, again = ((tmp_path / f"{name}.out.csv").read_text() for name in ("one", "two", "again"))
    assert two == again
    assert one.splitlines()[1:] == two.splitlines()[25:]


def test_interpolate_says_what_filled_the_gaps(tmp_path, poses):
    said = printed("interpolate", poses, "--no-plot", "--out", tmp_path / "i.csv")
    assert "; gaps filled by the " in said
    said = printed("interpolate", poses, "--model", "stride", "--no-plot", "--out", tmp_path / "s.csv")
    assert "; gaps filled by the stride 2" in said


@pytest.mark.parametrize("command", ["classify", "predict"])
def test_a_stride_alone_is_refused_where_it_tells_nothing(tmp_path, poses, command):
    said = refused(command, poses, "--model", "stride", "--out", tmp_path / "o.csv")
    assert f"the model is a harmonic stride, which cannot {command}; give one learned with another" in said


def test_synthesise_leaves_a_table_a_picture_and_a_clip(tmp_path, model):
    out = tmp_path / "s.csv"
    said = printed("synthesise", "--model", model, "--frames", 40, "--label", "run", "--out", out)
    rows = read_csv(out)
    assert list(rows[0]) == [*HEADER, "state", "label"]
    assert [(row["seq"], int(row["frame"])) for row in rows] == [("0", t) for t in range(40)]
    assert all(row[name] for row in rows for name in POSE_COLUMNS)
    assert {row["label"] for row in rows} == {"run"}
    assert said.startswith("40 frames of gait.npz at 30 a second: run 100 %")
    assert out.with_suffix(".png").read_bytes().startswith(PNG)
    with av.open(str(out.with_suffix(".mp4"))) as clip:
        stream = clip.streams.video[0]
        assert (stream.codec_context.name, float(stream.average_rate)) == ("h264", 30.0)
        assert sum(1 for _ in clip.decode(stream)) == 40
    assert len(list(tmp_path.iterdir())) == 3


def test_the_clip_of_a_long_synthesis_shows_its_beginning_and_it_is_said(tmp_path, model, monkeypatch):
    monkeypatch.setattr(commands, "ANIMATED", 7)
    out = tmp_path / "s.csv"
    said = printed("synthesise", "--model", model, "--frames", 20, "--out", out, "--no-plot")
    assert said.splitlines()[-1] == f"{out.with_suffix('.mp4')} shows the first 7 of 20 frames"
    with av.open(str(out.with_suffix(".mp4"))) as clip:
        assert sum(1 for _ in clip.decode(video=0)) == 7


@pytest.mark.parametrize("command", [*ON_TABLES, "synthesise"])
def test_results_go_into_the_folder_one_is_in_unless_told(tmp_path, few, model, monkeypatch, command):
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    words, stem, endings = [few], "few", {"csv", "png"}
    if command == "synthesise":
        words, stem, endings = ["--frames", 20], "gait", {"csv", "png", "mp4"}
    printed(command, *words, "--model", model)
    assert {path.name for path in here.iterdir()} == {f"{stem}-{command}.{ending}" for ending in endings}


def test_another_rate_of_the_table_is_another_model(tmp_path, rng, model):
    y = gait("walk", 160, rng)
    slow = write_poses(tmp_path / "poses.csv", sequence(y[::2]))  # 15 frames a second

    def error(*more):
        printed(
            "predict", slow, "--model", model, "--no-plot", "--overwrite", "--out", tmp_path / "p.csv", *more
        )
        (found,) = read_poses(tmp_path / "p.csv")
        return np.abs(found.y[10:80] - y[20::2])[:, 4:].mean()

    assert error("--fps", 15) < 0.7 * error()


@pytest.fixture
def untouched(tmp_path, poses):
    """Whatever happened, the folder is afterwards as it was."""
    before = everything(tmp_path)
    yield
    assert everything(tmp_path) == before


@pytest.mark.usefixtures("untouched")
def test_a_motion_that_runs_away_is_refused(tmp_path, tmp_path_factory):
    model, A = gait_model(), gait_model().A.copy()
    A[:, : model.layout.d] *= 1.5
    path = saved(tmp_path_factory.mktemp("wild") / "m.npz", replace(model, A=A))
    line = refused("synthesise", "--model", path, "--out", tmp_path / "o.csv")
    assert "the model's motion leaves all that a figure can do at frame" in line


@pytest.mark.usefixtures("untouched")
def test_what_the_work_reads_is_never_written_over(tmp_path, poses, model):
    line = refused("classify", poses, "--model", model, "--out", poses, "--overwrite")
    assert f"{poses} is what the work reads" in line
    line = refused("predict", poses, "--model", model, "--out", tmp_path / "o.png")
    assert "table, plot and clip would be one file" in line
    line = refused("classify", poses, "--model", model, "--out", model, "--overwrite")
    assert "gait.npz is what the work reads" in line


def test_an_old_picture_stops_the_work_before_it_begins(tmp_path, poses, model, monkeypatch):
    monkeypatch.setattr("tracker.motion.commands.label_all", None)
    (tmp_path / "o.png").write_text("mine")
    assert "o.png exists" in refused("classify", poses, "--model", model, "--out", tmp_path / "o.csv")
    assert (tmp_path / "o.png").read_text() == "mine"


def test_a_name_with_dollars_is_no_formula(tmp_path, rng, model):
    write_poses(tmp_path / "take$1_$2.csv", sequence(gait("walk", 40, rng), name="x^$y_$"))
    for command in ("classify", "predict"):
        out = tmp_path / f"{command}$.csv"
        succeeds(command, tmp_path / "take$1_$2.csv", "--model", model, "--out", out, "--quiet")


def test_radians_and_another_rate_are_warned_of_and_the_work_is_done(tmp_path, rng, model):
    y = gait("walk", 40, rng)
    rows = [("a", t, *pose, f"{t / 60.0:.6f}") for t, pose in enumerate(y)]
    write_table(tmp_path / "poses.csv", rows, header=(*HEADER, "time_s"))
    result = succeeds("classify", tmp_path / "poses.csv", "--model", model, "--quiet", "--no-plot",
                      "--out", tmp_path / "o.csv")  # fmt: skip
    one, other = result.stderr.splitlines()
    assert one.startswith("warning: every angle of sequence 'a' lies within 3.2 degrees")
    assert other.startswith("warning: time_s of sequence 'a' says 60 frames a second")


def test_learn_hands_on_what_it_is_told(tmp_path, monkeypatch):
    asked = []

    def learn_model(request, out, **_):
        asked.append(request)
        return f"{out}: learned"

    monkeypatch.setattr("tracker.models.learn.learn_model", learn_model)
    printed("learn", tmp_path / "p.csv")
    words = ["--states", 6, "--noise", 2.5, "--settings", tmp_path / "l.toml"]
    printed("learn", tmp_path / "p.csv", "--inference", "gpb2", *words)
    usual, told = asked
    assert (usual.states, usual.noise, usual.order) == (None, NOISE, None)
    assert (usual.inference, usual.settings) == ("viterbi", None)
    assert (told.inference, told.states, told.noise) == ("gpb2", 6, 2.5)
    assert told.settings == tmp_path / "l.toml"


def test_reproduce_hands_on_what_it_is_told(tmp_path, monkeypatch):
    asked = []

    def reproduce(trials, out, **options):
        asked.append((trials, out, options))
        return "claims"

    module = ModuleType("tracker.experiments.reproduce")
    module.reproduce = reproduce
    monkeypatch.setitem(sys.modules, "tracker.experiments.reproduce", module)
    words = ["--trials", tmp_path / "t.csv", "--out", tmp_path / "r", "--seed", 4, "--quick", "--overwrite"]
    assert printed("reproduce", *words) == "claims\n"
    ((trials, out, options),) = asked
    assert (trials, out) == (tmp_path / "t.csv", tmp_path / "r")
    assert options.pop("progress").style == "quiet"
    assert options == {"overwrite": True, "seed": 4, "quick": True}


@pytest.mark.parametrize("command", ON_TABLES)
def test_a_command_shows_how_far_it_is_in_steps(tmp_path, poses, model, command):
    words = ["--no-plot", "--progress", "json", "--out", tmp_path / "p.csv"]
    result = succeeds(command, poses, "--model", model, *words)
    news = [json.loads(line) for line in result.stderr.splitlines()]
    ended = [line for line in news if line["done"] == line["total"]]
    assert len(ended) == (2 if command == "interpolate" else 1)
    assert ended[0]["total"] > 4
