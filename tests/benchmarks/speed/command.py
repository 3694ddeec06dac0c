"""What `figtrack` takes as a process, CPU time and memory: `track` of a clip and of films of its frames, and
`classify` of a long pose table."""

import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import cycle, islice
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from videos.frames import Video
from videos.writer import Writer

REPEATS = 5
LONG = 36_000  # frames: 20 minutes at 30 a second
LENGTHS = (3000, LONG)  # frames of long films
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
# Runs a command and prints its CPU seconds and memory. A process's memory counts from that of the one which
# started it, so that one must be small.
LAUNCH = """
import os, subprocess, sys
running = subprocess.Popen(sys.argv[1:], stdout=subprocess.DEVNULL)
_, status, used = os.wait4(running.pid, 0)
print(used.ru_utime + used.ru_stime, used.ru_maxrss)
sys.exit(status != 0)
"""
WAYS = {
    "all files": (),
    "without overlay.mp4": ("--no-overlay",),
    "without overlay.mp4 and report.html": ("--no-overlay", "--no-report"),
}


@dataclass(frozen=True)
class Used:
    """CPU seconds, and megabytes resident at most."""

    seconds: float
    megabytes: float


@dataclass(frozen=True)
class Command:
    """What the command uses.

    ways     : of the clip, by which files are left out
    long     : of films of LENGTHS frames
    classify : labels of LONG synthetic poses
    """

    ways: dict[str, Used]
    long: tuple[Used, ...]
    classify: Used

    @property
    def milliseconds(self) -> float:
        """CPU of each further frame of a long film."""
        (fewer, more), (short, long) = LENGTHS, self.long
        return 1e3 * (long.seconds - short.seconds) / (more - fewer)


def command(video: Path) -> Command:
    """Medians of several runs from the marks beside the clip; long films are followed once."""
    marks = video.with_name(f"{video.stem}.keypoints.csv")
    with TemporaryDirectory() as scratch:
        folder = Path(scratch)
        ways = {name: _typical(video, marks, folder, without) for name, without in WAYS.items()}
        long = tuple(_track(_there_and_back(video, n, folder), marks, folder, ()) for n in LENGTHS)
        return Command(ways, long, _classify(folder))


def _typical(video: Path, marks: Path, folder: Path, without: Sequence[str]) -> Used:
    runs = [_track(video, marks, folder, without) for _ in range(REPEATS)]
    return Used(median(run.seconds for run in runs), median(run.megabytes for run in runs))


def _track(video: Path, marks: Path, folder: Path, without: Sequence[str]) -> Used:
    return _used("track", video, "--keypoints", marks, "--out", folder / "run", "--overwrite", *without)


def _classify(folder: Path) -> Used:
    poses = folder / "poses.csv"
    _used("synthesise", "--frames", LONG, "--no-clip", "--no-plot", "--out", poses)
    return _used("classify", poses, "--no-plot", "--out", folder / "labels.csv")


def _used(*given: object) -> Used:
    """Of one command."""
    words = [*map(str, given), "--quiet"]
    running = [sys.executable, "-c", LAUNCH, sys.executable, "-m", "tracker", *words]
    ended = subprocess.run(
        running, env=os.environ | ONE_THREAD, stdout=subprocess.PIPE, text=True, check=False
    )
    if ended.returncode != 0:
        raise RuntimeError(f"figtrack {' '.join(words)} failed")
    seconds, most = map(float, ended.stdout.split())
    return Used(seconds, most / (2**20 if sys.platform == "darwin" else 2**10))


def _there_and_back(video: Path, frames: int, folder: Path) -> Path:
    """A film of the clip's frames, ahead and back again until there are enough."""
    clip, path = Video(video), folder / f"{frames}.mp4"
    images = [frame.image for frame in clip]
    with Writer(path, clip.fps, (clip.width, clip.height), quick=True) as writer:
        for t, image in enumerate(islice(cycle(images + images[-2:0:-1]), frames)):
            writer.write(image, t / clip.fps)
    return path
