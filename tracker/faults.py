"""What keeps work from being done, as against a mistake of ours."""

from dynamics.store import ModelError
from tracker.folder import FolderError
from videos.frames import VideoError


def fault(error: Exception) -> str | None:
    """What kept the work from being done, in one line; None if that is a mistake of ours."""
    if isinstance(error, OSError) and error.filename:
        return f"{error.strerror or error}: {error.filename}"
    expected = isinstance(error, OSError | ModelError | FolderError | VideoError | ValueError)
    return str(error) if expected else None
