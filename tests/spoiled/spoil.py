"""Ways to spoil a file: each takes what is asked for and gives what does it to a folder."""

import os
import re
import shutil

import numpy as np


def cut(name, share=0.5):
    """Only the first part is left."""
    return edited(name, lambda data: data[: int(share * len(data))])


def emptied(name):
    return written(name, b"")


def flipped(name, seed, count=1):
    """Single bits of it are turned, drawn from a seed."""
    return edited(name, lambda data: flip(data, np.random.default_rng(seed), count))


def flip(data, rng, count):
    """Bytes with single bits turned."""
    stored = np.frombuffer(data, np.uint8).copy()
    bits = np.left_shift(1, rng.integers(0, 8, count)).astype(np.uint8)
    np.bitwise_xor.at(stored, rng.integers(0, len(stored), count), bits)
    return stored.tobytes()


def encoded(name, encoding):
    """Its text in another encoding, with a letter in it that tells."""
    return edited(name, lambda data: (data.decode() + "é\n").encode(encoding))


def replaced(name, old, new, count=1):
    """Text for text, which must be there; `old` is a regular expression."""

    def edit(data):
        text, found = re.subn(old, new, data.decode(), count=count)
        assert found, f"{old} is not in {name}"
        return text.encode()

    return edited(name, edit)


def written(name, content):
    """Quite another content, bytes or text."""
    data = content if isinstance(content, bytes) else content.encode()

    def spoil(folder):
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(data)

    return spoil


def edited(name, change):
    """What a function makes of its bytes."""
    return lambda folder: (folder / name).write_bytes(change((folder / name).read_bytes()))


def removed(name):
    def spoil(folder):
        path = folder / name
        shutil.rmtree(path) if path.is_dir() else path.unlink()

    return spoil


def folder_instead(name):
    def spoil(folder):
        (folder / name).unlink(missing_ok=True)
        (folder / name).mkdir()

    return spoil


def file_instead(name):
    """A file where a folder was, or should be."""

    def spoil(folder):
        shutil.rmtree(folder / name, ignore_errors=True)
        (folder / name).write_text("mine\n")

    return spoil


def foreign_instead(name):
    """A folder of somebody else's."""

    def spoil(folder):
        shutil.rmtree(folder / name, ignore_errors=True)
        (folder / name).mkdir()
        (folder / name / "thesis.tex").write_text("years of work\n")

    return spoil


def piped(name):
    """A named pipe: no device that a test could harm, and as little to be replaced by a file."""
    return lambda folder: os.mkfifo(folder / name)


def linked(name, to):
    """A link to something else, which need not be there."""

    def spoil(folder):
        (folder / name).unlink(missing_ok=True)
        os.symlink(to, folder / name)

    return spoil


def copied(name, to):
    """Under another name."""
    return lambda folder: (folder / to).write_bytes((folder / name).read_bytes())


def renamed(names):
    """Files or folders under other names, by their old ones."""

    def spoil(folder):
        for old, new in names.items():
            (folder / old).rename(folder / new)

    return spoil


def nothing(folder):
    """All is as it should be: what is asked for is not."""
