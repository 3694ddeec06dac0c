"""Formulas of mutations.toml broken one at a time, and whether what `make test` runs notices.

python -m tests.benchmarks.mutations [WORD ..]   those whose file's path has one of the words, or all

Each is made in a copy of the project. Status 1 if more than two go unnoticed or an entry no longer applies.
"""

import os
import shutil
import subprocess
import sys
import tomllib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).parents[2]
LIST = Path(__file__).with_suffix(".toml")
MOST_MISSED = 2
PASSED, FAILED = 0, (1, 2)  # pytest's status; 2 where a module cannot even be imported
NOT_COPIED = shutil.ignore_patterns(".*", "*.egg-info", "dist", "figtrack-demo", "runs")


@dataclass(frozen=True)
class Mutation:
    """One formula broken.

    file  : of the product, from the project's root
    exact : stands in it once
    wrong : is put in its place
    tests : those that should notice, run first
    """

    file: str
    exact: str
    wrong: str
    tests: list[str]

    def made(self, text: str) -> str:
        """The file's text with the formula broken."""
        if (count := text.count(self.exact)) != 1:
            raise ValueError(f"{self.file} holds {count} times, not once: {self.exact}")
        return text.replace(self.exact, self.wrong)

    def noticed(self) -> bool:
        """Whether a test fails: one of its own, or else any other."""
        with TemporaryDirectory() as place:
            copy = Path(place) / "figtrack"
            shutil.copytree(ROOT, copy, ignore=NOT_COPIED)
            path = copy / self.file
            path.write_text(self.made(path.read_text(encoding="utf-8")), encoding="utf-8")
            return any(_fails(copy, words) for words in (self.tests, ["-n", "auto"]))


def _fails(copy: Path, words: list[str]) -> bool:
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *words]
    environment = os.environ | {"PYTHONPATH": str(copy), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(command, cwd=copy, env=environment, capture_output=True, text=True, check=False)
    if done.returncode not in (PASSED, *FAILED):
        raise RuntimeError(f"{' '.join(command)}: {done.stdout}{done.stderr}")
    return done.returncode in FAILED


def main(words: list[str]) -> int:
    entries = tomllib.loads(LIST.read_text(encoding="utf-8"))["mutations"]
    mutations = [Mutation(**entry) for entry in entries]
    for mutation in mutations:
        mutation.made((ROOT / mutation.file).read_text(encoding="utf-8"))
    chosen = [each for each in mutations if not words or any(word in each.file for word in words)]
    missed = 0
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for mutation, noticed in zip(chosen, pool.map(Mutation.noticed, chosen), strict=True):
            missed += not noticed
            said = "caught  " if noticed else "survived"
            print(f"{said}  {mutation.file}: {mutation.exact}  ->  {mutation.wrong}", flush=True)
    print(f"{len(chosen) - missed} of {len(chosen)} caught, in {len({each.file for each in chosen})} files")
    return int(missed > MOST_MISSED)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
