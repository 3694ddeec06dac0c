"""Strides and gait figures."""
