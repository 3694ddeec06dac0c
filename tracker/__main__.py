"""`figtrack`, and `python -m tracker`."""

import _thread
import atexit
import gc
import os
import signal
import sys
import time
from types import FrameType

ENDING = ("SIGINT", "SIGTERM", "SIGHUP")  # Windows has no SIGHUP
AGAIN = 3.0  # seconds
LATER = 0.01  # seconds
COMPILER = f"{os.sep}llvmlite{os.sep}"  # in the paths of its files
# Matrices are small here: threads of one multiplication wait for each other longer than they work.
ONE_THREAD = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
OF_TYPER = 130  # its exit status after Ctrl-C while it reads options


def main() -> None:
    """Entry point of the command line; to be interrupted in one line while that is still being imported."""
    try:
        # What a scheduler stops, or the end of a terminal, cleans up behind it as after Ctrl-C.
        interrupt = Interrupt()
        for number in _endings():
            signal.signal(number, interrupt)
        sys.unraisablehook = interrupt.lost
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


class Interrupt:
    """A handler that ends what is done; what comes within AGAIN does not disturb what is then cleaned up."""

    def __init__(self) -> None:
        self.last = -AGAIN

    def __call__(self, number: int, frame: FrameType | None) -> None:
        if _of_compiler(frame):
            _once_more(signal.Signals(number))
            return
        before, self.last = self.last, time.monotonic()
        if self.last - before >= AGAIN:
            raise KeyboardInterrupt

    def lost(self, unraisable: "sys.UnraisableHookArgs") -> None:
        """Told of an exception that had nobody to go to, as in a finalizer; an interrupt comes once more."""
        if not issubclass(unraisable.exc_type, KeyboardInterrupt):
            sys.__unraisablehook__(unraisable)
            return
        self.last = -AGAIN
        _once_more(signal.SIGINT)


def _of_compiler(frame: FrameType | None) -> bool:
    """Whether the compiler is at work: LLVM calls Python back, and crashes where that raises."""
    while frame is not None:
        if COMPILER in frame.f_code.co_filename:
            return True
        frame = frame.f_back
    return False


def _once_more(number: signal.Signals) -> None:
    """Let a signal come again to this thread, the main one, a little later, if it is handled alike then."""
    main, handler = _thread.get_ident(), signal.getsignal(number)

    def come() -> None:
        time.sleep(LATER)
        if signal.getsignal(number) is not handler:
            return  # the command has ended
        if hasattr(signal, "pthread_kill"):
            signal.pthread_kill(main, number)  # wakes it from a wait
        else:
            _thread.interrupt_main(number)

    # No lock is taken, as `threading` would: a handler may have interrupted whoever holds it.
    _thread.start_new_thread(come, ())


if __name__ == "__main__":  # processes that a batch starts read this file too
    main()
