"""Run random commands on random films for a time, kill some of them, and look at how every one ends.

    python -m tests.benchmarks.soak [--minutes N] [--processes N] [--seed N] [--keep DIR]

A seed makes a folder, a few commands in it, and when which of them is killed. A command that SIGKILL ends is
run once more, which must leave nothing of the first. Exit status 1 if anything was wrong.
"""

import argparse
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import av

from tests.benchmarks.processes import spawned
from tests.benchmarks.soak.commands import stock
from tests.benchmarks.soak.soaking import Found, soaked, until


def main() -> None:
    """Soak, tell what was wrong, and exit with 1 if anything was."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.soak", description=__doc__)
    parser.add_argument("--minutes", type=float, default=60.0, help="for how long")
    parser.add_argument("--processes", type=int, default=2, help="side by side")
    parser.add_argument("--seed", type=int, help="this one alone")
    parser.add_argument("--first", type=int, default=int(time.time()) % 10**6 * 1000, help="the first seed")
    parser.add_argument("--keep", type=Path, help="where the folders of what is wrong are kept")
    asked = parser.parse_args()
    av.logging.set_level(av.logging.PANIC)  # of damaged films
    with TemporaryDirectory(prefix="soak-") as folder:
        stocked = Path(folder) / "stock"
        stocked.mkdir()
        stock(stocked)
        if asked.seed is not None:
            found = soaked(asked.seed, stocked, asked.keep)
        else:
            found = _side_by_side(asked, stocked)
    for (command, end), count in sorted(found.ends.items()):
        print(f"{command}: {count} {end}")
    print(f"{found.ends.total()} commands, {len(found.wrong)} faults")
    print("\n".join(found.wrong))
    sys.exit(bool(found.wrong))


def _side_by_side(asked: argparse.Namespace, stocked: Path) -> Found:
    end, found = time.time() + 60.0 * asked.minutes, Found()
    with spawned(asked.processes) as pool:
        parts = [
            pool.submit(until, end, asked.first + n, asked.processes, stocked, asked.keep)
            for n in range(asked.processes)
        ]
        for part in parts:
            found.add(part.result())
    return found


if __name__ == "__main__":
    main()
