"""Harmonics of a phase: the basis B(phi) = [1, cos phi, sin phi, cos 2 phi, sin 2 phi, ..]."""

import numpy as np

from dynamics.gaussian import Array


def harmonics(phase: Array, size: int) -> Array:
    """(..., size) B of phases (...,) in radians; size = 2 H + 1."""
    order = np.arange(1, size // 2 + 1)
    out = np.ones((*np.shape(phase), size))
    out[..., 1::2] = np.cos(phase[..., None] * order)
    out[..., 2::2] = np.sin(phase[..., None] * order)
    return out


def slopes(phase: Array, size: int) -> Array:
    """(..., size) dB/dphi."""
    order = np.arange(1, size // 2 + 1)
    out = np.zeros((*np.shape(phase), size))
    out[..., 1::2] = -order * np.sin(phase[..., None] * order)
    out[..., 2::2] = order * np.cos(phase[..., None] * order)
    return out


def half_a_stride_on(size: int) -> Array:
    """(size,) factors that take coefficients of phi to those of phi + pi: odd harmonics change sign."""
    order = np.repeat(np.arange(1, size // 2 + 1), 2)
    return np.concatenate([[1.0], (-1.0) ** order])
