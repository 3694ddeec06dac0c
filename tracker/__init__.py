"""The tracker: templates, registration, the loop, comparison, command line."""

from tracker.api import follow

__all__ = ["follow"]
__version__ = "0.2.0"
