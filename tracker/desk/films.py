"""The films of a folder, and what has been made of each: marks, who was found, a run."""

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tracker.run.read import RunError, read_news
from tracker.tables.table import by_column, read_lines
from videos.frames import films_in

TOLD = ("person", "first", "last", "facing", "direction", "motion", "near_leg", "near_sure")


@dataclass(frozen=True)
class Film:
    """A film and where what is made of it lies: beside it, as the commands call it in their own folder."""

    path: Path

    @property
    def name(self) -> str:
        return self.path.name

    @property
    def marks(self) -> Path:
        """The table that `annotate` leaves."""
        return self._beside(".keypoints.csv")

    @property
    def people(self) -> Path:
        """The table that `find` leaves; its picture has the same name as a PNG."""
        return self._beside("-people.csv")

    @property
    def run(self) -> Path:
        """Folder of the run of this film."""
        return self._beside("-track")

    def told(self) -> dict[str, Any]:
        return {
            "name": self.name,
            "marked": self.marks.exists(),
            "people": _people(self.people),
            "run": _run(self.run),
        }

    def _beside(self, ending: str) -> Path:
        return self.path.with_name(self.path.stem + ending)


def films(folder: Path) -> dict[str, Film]:
    """The films that lie in a folder now, by name."""
    return {path.name: Film(path) for path in films_in(folder)}


def _people(table: Path) -> list[dict[str, str]] | None:
    """Who was found, None before anybody was looked for."""
    with suppress(OSError, ValueError):
        (_, header), *rows = read_lines(table)
        return [{name: by_column(header, cells).get(name, "") for name in TOLD} for _, cells in rows]
    return None


def _run(folder: Path) -> dict[str, Any] | None:
    """What a complete run tells of itself, None without one."""
    with suppress(RunError):
        news = read_news(folder)
        report = (folder / "report.html").exists()
        return {"headline": news.headline, "warnings": news.warnings, "report": report}
    return None
