"""What keeps work from being done, as against a mistake of ours."""

import errno

from numpy.linalg import LinAlgError

from dynamics.store import ModelError
from tracker.progress import plain
from tracker.run.folder import FolderError
from videos.frames import VideoError

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def fault(error: Exception) -> str | None:
    """What kept the work from being done, in one line; None if that is a mistake of ours."""
    if isinstance(error, MemoryError):
        return "there is not enough memory for this; give a smaller video or table"
    if isinstance(error, OSError):
        text = error.strerror or str(error)
        if error.errno in FULL:
            return plain(f"no room to write ({text}); make some, or choose another --out")
        return plain(f"{text}: {error.filename}" if error.filename else text)
    expected = isinstance(error, ModelError | FolderError | VideoError | ValueError)
    return plain(str(error)) if expected and not isinstance(error, LinAlgError) else None
