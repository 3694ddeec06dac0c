"""What happens to a process from outside: a full disk, another run, a signal, a terminal of another kind."""

import json
import os
import signal
import time
from functools import partial

import pytest

from tests.spoiled.said import check_line
from tests.spoiled.stock import FRAMES, words
from tests.tracker.clips import everything, read_json, write_video
from tests.tracker.processes import ended, ran, started
from videos.frames import Video

pytestmark = pytest.mark.whole

resource = pytest.importorskip("resource", reason="limits and signals are another thing there")
FULL = "error: no room to write (File too large); make some, or choose another --out\n"
LOUD = [word for word in words("track") if word != "--quiet"]
LONG = ["long.mp4" if word == "walk.mp4" else word for word in LOUD]


@pytest.fixture
def long_film(folder):
    """A film of the clip again and again, in the folder one is in."""
    write_video(folder / "long.mp4", [frame.image for frame in Video(folder / "walk.mp4")] * 20)


def begun(*line, **how):
    """The process of a command that has told of its first step."""
    process = started(*line, "--progress", "json", **how)
    assert json.loads(process.stderr.readline())["done"] == 0
    return process


def without_room(room):
    """No file may grow beyond so many bytes, as on a disk that is full."""
    return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (room, room))


# Room for a table but not for the clip, for a part of a file, for nothing.
@pytest.mark.parametrize(
    ("command", "room"), [("track", 3_000), ("compare", 20_000), ("classify", 1_000), ("openpose", 0)]
)
def test_on_a_full_disk_nothing_is_left_and_what_was_there_stays(folder, command, room):
    before, unkept = everything(folder), {"PYTHONDONTWRITEBYTECODE": "1"}  # Python would keep half a module
    assert ended(*words(command), before=without_room(room), environment=unkept) == (1, "", FULL)
    assert everything(folder) == before
    assert not list(folder.rglob("*.part"))


@pytest.mark.parametrize("command", ["settings --out new.toml", "settings"])  # little and much to print
def test_what_is_printed_onto_a_full_disk_is_missed_in_one_line(folder, command):
    with open("/dev/full", "w") as full:
        status, _, errors = ended(*command.split(), stdout=full)
    assert (status, errors) == (1, FULL.replace("File too large", "No space left on device"))


@pytest.mark.parametrize(
    ("style", "stream"), [("plain", "stdin"), ("plain", "stdout"), ("plain", "stderr"), ("json", "stderr")]
)
def test_a_stream_that_is_closed_is_no_reason_to_fail(folder, stream, style):
    number = ["stdin", "stdout", "stderr"].index(stream)
    status, out, errors = ended(*LOUD, "--progress", style, before=lambda: os.close(number))
    assert status == 0, errors
    assert "Traceback" not in errors
    assert read_json(folder / "run" / "run.json")["frames"] == FRAMES
    assert ("4 frames of" in out) == (stream != "stdout")


@pytest.mark.parametrize("stream", [1, 2])
def test_a_refusal_is_one_whatever_stream_is_closed(folder, stream):
    status, out, errors = ended("track", "gone.mp4", before=lambda: os.close(stream))
    assert (status, out) == (1, "")
    assert errors == "" if stream == 2 else errors.startswith("error: no video at gone.mp4")


def test_progress_that_cannot_be_written_costs_no_results(folder):
    with open("/dev/full", "w") as full:
        status, out, _ = ended(*LOUD, stderr=full)
    assert status == 0
    assert "4 frames of" in out
    assert read_json(folder / "run" / "run.json")["frames"] == FRAMES


@pytest.mark.parametrize("number", [signal.SIGHUP, signal.SIGTERM, signal.SIGINT])
def test_what_is_told_to_end_leaves_the_old_run_and_nothing_else(folder, long_film, number):
    before = everything(folder)
    process = begun(*LONG)
    process.send_signal(number)
    errors = process.communicate(timeout=120)[1]
    assert process.returncode == 1
    assert errors.splitlines()[-1] == "error: interrupted; nothing was written"
    assert everything(folder) == before
    assert not list(folder.rglob(".*.part"))


@pytest.mark.parametrize("at", ["signal.raise_signal(signal.SIGINT)", "type('Made', (), {'one': Named()})"])
def test_ctrl_c_while_the_command_is_still_being_read_is_told_in_a_line(at):
    code = f"""
import signal, sys
import tracker.__main__ as figtrack

class Named:
    def __set_name__(self, owner, name):
        signal.raise_signal(signal.SIGINT)

class Interrupted:
    def find_spec(self, name, *_):
        if name == "tracker.cli.app":
            {at}

sys.meta_path.insert(0, Interrupted())
figtrack.main()"""
    assert ran(code) == (1, "", "error: interrupted; nothing was written\n")


ANSWERED_BACK = {
    "a finalizer": """
import weakref

class Work:
    pass

def work():
    done = Work()
    weakref.finalize(done, signal.raise_signal, signal.SIGTERM)
    del done""",
    "the compiler": """
import llvmlite.binding, numba
from llvmlite.binding.executionengine import ExecutionEngine

find = ExecutionEngine._find_module_ptr

def interrupted(self, module):
    signal.raise_signal(signal.SIGTERM)
    return find(self, module)

ExecutionEngine._find_module_ptr = interrupted

@numba.njit
def one():
    return 1

def work():
    one()""",
}


@pytest.mark.parametrize("place", ANSWERED_BACK)
def test_an_interrupt_where_nothing_can_be_raised_comes_once_more(place):
    code = f"""
import signal, sys, time, types
import tracker.__main__ as figtrack
{ANSWERED_BACK[place]}

def command():
    work()
    time.sleep(60)

sys.modules["tracker.cli.app"] = types.SimpleNamespace(main=command)
figtrack.main()"""
    assert ran(code, timeout=50) == (1, "", "error: interrupted; nothing was written\n")


def test_an_interrupt_does_not_come_once_more_to_a_command_that_has_ended():
    code = """
import signal, time
import tracker.__main__ as figtrack
signal.signal(signal.SIGTERM, figtrack.Interrupt())
figtrack._once_more(signal.SIGTERM)
signal.signal(signal.SIGTERM, signal.SIG_DFL)
time.sleep(10 * figtrack.LATER)
print("alive")"""
    assert ran(code) == (0, "alive\n", "")


def test_ctrl_c_again_and_again_stops_a_batch_in_the_same_line(folder, long_film):
    table = "video,keypoints,model,out\nwalk.mp4,marks.csv,cv,a\nlong.mp4,marks.csv,cv,b\n"
    (folder / "jobs.csv").write_text(table)
    process = begun("batch", "jobs.csv", "--workers", "1")
    while json.loads(process.stderr.readline())["done"] == 0:
        pass
    for _ in range(3):
        process.send_signal(signal.SIGINT)
        time.sleep(0.1)
    errors = process.communicate(timeout=120)[1]
    said = "error: interrupted; what is done stays, and the same batch again goes on there"
    assert errors.splitlines()[-1] == said
    assert "Traceback" not in errors
    assert process.returncode in (1, -signal.SIGINT)
    assert (folder / "a" / "run.json").is_file()
    assert not list(folder.rglob(".*.part"))


def test_what_nohup_begins_outlives_its_terminal(folder):
    ignored = partial(signal.signal, signal.SIGHUP, signal.SIG_IGN)
    ignoring = begun(*LOUD, "--no-overlay", before=ignored)
    ignoring.send_signal(signal.SIGHUP)
    ignoring.communicate(timeout=120)
    assert ignoring.returncode == 0


def test_a_reader_that_hangs_up_is_no_error_to_speak_of(folder):
    process = started("settings")
    process.stdout.close()
    with process.stderr as errors:
        assert errors.read() == ""
    assert process.wait(120) == 1


def test_what_is_killed_outright_leaves_the_old_run_and_the_next_run_is_not_in_its_way(folder, long_film):
    before = everything(folder / "run")
    process = begun(*LONG)
    time.sleep(0.3)
    process.send_signal(signal.SIGKILL)
    process.communicate(timeout=120)
    assert process.returncode == -signal.SIGKILL
    assert everything(folder / "run") == before
    assert ended(*words("track"))[0] == 0
    assert everything(folder / "run") != before


def test_a_terminal_without_the_letters_of_a_name_is_no_reason_to_fail(folder):
    ascii_only = {"PYTHONIOENCODING": "ascii"}
    os.rename("walk.mp4", "走る ä.mp4")
    os.rename("marks.csv", "ключ.csv")
    line = ("track", "走る ä.mp4", "--keypoints", "ключ.csv", "--model", "m.npz", "--out", "été")
    status, out, errors = ended(*line, environment=ascii_only)
    assert status == 0, errors
    assert "4 frames of " in out
    assert (folder / "été" / "run.json").is_file()
    (folder / "走る ä.mp4").write_bytes(b"")
    status, _, errors = ended(*line, "--overwrite", environment=ascii_only)
    assert status == 1
    assert "is empty (0 bytes)" in errors
    check_line(errors)


def test_what_moves_a_terminals_cursor_in_a_name_is_written_out(folder):
    name = "w\x1b[2Jalk.mp4"
    os.rename("walk.mp4", name)
    line = ("track", name, "--keypoints", "marks.csv", "--model", "m.npz", "--out", "new")
    status, out, errors = ended(*line)
    assert status == 0
    assert "\x1b" not in out + errors
    assert "4 frames of w\\x1b[2Jalk.mp4" in out


def test_a_name_that_is_no_text_at_all_is_followed_too(folder):
    name = os.fsdecode(b"w\xffalk.mp4")
    try:
        os.rename("walk.mp4", name)
    except OSError:
        pytest.skip("names on this disk are always text")
    line = (name, "--keypoints", "marks.csv", "--model", "m.npz", "--quiet", "--out", "new")
    assert ended("track", *line)[::2] == (0, "")
    assert read_json(folder / "new" / "run.json")["video"] == name
