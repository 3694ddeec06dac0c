"""Correcting a finished run on the marking page, and following the film again."""

import os
import shlex
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from kinematics.figure_file import load_figure
from kinematics.text_file import ordinary
from tracker.annotate.marks import Table
from tracker.annotate.session import IN_APP, MarksRequest, Reply, Session, side, told
from tracker.clip.again import Kept, read_finished
from tracker.clip.follow import follow
from tracker.clip.start import outside
from tracker.errors import fault
from tracker.progress import Progress, counted
from tracker.report.results import write_run
from tracker.run.folder import CORRECTED, FolderError, check_inputs, fresh_folder
from tracker.run.read import NEWS, OVERLAY, REPORT, read_run, read_track
from tracker.tables.keypoints import Mark
from tracker.tables.poses import stretches


class Correction(Session):
    """A run's folder, and the page on which it is corrected.

    Marked frames are those that the track passes through: the start frame and corrected ones. Saved marks lie
    beside the run's own until the film is followed again.
    """

    command = "correct"

    def __init__(self, folder: Path, first: int | None, progress: Progress) -> None:
        """Open a complete run; the page shows the frame `first`, None for the start frame.

        RunError: no complete run, or one whose film is gone or altered. VideoError: the film cannot be read,
        or ends before `first`. FolderError: the film or another of the run's inputs lies in its folder.
        """
        self.folder, self.progress = folder, progress
        self._said, self._follows = "", False
        self._read()
        job = self._finished.job
        check_inputs(folder, job.inputs)  # now, not only after everything was marked
        first = self._finished.start if first is None else first
        super().__init__(job.video, self._table(), first, job.facing, job.figure)
        if self.table.path.exists():
            self._said = "What was corrected before is not followed yet."

    def opening(self) -> Reply:
        measured, outcome = self._run.measured, self._run.outcome
        lost = [(a, b, outcome[a] or "outside") for a, b in stretches(outcome) if not measured[a]]
        run = {"start": self._finished.start, "unsure": self._finished.unsure, "lost": lost}
        run["figures"] = {t: told(self._followed(t)) for t in self.table.marks}
        run["facing"] = side(self._finished.job.facing)
        run["pending"] = self.table.path.exists()
        run |= {"told": self._said, "follows": self._follows}
        return super().opening() | {"run": run}

    def save(self, request: MarksRequest) -> Reply:
        start = self._finished.start
        with self._lock:
            if self._follows:
                raise FolderError("the figure is just being followed; wait until that is done")
            self._check_same()
            if request.frames.get(start) == {}:
                raise FolderError(f"frame {start} is the one that the run starts from; its marks must stay")
            beyond = [t for t, marks in request.frames.items() if marks and not self._in_run(t)]
            if beyond:
                raise FolderError(f"frame {min(beyond)} is not part of the run; take its marks away")
            reply = super().save(request)
        return reply if self.table.path.exists() else reply | {"saved": str(self.folder)}

    def follow(self, request: MarksRequest) -> Reply:
        """Save, and follow the figure again unless marks look wrong; `follows` says whether it does.
        FolderError, OSError: nothing was written."""
        with self._lock:
            reply = self.save(request)
            self._follows = request.anyway or not reply["wrong"]
            if self._follows:
                self._said, self._shown, self.progress.name = "", request.frame, ""
                self._asked.put(self._follow)
        return reply | {"follows": self._follows}

    def following(self) -> Reply:
        """Progress of following."""
        now = self.progress
        return {"task": now.name, "done": now.done, "total": now.total, "ended": not self._follows}

    def next_command(self) -> str:
        """The command, or in the app the buttons, for corrections not followed yet; "" without any."""
        words = shlex.join(["figtrack", "correct", str(self.folder)])
        return ("Correct, then Follow on" if IN_APP in os.environ else words) * self.table.path.exists()

    def ending(self) -> str:
        if self.next_command():
            return f"what was corrected is saved, but not followed yet; next: {self.next_command()}"
        return self._said or f"{self.folder} is as it was"

    def _follow(self) -> None:
        before = self._finished.job
        marks, start = dict(self.table.marks), self._start()
        found = before.found if marks[start] == before.marks[start] else None
        job = replace(before, marks=marks, facing=self.facing, found=found)
        overlay, report = ((self.folder / name).exists() for name in (OVERLAY, REPORT))
        try:
            self._check_same()
            track = read_track(self.folder, before.settings.mark, self.table.figure)
            kept = Kept.of(track, before.marks, job.marks, start)
            with fresh_folder(self.folder, overwrite=True, inputs=job.inputs, corrected=True) as aside:
                run = follow(job, self.progress, kept)
                write_run(run, aside, self.progress, self._finished.key, overlay=overlay, report=report)
                self._check_same()
            self.saved = True
            self.revision += 1
            self._read()
            self.table = self._table()
            frames = counted(len(job.marks), "frame")
            shown = f"; open {self.folder / REPORT}" if report else "."
            self._said = f"Followed again through {frames}; {self.folder} is replaced{shown}"
        except Exception as error:
            self._said = f"Could not be followed: {fault(error)}"
        finally:
            self._follows = False

    def _start(self) -> int:
        return self._finished.start

    def _read(self) -> None:
        with suppress(OSError):  # `read_finished` says what is wrong
            self._news = ordinary(self.folder / NEWS).read_bytes()
        self._finished, self._run = read_finished(self.folder), read_run(self.folder)

    def _check_same(self) -> None:
        """FolderError if the folder does not hold the run any more that was read."""
        with suppress(OSError):
            if ordinary(self.folder / NEWS).read_bytes() == self._news:
                return
        raise FolderError(f"{self.folder} was replaced since it was opened here; open it again")

    def _table(self) -> Table:
        job = self._finished.job
        return Table(self.folder / CORRECTED, begin=job.marks, figure=load_figure(job.figure))

    def _in_run(self, index: int) -> bool:
        return index < len(self._run) and self._run.outcome[index] is not None

    def _followed(self, index: int) -> Mapping[str, Mark]:
        run = self._run
        if not self._in_run(index):
            return {}
        places = dict(zip(run.names, run.places[index].round(2).tolist(), strict=True))
        seen = bool(run.measured[index])
        marked = self.table.figure.marks
        figure = {
            name: Mark(x, y, seen) for name, (x, y) in places.items() if name in marked and np.isfinite(x)
        }
        beyond = outside(figure, (self._frames.width, self._frames.height))
        return {name: mark for name, mark in figure.items() if name not in beyond}
