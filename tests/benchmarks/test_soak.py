"""What soaking finds: commands that end otherwise than they are meant to, and nothing else."""

import resource
import signal
import sys
from functools import cache

import numpy as np
import pytest

from tests.benchmarks.soak import ending, films
from tests.benchmarks.soak.ending import Kill, faults, run
from tests.benchmarks.soak.films import damaged, shot, write_film, write_marks
from tests.tracker.clips import everything
from tracker.tables.keypoints import read_keypoints
from videos.container import VideoError
from videos.frames import Video

pytestmark = pytest.mark.whole


@pytest.fixture
def wrong(tmp_path):
    """What is wrong with the end of a few lines of Python that stand in for the program."""
    folder = tmp_path / "films"
    folder.mkdir()
    (folder / "old.csv").write_text("a,b\n1,2\n")

    def told(code, kill=None):
        before = everything(folder)
        program = (sys.executable, "-c", "import os, pathlib, sys, time; " + code)
        return list(faults(run(["track", "--quiet"], folder, kill, program), folder, before))

    return told


REFUSED = "sys.exit('error: no')"


@pytest.mark.parametrize(
    "code",
    [
        "pass",
        REFUSED,
        "sys.stderr.write('warning: dark\\n')",
        "pathlib.Path('new.csv').write_text('a\\n1\\n')",
        f"pathlib.Path('a.suggested.keypoints.csv').write_text('a\\n'); {REFUSED}",
    ],
)
def test_what_ends_as_it_is_meant_to_is_not_complained_of(wrong, code):
    assert wrong(code) == []


@pytest.mark.parametrize(
    ("code", "said"),
    [
        ("1 / 0", "it says 'Traceback'"),
        ("sys.exit(3)", "exit status 3"),
        ("os.kill(os.getpid(), 11)", "exit status -11"),
        ("sys.exit(1)", "0 lines of error with status 1"),
        ("sys.exit('error: no\\nerror: no')", "2 lines of error with status 1"),
        ("sys.exit(2)", "status 2 without its usage"),
        ("print('[h264] @ 0x7f')", "it says '@ 0x'"),
        ("sys.stderr.write('half\\n')", "a quiet command says 'half'"),
        ("pathlib.Path('.a.part').mkdir()", ".a.part is left over"),
        ("pathlib.Path('a.csv').write_text('a,b\\n1')", "a.csv is not whole"),
        ("pathlib.Path('old.csv').write_text('a,b\\n1\\n')", "old.csv is not whole"),
        ("pathlib.Path('a.json').write_text('{')", "a.json is not whole"),
        ("pathlib.Path('a.npz').write_bytes(b'PK')", "a.npz is not whole"),
        ("pathlib.Path('a.mp4').write_bytes(b'')", "a.mp4 is not whole"),
        ("pathlib.Path('a.html').write_text('<html>')", "a.html is not whole"),
        (f"os.remove('old.csv'); {REFUSED}", "old.csv is changed by a refusal"),
        (f"pathlib.Path('a.csv').write_text('a\\n'); {REFUSED}", "a.csv is changed by a refusal"),
    ],
)
def test_what_is_wrong_is_found_out(wrong, code, said):
    assert any(one.startswith(said) for one in wrong(code)), wrong(code)


def test_what_takes_much_time_is_found_out(wrong, monkeypatch):
    monkeypatch.setattr(ending, "MOST_SECONDS", 0.5)
    assert wrong("time.sleep(60)") == ["it had not ended after 0.5 s"]
    assert wrong("time.sleep(60)", Kill(signal.SIGTERM, 0.1)) == []


def test_what_takes_much_memory_or_leaves_processes_is_found_out(wrong, monkeypatch):
    monkeypatch.setattr(ending, "GRACE", 0.2)
    own = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss  # a process begins as a copy of this one
    monkeypatch.setattr(ending, "MOST_MEMORY", own + 2**27)
    (said,) = wrong(f"a = bytearray({own + 2**28})")
    assert said.startswith("it took ")
    assert wrong("os.fork() or time.sleep(60)") == ["1 processes that it started did not end"]


@pytest.mark.parametrize(
    ("number", "complaints"), [(signal.SIGKILL, 0), (signal.SIGTERM, 1), (signal.SIGHUP, 1)]
)
def test_only_what_is_killed_outright_may_leave_something(wrong, number, complaints):
    code = f"pathlib.Path('.a.part').mkdir(); os.kill(os.getpid(), {number:d}); time.sleep(60)"
    assert len(wrong(code, Kill(number, 300.0))) == complaints


@pytest.mark.parametrize(
    ("place", "ours"),
    [
        ('File "<frozen site>", line 599, in main', False),
        ('File "tracker/__main__.py", line 30, in main', True),
        ('File "tracker/__main__.py", line 62, in __call__', True),
    ],
)
def test_an_interrupt_while_python_itself_begins_is_not_the_program_s(wrong, place, ours):
    said = f"Traceback (most recent call last):\n  {place}\nKeyboardInterrupt\n"
    assert bool(wrong(f"sys.stderr.write({said!r}); sys.exit(1)", Kill(signal.SIGCONT, 300.0))) == ours


def test_films_are_whole_or_damaged(tmp_path, monkeypatch):
    read, drawn = 0, []
    monkeypatch.setattr(films, "FRAMES", 10)
    monkeypatch.setattr(films, "walk", cache(films.walk.__wrapped__))  # not the walks of longer films
    for seed in range(12):
        folder = tmp_path / str(seed)
        folder.mkdir()
        rng = np.random.default_rng(seed)
        film = shot(rng)
        path = write_film(folder, "one", film, rng)
        marks = write_marks(folder / "one.csv", film, rng)
        try:
            read += sum(1 for _ in Video(path)) == len(film.images)
            read_keypoints(marks)
        except (VideoError, ValueError):
            pass
        drawn.append(path.suffix)
    assert read > 6
    assert len(set(drawn)) > 5


def test_damage_is_drawn_from_the_seed():
    data = bytes(range(200))
    once, again = (damaged(data, np.random.default_rng(7)) for _ in range(2))
    assert once == again != data
