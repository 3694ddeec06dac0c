"""What is said of every spoiled input, letter by letter, in said.txt."""

import re
from pathlib import Path

from tests.spoiled.case import Case
from tests.spoiled.stock import words
from tests.tracker.clips import figtrack

PLACE = Path(__file__).with_name("said.txt")
# What Python, numpy or FFmpeg would say to a programmer.
JARGON = re.compile(
    r"Traceback|\w+(Error|Exception|Warning)\b|\[Errno|<class|object at 0x|codec|recursion|sys\."
)


def told(case: Case, folder: Path) -> tuple[int, str]:
    """Exit status and stderr of a case in its folder, which one is in and which is called FOLDER."""
    case.spoil(folder / case.file)
    result = figtrack(*words(case.command))
    return result.exit_code, result.stderr


def letters(text: str, folder: Path) -> str:
    """What is held of stderr: all but where the folder lies and where JSON or TOML is cut."""
    named = re.sub(r"json: .*? at line \d+ column \d+", "json", text.replace(str(folder), "FOLDER"))
    named = re.sub(r" \(at line \d+, column \d+\)", "", named)
    return "\n".join(line.rstrip() for line in named.splitlines() if line.strip())


def check_line(text: str) -> None:
    """One line, of which somebody who knows no Python can make something."""
    (line,) = text.splitlines()
    assert line.startswith("error: "), line
    assert line.isprintable(), line
    assert not JARGON.search(line), line
    assert re.search(r"; |should be", line), f"what is to be done? {line}"


def read_said() -> dict[str, str]:
    """What is held, by the name of the case."""
    parts = PLACE.read_text(encoding="utf-8").split("\n\n")
    return dict(part.strip("\n").partition("\n")[::2] for part in parts if part.strip())


def write_said(said: dict[str, str]) -> None:
    """Hold it."""
    PLACE.write_text("\n\n".join(f"{name}\n{text}" for name, text in said.items()) + "\n", encoding="utf-8")
