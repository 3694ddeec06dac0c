"""Work in processes of their own."""

from collections.abc import Callable, Iterable
from concurrent.futures import Executor, ProcessPoolExecutor
from multiprocessing import get_context
from typing import TypeVar

from tracker.progress import Progress

Answer = TypeVar("Answer")


def spawned(processes: int = 2) -> ProcessPoolExecutor:
    """A pool of new processes; forked ones would inherit the locks of video decoders that have run before."""
    return ProcessPoolExecutor(processes, get_context("spawn"))


def each(
    pool: Executor,
    function: Callable[..., Answer],
    items: Iterable[tuple[object, ...]],
    progress: Progress,
    name: str,
) -> list[Answer]:
    """The function of every item, in order."""
    waiting = [pool.submit(function, *item) for item in items]
    answers = []
    with progress.task(name, len(waiting)) as advance:
        for future in waiting:
            answers.append(future.result())
            advance()
    return answers
