"""Bits turned at random: whatever a command makes of it, it is done or ends in one clear line."""

import numpy as np
import pytest

from tests.spoiled.said import check_line
from tests.spoiled.spoil import flip
from tests.spoiled.stock import FOREIGN, words
from tests.tracker.clips import figtrack
from tests.tracker.processes import ran
from tracker.batch.jobs import JobsError, read_jobs
from tracker.foreign.start_marks import read_start
from tracker.foreign.text_files import ForeignError
from tracker.progress import Progress
from tracker.settings import SettingsError, read_settings

pytestmark = pytest.mark.whole

FLIPS = 40  # a format that is read alone
READ = {
    "marks.csv": "track --stop 0 --no-overlay --no-report",
    "m.npz": "classify",
    "poses.csv": "interpolate",
    "trials.csv": "learn captures",
    "c0.bvh": "learn captures",
    "run/run.json": "myogait",
    "run/track.npz": "trc",
}

READERS = dict.fromkeys(FOREIGN, read_start)
READERS["s.toml"] = read_settings
READERS["jobs.csv"] = lambda path: read_jobs(path, path.parent, Progress("quiet"))


def spoilt(path, flips=FLIPS, few=4):
    """The file again and again, a few bits of it turned, or cut."""
    data = path.read_bytes()
    for seed in range(flips):
        rng = np.random.default_rng(seed)
        kept = data if seed % 4 else data[: rng.integers(len(data))]
        path.write_bytes(flip(kept, rng, int(rng.integers(1, few + 1))) if kept else kept)
        yield seed


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", READ)
def test_flipped_bits_are_read_or_refused_in_one_line(folder, name):
    ended = set()
    for _ in spoilt(folder / name, flips=16):
        result = figtrack(*words(READ[name]))
        ended.add(result.exit_code)
        if result.exit_code:
            check_line(result.stderr)
    assert 1 in ended


@pytest.mark.parametrize("name", READERS)
def test_flipped_bits_of_other_files_are_read_or_refused_in_one_line(folder, name):
    refused = 0
    for _ in spoilt(folder / name):
        try:
            READERS[name](folder / name)
        except (ForeignError, JobsError, SettingsError) as error:
            check_line(f"error: {error}")
            refused += 1
    assert refused


DECODE = """
import sys
from videos.container import VideoError
from videos.frames import Video
for path in sys.argv[1:]:
    try:
        print(sum(1 for _ in Video(path)))
    except VideoError as error:
        print(error)
"""


@pytest.mark.parametrize("name", ["walk.mp4", "images/1.png"])
def test_flipped_bits_of_pictures_are_decoded_or_refused_and_no_library_crashes(folder, name):
    paths = []
    for seed in spoilt(folder / name):
        place = folder / f"flipped-{seed}"
        if name.startswith("images"):
            place.mkdir()
            (place / "1.png").write_bytes((folder / name).read_bytes())
        else:
            place.write_bytes((folder / name).read_bytes())
        paths.append(place)
    # In a process of its own, which a crash within FFmpeg would end.
    status, out, errors = ran(DECODE, *paths)
    assert (status, errors) == (0, "")
    lines = out.splitlines()
    assert len(lines) == FLIPS
    assert any(not line.isdecimal() for line in lines)
