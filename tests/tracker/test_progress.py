"""Progress goes to stderr, one line at a time."""

import errno
import io
import json

import pytest

from tracker import progress
from tracker.progress import Progress


def work(shown, steps=3, total=3):
    with shown.task("walk", total) as advance:
        for _ in range(steps):
            advance()


@pytest.mark.parametrize(
    ("steps", "total", "told"), [(3, 3, "3 of 3"), (1000, 1000, "1000 of 1000"), (3, None, "3")]
)
def test_plain_progress_is_one_line_at_its_end_without_a_number_that_is_not_known(capsys, steps, total, told):
    work(Progress("plain"), steps, total)
    assert capsys.readouterr() == ("", f"walk: {told} in 0 s\n")


def test_a_quiet_run_shows_no_progress_but_its_warnings(capsys):
    shown = Progress("quiet")
    work(shown)
    assert capsys.readouterr() == ("", "")
    shown.warn("cut short")
    assert capsys.readouterr() == ("", "warning: cut short\n")


class Full(io.StringIO):
    """A stream on a full disk."""

    def write(self, text):
        raise OSError(errno.ENOSPC, "No space left on device")


@pytest.mark.parametrize("stderr", [None, Full()])
def test_a_line_that_nobody_can_read_is_dropped(stderr, monkeypatch, capsys):
    monkeypatch.setattr("sys.stderr", stderr)
    work(Progress("auto"))
    assert capsys.readouterr().out == ""


def test_a_note_is_a_line_unless_the_run_is_quiet(capsys):
    for style in ("plain", "json", "quiet"):
        Progress(style).note("took 9 joints")
    assert capsys.readouterr() == ("", 'took 9 joints\n{"note": "took 9 joints"}\n')


def test_json_progress_is_one_object_a_line_from_the_start_and_the_end_is_told_once(capsys, monkeypatch):
    monkeypatch.setattr(progress, "EVERY", {"plain": -1.0, "json": -1.0})
    shown = Progress("json")
    work(shown, steps=2, total=4)
    work(shown, steps=3, total=3)
    shown.warn("cut short")
    out, err = capsys.readouterr()
    *lines, last = [json.loads(line) for line in err.splitlines()]
    assert out == ""
    assert [line["done"] for line in lines] == [0, 1, 2, 2, 0, 1, 2, 3]
    assert all(line.keys() == {"task", "done", "total", "seconds", "seconds_left"} for line in lines)
    assert lines[0]["seconds_left"] is None
    assert last == {"warning": "cut short"}


def test_the_time_left_is_told_in_proportion(capsys, monkeypatch):
    now = iter([0.0, 6.0, 6.0, 12.0, 12.0, 13.0])  # begun; a step is over and it is written, twice; the end
    monkeypatch.setattr(progress.time, "monotonic", lambda: next(now))
    work(Progress("plain"), steps=2, total=6)
    first, second, last = capsys.readouterr().err.splitlines()
    assert first == "walk: 1 of 6 in 6 s"  # which may have been a compiler's
    assert second == "walk: 2 of 6 in 12 s, 24 s left"
    assert last == "walk: 2 of 6 in 13 s, 26 s left"


def test_a_task_that_fails_does_not_say_that_it_is_done(capsys):
    with pytest.raises(ValueError, match="no"), Progress("plain").task("walk", 3):
        raise ValueError("no")
    assert capsys.readouterr().err == ""


def test_automatic_is_plain_where_stderr_is_no_terminal():
    assert Progress("auto").style == "plain"


def test_a_name_on_the_bar_is_no_markup(capsys):
    with Progress("bar").task("take[/x] and clip[red].mp4", 3) as advance:
        advance()
    assert "take[/x] and clip[red].mp4" in capsys.readouterr().err


def test_the_bar_counts_to_the_end(capsys):
    work(Progress("bar"))
    assert "3/3" in capsys.readouterr().err
