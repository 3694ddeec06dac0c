"""How many frames a film has for one at 30 a second, for which constants are given."""

import numpy as np

USUAL = 30.0  # frames a second


def often(fps: float) -> float:
    """Frames for each at the usual rate; 1 at lower rates, whose frames count as usual."""
    return max(fps / USUAL, 1.0)


def crowded(fps: float) -> float:
    """Factor on the spread of a frame's measurements, so that a second's count as at the usual rate."""
    return float(np.sqrt(often(fps)))
