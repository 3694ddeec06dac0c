"""What the Makefile installs."""

import shlex
import tomllib

import pytest

from tests.handbook.blocks import ROOT
from tests.handbook.stage import run_process

EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]


@pytest.mark.parametrize(
    ("target", "wanted"), [("installed", "."), ("installed-dev", ".[dev]"), ("installed-bench", ".[bench]")]
)
def test_an_environment_is_installed_by_commands_that_name_the_project_and_an_extra(target, wanted):
    told = run_process(["make", "--dry-run", "--always-make", f".venv/{target}"], cwd=ROOT)
    words = shlex.split(told)
    named = [words[i + 1] for i, word in enumerate(words) if word == "--editable"]
    assert named == [wanted, wanted]  # by uv, or else by pip
    assert wanted == "." or wanted[2:-1] in EXTRAS
