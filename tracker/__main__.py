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
AGAIN = 3.0  # seconds in which further interrupts are ignored
LATER = 0.01  # seconds after which an interrupt is repeated
COMPILER = f"{os.sep}llvmlite{os.sep}"  # part of the paths of the compiler's files
# Matrices are small here: threads of one multiplication wait for each other longer than they compute.
ONE_THREAD = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
OF_TYPER = 130  # typer's exit status after Ctrl-C while it reads options


def main() -> None:
    """Entry point of the command line; Ctrl-C prints one line even while modules are being imported."""
    try:
        # A scheduler's signal and the end of the terminal are handled like Ctrl-C, with the same cleaning up.
        interrupt = Interrupt()
        for number in _endings():
            signal.signal(number, interrupt)
        sys.unraisablehook = interrupt.lost
        for name in ONE_THREAD:
            os.environ.setdefault(name, "1")  # read when NumPy is imported
        # A last garbage collection over all loaded modules would take a quarter of a second.
        atexit.register(gc.freeze)
        from tracker.cli.app import main as figtrack

        figtrack()
    except BaseException as end:
        if not _interrupted(end):
            raise
        sys.exit("error: interrupted; nothing was written")
    finally:
        for number in _endings():  # Python prints a traceback for an interrupt while it exits
            signal.signal(number, signal.SIG_DFL)


def _interrupted(end: BaseException) -> bool:
    """Whether an interrupt ended the command, also one in a module or class that was being made."""
    if isinstance(end, SystemExit):
        return end.code == OF_TYPER
    return isinstance(end, KeyboardInterrupt) or isinstance(end.__cause__, KeyboardInterrupt)


def _endings() -> list[int]:
    """The signals that end a command, without ignored ones, as under nohup."""
    numbers = [getattr(signal, name) for name in ENDING if hasattr(signal, name)]
    return [number for number in numbers if signal.getsignal(number) is not signal.SIG_IGN]


class Interrupt:
    """A handler that interrupts the work; for AGAIN seconds after it signals do not disturb cleaning up."""

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
        """Hook for exceptions that cannot propagate, such as in a finalizer; an interrupt is repeated."""
        if not issubclass(unraisable.exc_type, KeyboardInterrupt):
            sys.__unraisablehook__(unraisable)
            return
        self.last = -AGAIN
        _once_more(signal.SIGINT)


def _of_compiler(frame: FrameType | None) -> bool:
    """Whether the compiler is running: LLVM calls Python back, and crashes if that raises."""
    while frame is not None:
        if COMPILER in frame.f_code.co_filename:
            return True
        frame = frame.f_back
    return False


def _once_more(number: signal.Signals) -> None:
    """Repeat a signal to this thread, the main one, a little later, if its handler is still the same."""
    main, handler = _thread.get_ident(), signal.getsignal(number)

    def come() -> None:
        time.sleep(LATER)
        if signal.getsignal(number) is not handler:
            return  # the command has ended
        if hasattr(signal, "pthread_kill"):
            signal.pthread_kill(main, number)  # wakes the thread from waiting
        else:
            _thread.interrupt_main(number)

    # `threading` would take a lock, whose holder the handler may have interrupted.
    _thread.start_new_thread(come, ())


if __name__ == "__main__":  # processes of a batch import this file too
    main()
