"""Words for tables that cannot be read."""

import csv

import pytest

from tracker.tables.unreadable import misread, unreadable, why


def failure(path, **how):
    """What reading a file raises."""
    with (
        pytest.raises((OSError, UnicodeDecodeError, csv.Error)) as caught,
        path.open(newline="", **how) as file,
    ):
        list(csv.reader(file))
    return caught.value


def test_nothing_that_python_adds_is_said(tmp_path):
    assert why(failure(tmp_path / "absent.csv")) == "No such file or directory"
    assert why(failure(tmp_path)) == "Is a directory"
    (tmp_path / "k.csv").write_bytes(b"a,b\n\xff")
    assert why(failure(tmp_path / "k.csv", encoding="utf-8")) == "byte 4 is no UTF-8"
    (tmp_path / "k.csv").write_text("9" * 200_000)
    assert why(failure(tmp_path / "k.csv")) == "field larger than field limit (131072)"


def test_the_line_names_the_file_the_reason_and_what_to_do(tmp_path):
    said = unreadable("k.csv", failure(tmp_path))
    assert said == "cannot read k.csv as a UTF-8 CSV table (Is a directory); save it as one"


@pytest.mark.parametrize(
    ("header", "word"),
    [(["a;b"], "semicolons"), (["a\tb"], "tabs"), (["a", "b"], None), (["a;b", "c"], None), ([], None)],
)
def test_other_separators_than_commas_are_named(header, word):
    assert (misread("k.csv", header) or "k.csv has None").split()[2] == str(word)
