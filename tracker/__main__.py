"""`figtrack`, and `python -m tracker`."""

import signal
import sys

ENDING = ("SIGINT", "SIGTERM", "SIGHUP")  # Windows has no SIGHUP
OF_TYPER = 130  # its exit status after Ctrl-C while it reads options


def main() -> None:
    """Entry point of the command line; to be interrupted in one line while that is still being imported."""
    numbers = [getattr(signal, name) for name in ENDING if hasattr(signal, name)]
    # What a scheduler stops, or the end of a terminal, cleans up behind it as after Ctrl-C.
    for number in numbers:
        if signal.getsignal(number) is not signal.SIG_IGN:  # as nohup has it
            signal.signal(number, _interrupt)
    try:
        from tracker.cli.app import main as figtrack

        figtrack()
    except (KeyboardInterrupt, SystemExit) as end:
        if isinstance(end, SystemExit) and end.code != OF_TYPER:
            raise
        sys.exit("error: interrupted; nothing was written")
    finally:
        _handled_by(signal.SIG_DFL)  # Python would complain, while it ends, of an interrupt


def _interrupt(number: int, frame: object) -> None:
    """End what is done, once: nothing interrupts what is then cleaned up."""
    _handled_by(signal.SIG_IGN)
    raise KeyboardInterrupt


def _handled_by(handler: signal.Handlers) -> None:
    for number in signal.valid_signals():
        if signal.getsignal(number) is _interrupt:
            signal.signal(number, handler)


if __name__ == "__main__":  # processes that a batch starts read this file too
    main()
