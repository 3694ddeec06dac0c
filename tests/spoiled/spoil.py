"""Ways to spoil a file: each does it to a path, or takes what it needs and gives what does it."""

import os
import re
import shutil

import numpy as np


def nothing(path):
    """All is as it should be: what is asked for is not."""


def emptied(path):
    path.write_bytes(b"")


def removed(path):
    shutil.rmtree(path) if path.is_dir() else path.unlink()


def piped(path):
    """A pipe that nobody writes to."""
    path.unlink()
    os.mkfifo(path)


def folder_instead(path):
    path.unlink(missing_ok=True)
    path.mkdir()


def file_instead(path):
    """A file where a folder was, or should be."""
    shutil.rmtree(path, ignore_errors=True)
    path.write_text("mine\n")


def foreign_instead(path):
    """A folder of somebody else's."""
    shutil.rmtree(path, ignore_errors=True)
    path.mkdir()
    (path / "thesis.tex").write_text("years of work\n")


def cut(share=0.5):
    """Only the first part is left."""
    return edited(lambda data: data[: int(share * len(data))])


def flipped(seed, count=1):
    """Single bits of it are turned, drawn from a seed."""
    return edited(lambda data: flip(data, np.random.default_rng(seed), count))


def flip(data, rng, count):
    """Bytes with single bits turned."""
    stored = np.frombuffer(data, np.uint8).copy()
    bits = np.left_shift(1, rng.integers(0, 8, count)).astype(np.uint8)
    np.bitwise_xor.at(stored, rng.integers(0, len(stored), count), bits)
    return stored.tobytes()


def encoded(encoding):
    """Its text in another encoding, with a letter in it that tells."""
    return edited(lambda data: (data.decode() + "é\n").encode(encoding))


def replaced(old, new, count=1):
    """Text for text, which must be there; `old` is a regular expression."""

    def edit(data):
        text, found = re.subn(old, new, data.decode(), count=count)
        assert found, f"{old} is not there"
        return text.encode()

    return edited(edit)


def separated(by):
    """Another separator than a comma."""
    return edited(lambda data: data.replace(b",", by))


def written(content):
    """Quite another content, bytes or text."""
    data = content if isinstance(content, bytes) else content.encode()
    return lambda path: path.write_bytes(data)


def edited(change):
    """What a function makes of its bytes."""
    return lambda path: path.write_bytes(change(path.read_bytes()))


def copied(source):
    """The content of another file of the folder."""
    return lambda path: path.write_bytes((path.parent / source).read_bytes())


def linked(to):
    """A link to something else, which need not be there."""

    def spoil(path):
        path.unlink(missing_ok=True)
        os.symlink(to, path)

    return spoil


def renamed(**names):
    """Files or folders of a folder under other names; a suffix stands behind _ in the old one."""

    def spoil(folder):
        for old, new in names.items():
            (folder / new).parent.mkdir(exist_ok=True)
            (folder / old.replace("_", ".")).rename(folder / new)

    return spoil
