"""The commands: what they leave, what they say, and how they fail."""

import statistics
import time

import pytest

from tests.tracker.clips import RUN_FILES, figtrack, read_json, succeeds
from tests.tracker.processes import ended, printed_by
from tracker import __version__
from tracker.cli.app import COMMANDS

pytestmark = pytest.mark.whole

OF_FOLLOWING = ("numba", "scipy", "matplotlib", "tracker.clip.asked", "tracker.outline")
OF_FILMS = (
    "scipy.linalg",
    "tracker.outline",
    "tracker.survey",
    "tracker.annotate.session",
    "tracker.experiments",
)
HEAVY = ("scipy.optimize", "scipy.spatial", "scipy.special", "scipy.stats", "matplotlib")


@pytest.fixture
def track(clip, tmp_path):
    """The words of a track command, its --out tmp_path/out."""
    return ["track", clip.video, "--keypoints", clip.keypoints, "--model", "cv", "--out", tmp_path / "out"]


@pytest.fixture(scope="module")
def done(clip, tmp_path_factory):
    """A finished run with most options, its folder and what was printed."""
    out = tmp_path_factory.mktemp("done") / "out"
    result = succeeds(
        "track", clip.video, "--keypoints", clip.keypoints, "--model", "cv", "--out", out,
        "--start", 3, "--stop", 7, "--facing", "right", "--rate", 0.5, "--quiet",
    )  # fmt: skip
    return out, result


@pytest.mark.parametrize(
    ("more", "left_out"),
    [
        (["--no-overlay"], {"overlay.mp4"}),
        (["--no-report"], {"report.html"}),
        (["--no-overlay", "--no-report"], {"overlay.mp4", "report.html"}),
    ],
)
def test_what_is_not_wanted_is_not_written(track, tmp_path, more, left_out):
    result = succeeds(*track, "--stop", 3, *more)
    assert {path.name for path in (tmp_path / "out").iterdir()} == RUN_FILES - left_out
    assert ("report.html" in result.stdout) is ("report.html" not in left_out)
    if left_out == {"overlay.mp4"}:  # the report has its film all the same
        assert "<video" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


def test_run_json_says_what_was_done(clip, done):
    news = read_json(done[0] / "run.json")
    assert {"figtrack", "video", "model", "settings", "fps", "frames", "rate", "facing"} <= news.keys()
    assert {"seconds_per_frame", "warnings"} <= news.keys()
    assert (news["figtrack"], news["video"], news["model"]) == (__version__, str(clip.video), "cv")
    assert (news["rate"], news["facing"], news["fps"], news["frames"]) == (0.5, "right", 30.0, 8)
    assert news["seconds_per_frame"].keys() == {"survey", "read", "track", "smooth", "write"}
    assert news["smooth"] is True
    assert news["warnings"] == []
    assert news["settings"]["mode"] == "full"


def test_a_quiet_run_is_silent_on_stderr_and_short_on_stdout(done):
    _, result = done
    assert result.stderr == ""
    first, second = result.stdout.splitlines()
    assert first.startswith("8 frames of walk.mp4 with cv: ")
    assert second.startswith("see ")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("trak", "No such command 'trak'. Did you mean 'track'?"),
        ("track", "Missing argument 'video'"),
        ("track walk.mp4 --keypoints k.csv --start -1", "'--start': Input should be greater than or"),
        ("track walk.mp4 --keypoints k.csv --start first", "'--start': Input should be a valid integer"),
        ("track walk.mp4 --keypoints k.csv --facing north", "'north' is not one of 'left', 'right'"),
        ("track walk.mp4 --keypoints k.csv --progress loud", "'loud' is not one of 'auto', 'plain', 'json'"),
        ("track walk.mp4 --keypoints k.csv --colour", "No such option: --colour"),
        ("track walk.mp4 --height 1.7 --scale 80", "give either height or scale, not both"),
        ("track walk.mp4 --from 9 --stop 2", "from 9 comes after stop 2; choose a later stop"),
        ("track walk.mp4 --start 2", "start and anchors are of marked frames; give keypoints"),
        ("track walk.mp4 --anchors", "start and anchors are of marked frames; give keypoints"),
        ("compare walk.mp4", "give marks to compare with: --keypoints or --truth"),
        ("learn", "give either --trials TABLE or pose tables"),
        ("learn poses.csv --trials t.csv", "one of the two"),
        ("learn --trials t.csv --order 3", "'--order': Input should be less than or equal to 2"),
        ("export run --to bvh", "'bvh' is not one of"),
        ("export run --to trc --scale-points 1,2,3,4,five", "--scale-points wants five numbers"),
        ("export run --to trc --scale-points 1,2,3,4,5 --height 1.7", "either --height or --scale-points"),
        ("", "To begin with:"),
    ],
)
def test_wrong_usage_ends_with_status_two_and_is_named(words, said):
    result = figtrack(*words.split())
    assert result.exit_code == 2
    assert said in result.stderr


@pytest.mark.parametrize("words", [["--help"], ["track", "-h"], ["compare", "--help"], ["--version"]])
def test_help_and_version_end_with_status_zero(words):
    result = succeeds(*words)
    assert result.stderr == ""


def test_what_a_command_does_is_told_in_full_where_they_are_listed():
    _, said, _ = ended("--help", environment={"COLUMNS": "80"})
    _, listed = said.split("To begin with:")
    assert sum(line.startswith("  ") for line in listed.splitlines()) == len(COMMANDS)
    assert "..." not in listed


def test_it_also_runs_as_a_module():
    assert ended("--version") == (0, f"figtrack {__version__}\n", "")


@pytest.mark.parametrize("module", ["annotate.launch", "desk.desk_page"])
def test_the_servers_of_pages_import_nothing_that_following_needs(module):
    code = f"import sys, tracker.{module}; print([name for name in {OF_FOLLOWING} if name in sys.modules])"
    assert printed_by(code) == ["[]"]


# Where the film would be read the command ends: until then marks are all that is needed.
@pytest.mark.parametrize(
    ("before", "names"),
    [("videos.frames.Video.__init__ = lambda *_: sys.exit()", (*HEAVY, *OF_FILMS)), ("", HEAVY)],
)
def test_following_imports_nothing_that_is_slow_and_large_or_too_early(clip, tmp_path, before, names):
    code = f"""
import sys, videos.frames
from tracker.cli.app import main
{before}
sys.argv = ["figtrack", "track", {str(clip.video)!r}, "--keypoints", {str(clip.keypoints)!r}, "--out", "out"]
try:
    main()
finally:
    print([name for name in {names} if name in sys.modules])"""
    assert printed_by(code, tmp_path)[-1] == "[]"


@pytest.mark.parametrize(("given", "taken"), [({}, "1"), ({"OPENBLAS_NUM_THREADS": "3"}, "3")])
def test_matrices_are_multiplied_in_one_thread_unless_told_otherwise(monkeypatch, given, taken):
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    for name, value in given.items():
        monkeypatch.setenv(name, value)
    code = """
import os, sys, types
app = types.ModuleType("app")
app.main = lambda: print("numpy" in sys.modules, os.environ["OPENBLAS_NUM_THREADS"])
sys.modules["tracker.cli.app"] = app
from tracker.__main__ import main
main()"""
    assert printed_by(code) == [f"False {taken}"]


def test_at_its_end_it_does_not_look_for_cycles_in_all_that_was_loaded():
    code = """
import atexit, gc, sys, types
atexit.register(lambda: print(gc.get_freeze_count() > 1000))
app = types.ModuleType("app")
app.main = lambda: print(gc.get_freeze_count())
sys.modules["tracker.cli.app"] = app
from tracker.__main__ import main
main()"""
    assert printed_by(code) == ["0", "True"]


@pytest.mark.speed
def test_help_answers_at_once():
    def seconds():
        began = time.perf_counter()
        ended("--help")
        return time.perf_counter() - began

    assert statistics.median(seconds() for _ in range(5)) < 0.5


def test_the_shell_completes_commands_and_options():
    def completed(*words):
        asked = {"_FIGTRACK_COMPLETE": "complete_bash", "COMP_CWORD": str(len(words))}
        return ended(environment=asked | {"COMP_WORDS": " ".join(["figtrack", *words])})[1].split()

    assert completed("tra") == ["track"]
    assert completed("track", "walk.mp4", "--keyp") == ["--keypoints"]
    assert completed("track", "walk.mp4", "--facing", "r") == ["right"]
    assert completed("track", "walk.mp4", "--model", "c") == ["cv"]
    assert completed("classify", "poses.csv", "--model", "walk-") == ["walk-run", "walk-run-1"]
