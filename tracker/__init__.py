"""The tracker: templates, registration, the loop, comparison, command line."""

__version__ = "0.1.0"
