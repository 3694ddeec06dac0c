"""The tracker: a figure followed through a clip, its reports, and the command line."""

from tracker.api import follow

__all__ = ["follow"]
__version__ = "0.2.0"
