"""The command in a process of its own, as a user starts it."""

import os
import signal
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
# Buffered as it usually is: what is printed may fail only when it is flushed.
AT_HOME = os.environ | {"PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": ""}


def started(*line, before=None, environment=None, **more):
    """The process, its text taken; `before` is called in it first."""

    def prepared():
        # A shell that runs tests in the background hides Ctrl-C from them.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        if before is not None:
            before()

    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True} | more
    command = [sys.executable, "-m", "tracker", *map(str, line)]
    return subprocess.Popen(command, env=AT_HOME | (environment or {}), preexec_fn=prepared, **pipes)


def ran(code, *arguments, timeout=120):
    """Status of a fresh interpreter that runs this, and what it wrote to stdout and stderr."""
    words = [sys.executable, "-c", code, *arguments]
    done = subprocess.run(words, env=AT_HOME, capture_output=True, text=True, check=False, timeout=timeout)
    return done.returncode, done.stdout, done.stderr


def printed_by(code, folder=ROOT, environment=os.environ):
    """The lines that a fresh interpreter prints, in a folder."""
    words, environment = [sys.executable, "-c", code], environment | {"PYTHONPATH": str(ROOT)}
    said = subprocess.run(words, cwd=folder, env=environment, capture_output=True, text=True, check=True)
    return said.stdout.splitlines()


def ended(*line, **how):
    """Its status and what it wrote to stdout and stderr."""
    process = started(*line, **how)
    out, errors = process.communicate(timeout=120)
    return process.returncode, out, errors
