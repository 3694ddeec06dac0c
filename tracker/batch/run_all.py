"""Many clips from one table: every row is tracked independently, and complete runs are skipped."""

import hashlib
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING

from tracker import __version__
from tracker.batch.jobs import Row, read_jobs
from tracker.clip.follow import follow
from tracker.clip.job import Job
from tracker.errors import fault
from tracker.models.cluster import cluster_at, local_cluster
from tracker.progress import Progress, tally
from tracker.report.overview import MADE, write_overview
from tracker.report.results import write_run
from tracker.run.folder import FolderError, fresh_file, fresh_folder, swept
from tracker.run.read import RunError, read_gait, read_news, read_run
from tracker.tables.table import write_table
from videos.frames import files_of

if TYPE_CHECKING:
    from distributed import Client

SUMMARY = ("video", "model", "out", "status", "frames", "outcomes", "rate", "warnings", "error")
# Columns of the summary from gait.json: the measure and the leg of each.
GAIT = {
    "cadence": ("cadence", "both"),
    "stride_time_s": ("stride time", "both"),
    "stance_near": ("stance share", "near"),
    "stance_far": ("stance share", "far"),
    "stance_symmetry": ("stance share", "symmetry"),
    "double_support": ("double support", "both"),
    "flight_time_s": ("flight time", "both"),
    "step_length": ("step length", "both"),
    "stride_length": ("stride length", "both"),
    "speed": ("speed", "both"),
}
COLUMNS = (*SUMMARY, "motion", *GAIT, "length_unit")
NAMED = ("model", "figure")  # options that are the name of a shipped one or a file
DONE, SKIPPED, FAILED = "done", "skipped", "failed"


# How a row ended: its cells of the summary from "status" on, by column, without empty ones.
Cells = Mapping[str, str]
Ended = list[tuple[Row, Cells]]


@contextmanager
def _interruption_told() -> Iterator[None]:
    try:
        yield
    except KeyboardInterrupt as error:
        raise ValueError("interrupted; what is done stays, and the same batch again goes on there") from error


@_interruption_told()
def run_batch(
    table: Path,
    place: Path,
    *,
    workers: int | None,
    scheduler: str | None,
    overwrite: bool,
    progress: Progress,
) -> Ended:
    """Track every row of a table of jobs, and write summary.csv and summary.html.

    Args:
        place: folder for the summary and the results that the table names.
        workers: processes on this machine, None for one a processor; ignored with a scheduler.
        scheduler: address of a Dask scheduler, whose workers have the same files under the same names.
        overwrite: whether complete runs of other jobs may be replaced.

    JobsError: a table that cannot be used; nothing was done. ClusterError: a scheduler that does not answer.
    FolderError: a summary that cannot be written. ValueError: the user stopped it.
    """
    rows = read_jobs(table, place, progress)
    summary, overview = place / "summary.csv", place / "summary.html"
    header = ",".join(SUMMARY)
    for path, mark, within in ((summary, header, len(header)), (overview, MADE, 1000)):
        if path.exists() and not (path.is_file() and mark.encode() in path.read_bytes()[:within]):
            raise FolderError(f"{path} is of something else and would be replaced; choose another --out")
    # The summary's place is checked first, so that a long batch is not lost if it cannot be written.
    with fresh_file(summary, overwrite=True, inputs=[table]) as aside:
        most = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        cluster = (
            local_cluster(min(workers or most, len(rows))) if scheduler is None else cluster_at(scheduler)
        )
        with swept(row.out for row in rows), cluster as client:
            ended = list(zip(rows, _run_all(client, rows, overwrite, table.name, progress), strict=True))
        write_table(aside, COLUMNS, (summary_cells(row, cells) for row, cells in ended))
    with fresh_file(overview, overwrite=True) as aside:
        clips = (
            (row.video.name, None if cells["status"] == FAILED else row.out, outcome_of(cells))
            for row, cells in ended
        )
        write_overview(aside, place, clips)
    return ended


def outcome_of(cells: Cells) -> str:
    """The error of a row, or the numbers of its frames by outcome."""
    return cells.get("error") or cells.get("outcomes", "")


def run_row(row: Row, overwrite: bool) -> Cells:
    """Track one clip, unless its folder holds a run of the same job; failures become the row's error."""
    try:
        job = row.job()
        key = job_key(job)
        if _key_in(row.out) == key:
            with suppress(RunError) if overwrite else nullcontext():  # a damaged run may be replaced
                return _ending(SKIPPED, row.out)
        quiet = Progress("quiet")
        with fresh_folder(row.out, overwrite=overwrite, inputs=row.inputs) as aside:
            write_run(follow(job, quiet), aside, quiet, key)
        return _ending(DONE, row.out)
    except Exception as error:
        return _failed(fault(error))


def job_key(job: Job) -> str:
    """A key that identifies a job: all options that affect results, the contents of files, and the names of
    those of a folder, which number the frames."""
    digest = hashlib.sha256(__version__.encode())
    for field in fields(job):
        value = getattr(job, field.name)
        if isinstance(value, Path) or (field.name in NAMED and Path(value).is_file()):
            film = field.name == "video" and value.exists()
            for path in files_of(value) if film else _files(Path(value)):
                digest.update(os.fsencode(path.name) if path.parent == value else b"")
                with path.open("rb") as file:
                    digest.update(hashlib.file_digest(file, "sha256").digest())
        elif field.name not in ("called", "found"):  # marks include what was found
            digest.update(f"{field.name} {value!r}\n".encode())
    digest.update((job.found.near_leg if job.found else "").encode())
    return digest.hexdigest()


def _failed(said: str) -> Cells:
    return {"status": FAILED, "error": " ".join(said.split())}


def summary_cells(row: Row, cells: Cells) -> list[str]:
    """The cells of one job's row in summary.csv."""
    ours = {"video": row.video, "model": row.how.model, "out": row.out}
    return [str(ours.get(column) or cells.get(column, "")) for column in COLUMNS]


def _run_all(
    client: "Client", rows: list[Row], overwrite: bool, name: str, progress: Progress
) -> list[Cells]:
    from distributed import as_completed

    futures = {client.submit(run_row, row, overwrite, pure=False): n for n, row in enumerate(rows)}
    endings: dict[int, Cells] = {}
    try:
        with progress.task(f"batch {name}", len(rows)) as advance:
            for future, answer in as_completed(futures, with_results=True, raise_errors=False):
                endings[futures.pop(future)] = _ending_of(answer)
                # A future that is kept would be computed again if the process with its result died.
                future.release()
                advance()
    except KeyboardInterrupt:
        client.cancel(list(futures))
        raise
    return [endings[n] for n in range(len(rows))]


def _ending_of(answer: object) -> Cells:
    """The ending of a row: its own, or one for an error outside of it."""
    from distributed import KilledWorker
    from distributed.scheduler import NoWorkerError

    if isinstance(answer, dict):
        return answer
    error = answer[1] if isinstance(answer, tuple) else answer  # Dask gives type, error and traceback
    if isinstance(error, KilledWorker):
        return _failed("its process died again and again; is there enough memory?")
    if isinstance(error, NoWorkerError):
        return _failed("no process was left to do it; the same batch again goes on here")
    return _failed(f"{type(error).__name__}: {error}")


def _ending(status: str, folder: Path) -> Cells:
    record = read_run(folder)
    return {
        "status": status,
        "frames": str(len(record)),
        "outcomes": tally(outcome or "not followed" for outcome in record.outcome),
        "rate": "" if record.news.rate is None else f"{record.news.rate:g}",
        "warnings": "; ".join(record.news.warnings),
    } | _gait(folder)


def _gait(folder: Path) -> dict[str, str]:
    """Motion, figures and unit of length from gait.json; empty without one."""
    gait = read_gait(folder)
    if gait is None:
        return {}
    found = {column: gait.mean(measure, legs) for column, (measure, legs) in GAIT.items()}
    figures = {column: f"{mean:.4g}" for column, mean in found.items() if mean is not None}
    unit = "m" if gait.metres_in_leg else "leg lengths"
    return {"motion": gait.motion, **figures, "length_unit": unit}


def _key_in(folder: Path) -> str:
    """The key of the job of the complete run in a folder, "" if there is none."""
    with suppress(RunError):
        return read_news(folder).job
    return ""


def _files(path: Path) -> Iterable[Path]:
    """A file, or those of a folder; none if it does not exist, which tracking will report."""
    if path.is_dir():
        return sorted(inner for inner in path.iterdir() if inner.is_file())
    return [path] if path.exists() else []
