"""`figtrack`, and `python -m tracker`."""

import atexit
import gc
import os
import signal
import sys
import time
from collections.abc import Callable

ENDING = ("SIGINT", "SIGTERM", "SIGHUP")  # Windows has no SIGHUP
AGAIN = 3.0  # seconds
# Matrices are small here: threads of one multiplication wait for each other longer than they work.
ONE_THREAD = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
OF_TYPER = 130  # its exit status after Ctrl-C while it reads options


def main() -> None:
    """Entry point of the command line; to be interrupted in one line while that is still being imported."""
    try:
        # What a scheduler stops, or the end of a terminal, cleans up behind it as after Ctrl-C.
        interrupt = _interrupting()
        for number in _endings():
            signal.signal(number, interrupt)
        for name in ONE_THREAD:
            os.environ.setdefault(name, "1")  # read when NumPy is imported
        # A last search for cycles in all that is loaded would take a quarter of a second.
        atexit.register(gc.freeze)
        from tracker.cli.app import main as figtrack

        figtrack()
    except (KeyboardInterrupt, SystemExit) as end:
        if isinstance(end, SystemExit) and end.code != OF_TYPER:
            raise
        sys.exit("error: interrupted; nothing was written")
    finally:
        for number in _endings():  # Python would complain, while it ends, of an interrupt
            signal.signal(number, signal.SIG_DFL)


def _endings() -> list[int]:
    """The signals that end a command; not those that are ignored, as nohup has it."""
    numbers = [getattr(signal, name) for name in ENDING if hasattr(signal, name)]
    return [number for number in numbers if signal.getsignal(number) is not signal.SIG_IGN]


def _interrupting() -> Callable[[int, object], None]:
    """A handler that ends what is done; what comes within AGAIN does not disturb what is then cleaned up."""
    last = -AGAIN

    def interrupt(number: int, frame: object) -> None:
        nonlocal last
        before, last = last, time.monotonic()
        if last - before >= AGAIN:
            raise KeyboardInterrupt

    return interrupt


if __name__ == "__main__":  # processes that a batch starts read this file too
    main()
