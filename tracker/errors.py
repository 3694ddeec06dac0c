"""Errors that users cause or can resolve, as opposed to bugs of the program."""

import errno

from numpy.linalg import LinAlgError

from dynamics.store import ModelError
from tracker.progress import plain
from tracker.run.folder import FolderError
from videos.container import VideoError

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def fault(error: Exception) -> str:
    """The error as one line for the user; a bug of the program is raised."""
    if isinstance(error, MemoryError):
        return "there is not enough memory for this; give a smaller video or table"
    if isinstance(error, OSError):
        text = error.strerror or str(error)
        if error.errno in FULL:
            return plain(f"no room to write ({text}); make some, or choose another --out")
        shorter = "; choose a shorter one" if error.errno == errno.ENAMETOOLONG else ""
        return plain((f"{text}: {error.filename}" if error.filename else text) + shorter)
    expected = isinstance(error, ModelError | FolderError | VideoError | ValueError)
    if not expected or isinstance(error, LinAlgError):
        raise error
    return plain(str(error))
