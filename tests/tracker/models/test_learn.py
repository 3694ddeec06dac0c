"""From captures to a model's file, and what keeps it from being made."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from dynamics.learning.options import Options
from dynamics.store import load
from kinematics.figure_file import load_figure
from kinematics.mocap import POSE_COLUMNS, read_trials, sequences
from tests.tracker.clips import figtrack, read_csv, refused, write_table
from tests.tracker.gaits import HEADER, gait, sequence, write_poses
from tracker.models import by_motion
from tracker.models.learn import Further
from tracker.settings import read_toml
from tracker.tables.poses import pose_cells

MODELS = Path(__file__).parents[3] / "dynamics" / "models"
COLUMNS = "file,subject,trial,activity,fps,segments,tags,licence"
JOINTS = ("RightUpLeg", "RightLeg", "RightFoot", "RightToeBase", "LeftUpLeg", "LeftLeg", "LeftFoot")
JOINTS += ("LeftToeBase", "Neck", "Head")
T, FPS = 60, 30.0


def write_walk(path, stride, seed, size=1.0):
    """A capture of a stick figure that walks along z, each joint placed by its own position channels.

    With a size of 0 it stands, and the angles vary by noise alone.
    """
    rng = np.random.default_rng(seed)
    phase = 2.0 * np.pi * np.arange(T) / stride
    hips = np.stack(
        [0.0 * phase, 2.0 + 0.03 * size * np.cos(2.0 * phase), 1.2 * size * phase / np.pi], axis=1
    )

    def hang(angle):
        return np.stack([0.0 * angle, -np.cos(angle), np.sin(angle)], axis=1)

    joints = []
    for side, turn in ((-0.2, 0.0), (0.2, np.pi)):
        thigh = 0.4 * size * np.sin(phase + turn) + 0.01 * rng.normal(size=T)
        shank = thigh - 0.4 * size * (1.0 + np.cos(phase + turn)) + 0.01 * rng.normal(size=T)
        at = [hips + np.array([side, 0.0, 0.0])]
        at += [at[0] + hang(thigh), at[0] + hang(thigh) + hang(shank)]
        joints += [*at, at[2] + np.array([0.0, -0.05, 0.3])]
    joints += [hips + np.array(above) for above in ([0.0, 1.0, 0.05], [0.0, 1.5, 0.08])]
    parts = [f"ROOT {n}\n{{\nOFFSET 0 0 0\nCHANNELS 3 Xposition Yposition Zposition\n" for n in JOINTS]
    hierarchy = "}\n".join(parts) + "End Site\n{\nOFFSET 0 0 0\n}\n}\n"
    rows = "\n".join(" ".join(f"{v:.6f}" for v in frame.ravel()) for frame in np.stack(joints, axis=1))
    head = f"MOTION\nFrames: {T}\nFrame Time: {1.0 / FPS}\n"
    path.write_text(f"HIERARCHY\n{hierarchy}{head}{rows}\n")


@pytest.fixture(scope="module")
def trials(tmp_path_factory):
    """A table of two walkers and a runner."""
    folder = tmp_path_factory.mktemp("captures")
    rows = [COLUMNS]
    for i, (activity, stride) in enumerate([("walk", 34.0), ("walk", 31.0), ("run", 22.0)]):
        write_walk(folder / f"c{i}.bvh", stride, i)
        rows.append(f"c{i}.bvh,s{i},t,{activity},{FPS},0-{T},,{'free' if i else 'credit'}")
    (folder / "trials.csv").write_text("\n".join(rows) + "\n")
    (folder / "quick.toml").write_text("rounds = 2\n")
    return folder / "trials.csv"


def learn(trials, out, *more, settings=None):
    quick = settings or trials.with_name("quick.toml")
    return ["learn", "--trials", trials, "--states", 2, "--settings", quick, "--out", out, *more]


def settings(folder, text):
    (folder / "learn.toml").write_text(text)
    return folder / "learn.toml"


def test_a_model_is_learned_for_every_label_and_saved(trials, tmp_path):
    result = figtrack(*learn(trials, tmp_path / "new" / "m.npz", "--quiet"))
    assert result.exit_code == 0, result.output
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
    result = figtrack(*learn(table, tmp_path / "m.npz", *motions, settings=trials.with_name("quick.toml")))
    assert result.exit_code == 0, result.output

    walked, stood = (sequences(trial, FPS)[0].y for trial in (read_trials(table)[0], read_trials(table)[-1]))
    poses = write_poses(tmp_path / "poses.csv", sequence(np.concatenate([walked, stood]), "a"))
    result = figtrack(
        "classify", poses, "--model", tmp_path / "m.npz", "--no-plot", "--out", tmp_path / "l.csv"
    )
    assert result.exit_code == 0, result.output
    found = read_csv(tmp_path / "l.csv")
    assert {"p_walk", "p_stand"} <= set(found[0])
    first = [row["label"] for row in found].index("stand")
    assert abs(first - len(walked)) <= 5
    assert {row["label"] for row in found[first:]} == {"stand"}


def test_labels_subjects_and_licences_choose_the_captures(trials, tmp_path):
    more = [
        "--label",
        "walk",
        "--label",
        "\xa0walk",
        "--exclude-subjects",
        "s1, s9",
        "--order",
        1,
        "--fps",
        25,
    ]
    file = settings(tmp_path, 'licences = ["CREDIT", "none"]\nrounds = 1\n')
    result = figtrack(*learn(trials, tmp_path / "m.npz", *more, settings=file))
    assert result.exit_code == 0, result.output
    assert "--exclude-subjects: no subject is called s9; there are s0, s1" in result.stderr
    assert (
        "2 states, order 1, 25 frames a second, from 1 sequence of subjects s0; terms: credit"
        in result.stdout
    )


def test_pooled_motions_make_one_model(trials, tmp_path):
    file = settings(tmp_path, "pooled = true\nrounds = 2\n")
    assert figtrack(*learn(trials, tmp_path / "m.npz", "--noise", 2, settings=file)).exit_code == 0
    assert set(load(tmp_path / "m.npz").labels) == {"walk-run"}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("rounds = 0", "rounds: input should be greater than or equal to 1, got 0"),
        ("restarts = 1000", "restarts: input should be less than or equal to 100, got 1000"),
        ("restarts = 1.5", "restarts: input should be a valid integer"),
        ('choose = "often"', "choose: input should be a valid boolean"),
        ("pooled = 7", "pooled: input should be a valid boolean"),
        ('licences = "CMU"', "licences: input should be a valid tuple, got 'CMU'"),
        ("round = 2", "round: no such setting"),
        ("rounds: 2", "learn.toml is no TOML file"),
        (None, "no settings file"),
    ],
)
def test_settings_of_learning_that_cannot_be_are_refused_with_their_key(trials, tmp_path, text, words):
    file = tmp_path / "absent.toml" if text is None else settings(tmp_path, text)
    assert words in refused(*learn(trials, tmp_path / "m.npz", settings=file))


def test_settings_of_learning_are_heeded(trials, tmp_path, monkeypatch):
    asked = {}

    def learn_motions(_, **told):
        asked.update(told)
        raise ValueError("that is all")

    monkeypatch.setattr("tracker.models.learn.learn_motions", learn_motions)
    text = "choose = true\npooled = true\nrounds = 3\nrestarts = 4\n"
    assert "that is all" in refused(*learn(trials, tmp_path / "m.npz", settings=settings(tmp_path, text)))
    assert (asked["choose_from"], asked["pooled"]) == ([1, 2], True)
    options = asked["options"]
    assert (options.rounds, options.restarts) == (3, 4)


def test_a_stride_is_learned_for_every_label_and_saved(trials, tmp_path):
    quick = trials.with_name("quick.toml")
    asked = ["learn", "--trials", trials, "--inference", "stride", "--settings", quick]
    result = figtrack(*asked, "--out", tmp_path / "s.npz", "--quiet")
    assert result.exit_code == 0, result.output
    stride = load(tmp_path / "s.npz")
    assert (sorted(stride.labels), stride.names, stride.fps) == (["run", "walk"], POSE_COLUMNS, FPS)
    assert "2 harmonic strides, 30 frames a second, from 3 sequences of subjects s0, s1, s2" in result.stdout


@pytest.mark.parametrize(
    ("more", "text", "name"),
    [
        (["--states", 2], "", "--states"),
        (["--order", 2], "", "--order"),
        (["--scheduler", "tcp://127.0.0.1:1"], "", "--scheduler"),
        ([], "choose = true", "choose"),
        ([], "pooled = true", "pooled"),
        ([], 'slower = ["run"]', "slower"),
        ([], 'started = ["run"]', "started"),
        ([], "restarts = 2", "restarts"),
    ],
)
def test_options_that_a_stride_has_not_are_refused(trials, tmp_path, more, text, name):
    file = settings(tmp_path, text)
    asked = ["learn", "--trials", trials, "--inference", "stride", "--settings", file, *more]
    said = refused(*asked, "--out", tmp_path / "s.npz")
    assert f"a stride has no switching states, so {name} does not apply; leave it out" in said


@pytest.mark.parametrize(("more", "text"), [(["--order", 2], ""), ([], "restarts = 2")])
def test_options_that_a_hidden_markov_model_has_not_are_refused(trials, tmp_path, more, text):
    asked = ["learn", "--trials", trials, "--inference", "hmm", "--settings", settings(tmp_path, text), *more]
    assert "have neither order nor restarts; leave them out" in refused(*asked, "--out", tmp_path / "h.npz")


def test_the_chosen_number_of_states_is_learned_as_often_as_asked(monkeypatch):
    monkeypatch.setattr(by_motion, "choose", lambda *args, **told: (args[2][1], None))
    motion = SimpleNamespace(poses=[], subjects=[], names=())
    chosen = by_motion._chosen(motion, 30.0, Options(states=4, restarts=7), [1, 2], by_motion.ESteps())
    assert (chosen.states, chosen.restarts) == (2, 7)


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
    result = figtrack("learn", *words, "--exclude-subjects", "b")
    assert result.exit_code == 0, result.output
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
