"""The commands of a seed run one after the other, some of them killed, and what is wrong with their ends."""

import os
import shutil
import signal
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from shlex import join
from tempfile import TemporaryDirectory

import av
import numpy as np

from tests.benchmarks.soak.commands import furnish, line
from tests.benchmarks.soak.ending import SIGNALS, Ending, Kill, faults, leftovers, run
from tests.tracker.clips import everything

COMMANDS = 3  # a seed, at most
KILLED = 0.35  # share of commands
TYPICAL = (0.3, 1.0, 3.0, 8.0)  # seconds that commands take


@dataclass
class Found:
    """How many commands ended how, and what was wrong."""

    ends: Counter[tuple[str, str]] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)

    def add(self, other: "Found") -> None:
        self.ends += other.ends
        self.wrong += other.wrong


def soaked(seed: int, stocked: Path, keep: Path | None) -> Found:
    """All commands of a seed."""
    rng, found = np.random.default_rng(seed), Found()
    with TemporaryDirectory(prefix="soak-") as place:
        folder = Path(place) / "films"
        furnish(folder, stocked, rng)
        for n in range(int(rng.integers(1, COMMANDS + 1))):
            words, kill = line(folder, rng), _kill(rng)
            for ending, wrong in _ends(words, folder, kill):
                found.ends[words[0], _told(ending)] += 1
                text = f"seed {seed}, command {n + 1}: {join(words)}" + (f" ({kill})" if kill else "")
                last = ending.errors.strip().rpartition("\n")[2]
                print(f"{text}: {_told(ending)} in {ending.seconds:.1f} s; {last}", flush=True)
                for one in wrong:
                    found.wrong.append(f"{text}: {one}\n{_indented(ending.errors)}")
                    print(found.wrong[-1], flush=True)
        if found.wrong and keep is not None:
            shutil.copytree(place, keep / str(seed), dirs_exist_ok=True, symlinks=True)
    return found


def _ends(words: list[str], folder: Path, kill: Kill | None) -> Iterator[tuple[Ending, list[str]]]:
    """How the command ended, and where SIGKILL ended it, how its next try did."""
    before = everything(folder)
    ending = run(words, folder, kill)
    yield ending, list(faults(ending, folder, before))
    if ending.status == -signal.SIGKILL and leftovers(folder):
        before = {path: told for path, told in everything(folder).items() if ".part" not in str(path)}
        again = run(words, folder, None)
        yield again, list(faults(again, folder, before))


def until(end: float, seed: int, step: int, stocked: Path, keep: Path | None) -> Found:
    """All seeds from one on, in steps, up to a time, or to the end of the process that asked."""
    parent = os.getppid()
    av.logging.set_level(av.logging.PANIC)
    found = Found()
    while time.time() < end and os.getppid() == parent:
        found.add(soaked(seed, stocked, keep))
        seed += step
    return found


def _kill(rng: np.random.Generator) -> Kill | None:
    drawn, number = rng.random(), SIGNALS[rng.integers(len(SIGNALS))]
    after = rng.uniform(0.0, rng.choice(TYPICAL))
    return Kill(number, round(float(after), 2)) if drawn < KILLED else None


def _told(ending: Ending) -> str:
    return (
        f"ended by {signal.Signals(-ending.status).name}" if ending.status < 0 else f"status {ending.status}"
    )


def _indented(text: str) -> str:
    return "\n".join(f"    {part}" for part in text.splitlines()[-12:])
