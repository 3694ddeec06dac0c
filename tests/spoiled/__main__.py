"""Write said.txt anew: python -m tests.spoiled. What changed is for `git diff` to show."""

import shutil
from contextlib import chdir
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.spoiled.cases import CASES
from tests.spoiled.said import letters, told, write_said
from tests.spoiled.stock import fill
from tests.tracker.clips import make_clip
from tracker.progress import Progress


def main() -> None:
    """Run every case."""
    said = {}
    with TemporaryDirectory() as place, Progress().task("spoiled inputs", len(CASES)) as advance:
        (stock := Path(place) / "stock").mkdir()
        with chdir(stock):
            fill(stock, make_clip(Path(place)))
        for case in CASES:
            folder = Path(place) / "copy"
            shutil.copytree(stock, folder)
            with chdir(folder):
                said[case.name] = letters(told(case, folder)[1], folder)
            shutil.rmtree(folder)
            advance()
    write_said(said)


if __name__ == "__main__":
    main()
