"""From captures to a model's file, and what keeps it from being made."""

from pathlib import Path

import numpy as np
import pytest

from dynamics.store import load
from kinematics.figure_file import load_figure
from kinematics.mocap import POSE_COLUMNS, read_trials, sequences
from tests.tracker.clips import figtrack, read_csv, refused, succeeds, write_table
from tests.tracker.gaits import HEADER, gait, sequence, write_poses
from tests.tracker.models.captures import COLUMNS, FPS, write_trials, write_walk
from tracker.models.learn import Further
from tracker.settings import read_toml
from tracker.tables.poses import pose_cells

MODELS = Path(__file__).parents[3] / "dynamics" / "models"


@pytest.fixture(scope="module")
def trials(tmp_path_factory):
    """A table of two walkers and a runner."""
    folder = tmp_path_factory.mktemp("captures")
    (folder / "quick.toml").write_text("rounds = 2\n")
    table = write_trials(folder, [("s0", "walk", 34.0), ("s1", "walk", 31.0), ("s2", "run", 22.0)])
    table.write_text(table.read_text().replace("free", "credit", 1))
    return table


def learn(trials, out, *more, settings=None):
    quick = settings or trials.with_name("quick.toml")
    return ["learn", "--trials", trials, "--states", 2, "--settings", quick, "--out", out, *more]


def settings(folder, text):
    (folder / "learn.toml").write_text(text)
    return folder / "learn.toml"


def test_a_model_is_learned_for_every_label_and_saved(trials, tmp_path):
    result = succeeds(*learn(trials, tmp_path / "new" / "m.npz", "--quiet"))
    assert result.stderr == ""
    slds = load(tmp_path / "new" / "m.npz")
    assert (slds.K, slds.order, slds.fps, slds.names) == (4, 2, FPS, POSE_COLUMNS)
    assert sorted(slds.labels) == ["run", "run", "walk", "walk"]
    assert "4 states, order 2, 30 frames a second, from 3 sequences of subjects s0, s1, s2" in result.stdout
    assert "terms: credit; free" in result.stdout
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["m.npz"]


def test_another_motion_is_learned_by_its_label_though_it_travels_nowhere(trials, tmp_path):
    write_walk(tmp_path / "s.bvh", 34.0, 3, size=0.0)
    captures = [line for line in trials.read_text().splitlines()[1:] if ",walk," in line]
    rows = [COLUMNS, *(f"{trials.parent}/{row}" for row in captures), f"s.bvh,s3,t,stand,{FPS},0-40,,free"]
    table = tmp_path / "trials.csv"
    table.write_text("\n".join(rows) + "\n")
    motions = ["--label", "walk", "--label", "stand", "--quiet"]
    succeeds(*learn(table, tmp_path / "m.npz", *motions, settings=trials.with_name("quick.toml")))

    walked, stood = (sequences(trial, FPS)[0].y for trial in (read_trials(table)[0], read_trials(table)[-1]))
    poses = write_poses(tmp_path / "poses.csv", sequence(np.concatenate([walked, stood]), "a"))
    succeeds("classify", poses, "--model", tmp_path / "m.npz", "--no-plot", "--out", tmp_path / "l.csv")
    found = read_csv(tmp_path / "l.csv")
    assert {"p_walk", "p_stand"} <= set(found[0])
    first = [row["label"] for row in found].index("stand")
    assert abs(first - len(walked)) <= 5
    assert {row["label"] for row in found[first:]} == {"stand"}


def test_labels_subjects_and_licences_choose_the_captures(trials, tmp_path):
    chosen = ["--label", "walk", "--label", "\xa0walk", "--exclude-subjects", "s1, s9"]
    more = [*chosen, "--order", 1, "--fps", 25]
    file = settings(tmp_path, 'licences = ["CREDIT", "none"]\nrounds = 1\n')
    result = succeeds(*learn(trials, tmp_path / "m.npz", *more, settings=file))
    assert "--exclude-subjects: no subject is called s9; there are s0, s1" in result.stderr
    assert (
        "2 states, order 1, 25 frames a second, from 1 sequence of subjects s0; terms: credit"
        in result.stdout
    )


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("rounds = 0", "rounds: input should be greater than or equal to 1, got 0"),
        ("rounds = 1.5", "rounds: input should be a valid integer"),
        ("pooled = 7", "pooled: input should be a valid boolean"),
        ('licences = "CMU"', "licences: input should be a valid array, got 'CMU'"),
        ("round = 2", "round: no such setting"),
    ],
)
def test_settings_of_learning_that_cannot_be_are_refused_with_their_key(trials, tmp_path, text, words):
    assert words in refused(*learn(trials, tmp_path / "m.npz", settings=settings(tmp_path, text)))


def test_settings_of_learning_are_heeded(trials, tmp_path, monkeypatch):
    asked = {}

    def learn_motions(_, **told):
        asked.update(told)
        raise ValueError("that is all")

    monkeypatch.setattr("tracker.models.learn.learn_motions", learn_motions)
    text = "pooled = true\nrounds = 3\n"
    assert "that is all" in refused(*learn(trials, tmp_path / "m.npz", settings=settings(tmp_path, text)))
    assert (asked["pooled"], asked["options"].rounds) == (True, 3)


def test_a_stride_is_learned_for_every_label_and_saved(trials, tmp_path):
    quick = trials.with_name("quick.toml")
    asked = ["learn", "--trials", trials, "--inference", "stride", "--settings", quick]
    result = succeeds(*asked, "--out", tmp_path / "s.npz", "--quiet")
    stride = load(tmp_path / "s.npz")
    assert (sorted(stride.labels), stride.names, stride.fps) == (["run", "walk"], POSE_COLUMNS, FPS)
    assert "2 harmonic strides, 30 frames a second, from 3 sequences of subjects s0, s1, s2" in result.stdout


@pytest.mark.parametrize(
    ("more", "text", "name"),
    [
        (["--states", 2], "", "--states"),
        (["--order", 2], "", "--order"),
        (["--scheduler", "tcp://127.0.0.1:1"], "", "--scheduler"),
        ([], "pooled = true", "pooled"),
        ([], 'slower = ["run"]', "slower"),
        ([], 'started = ["run"]', "started"),
    ],
)
def test_options_that_a_stride_has_not_are_refused(trials, tmp_path, more, text, name):
    file = settings(tmp_path, text)
    asked = ["learn", "--trials", trials, "--inference", "stride", "--settings", file, *more]
    said = refused(*asked, "--out", tmp_path / "s.npz")
    assert f"a stride has no switching states, so {name} does not apply; leave it out" in said


def test_a_hidden_markov_model_has_no_order(trials, tmp_path):
    asked = ["learn", "--trials", trials, "--inference", "hmm", "--order", 2]
    assert "have no order; leave it out" in refused(*asked, "--out", tmp_path / "h.npz")


@pytest.mark.parametrize("name", ["learn", "pooled", "gait", "gait-started"])
def test_the_models_that_ship_are_learned_with_settings_that_can_be_read(name):
    started = {"slower": ("run",), "started": ("walk", "run")}
    copies = {"gait": {"slower": ("run",)}, "gait-started": started}
    wanted = Further(licences=("CMU", "Seoul National"), pooled=name == "pooled", **copies.get(name, {}))
    assert read_toml(MODELS / f"{name}.toml", Further, "") == wanted


def test_a_place_that_cannot_be_written_is_refused_before_the_work(trials, tmp_path, monkeypatch):
    def never(*_, **__):
        raise AssertionError("the work began")

    monkeypatch.setattr("tracker.models.learn.learn_motions", never)
    (tmp_path / "file").write_text("")
    assert "cannot write into" in refused(*learn(trials, tmp_path / "file" / "m.npz"))
    assert "is a folder; --out wants a file" in refused(*learn(trials, tmp_path))


def test_of_pose_tables_files_are_subjects_who_can_be_left_out_and_another_rate_is_said(tmp_path):
    y = gait("walk", 60, np.random.default_rng(0))
    rows = [("s", t, *pose_cells(pose), f"{t / 50.0:.6f}") for t, pose in enumerate(y)]
    for name in "ab":
        write_table(tmp_path / f"{name}.csv", rows, (*HEADER, "time_s"))
    words = [tmp_path / "a.csv", tmp_path / "b.csv", "--states", 1, "--out", tmp_path / "m.npz"]
    result = succeeds("learn", *words, "--exclude-subjects", "b")
    assert "of subjects a;" in result.stdout
    assert "a.csv: time_s of sequence" in result.stderr


@pytest.mark.parametrize(
    ("figure", "text", "words"),
    [
        ("horse", 'started = ["motion"]', "the stand of a person, not of the figure horse; leave it out"),
        ("walker", 'slower = ["Run"]', "slower names 'Run', which is not learned; name some of motion"),
        ("walker", 'started = ["motion", "joging"]', "started names 'joging', which is not learned"),
        ("walker", 'licences = ["free"]', "pose tables have no licences to choose by; leave licences out"),
    ],
)
def test_settings_that_do_not_fit_pose_tables_are_refused(tmp_path, figure, text, words):
    columns = ("frame", *load_figure(figure).learned_freedoms)
    write_table(tmp_path / "a.csv", [(t, *[0.0] * len(columns[1:])) for t in range(9)], columns)
    asked = ["learn", tmp_path / "a.csv", "--figure", figure, "--settings", settings(tmp_path, text)]
    assert words in refused(*asked, "--out", tmp_path / "m.npz")


def test_pose_tables_of_one_name_in_two_folders_are_two_subjects(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    y = gait("walk", 60, np.random.default_rng(0))
    rows = [("s", t, *pose_cells(pose)) for t, pose in enumerate(y)]
    for name in ("anna-track", "ben-track"):
        Path(name).mkdir()
        write_table(Path(name) / "pose.csv", rows, HEADER)
    words = ["learn", "anna-track/pose.csv", "ben-track/pose.csv", "--states", 1]
    assert "of subjects anna-track/pose, ben-track/pose;" in figtrack(*words, "--out", "both.npz").stdout
    all_of_them = figtrack(*words, "--exclude-subjects", "pose", "--out", "all.npz")
    assert "no subject is called pose; there are anna-track/pose, ben-track/pose" in all_of_them.stderr
    nobody = refused(*words, "--exclude-subjects", "anna-track/pose,ben-track/pose", "--out", "none.npz")
    assert "--exclude-subjects leaves none of anna-track/pose, ben-track/pose" in nobody
    one = figtrack(*words, "--exclude-subjects", "ben-track/pose", "--out", "one.npz")
    assert "from 1 sequence of subjects anna-track/pose;" in one.stdout
