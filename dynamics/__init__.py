"""Switching linear dynamic systems: inference, learning, files."""
