"""Ways of a camera over a scene, and how exactly the camera's shift should be found."""

import numpy as np

# Four tenths of a pixel of the small picture, which is 320 wide, of videos 640 wide.
NEAR = 0.8


def sway(T, speed, period):
    """(T, 2) back and forth at up to this many pixels a frame, a third of it up and down."""
    turn = 2.0 * np.pi * np.arange(T) / period
    reach = speed * period / (2.0 * np.pi)
    return reach * np.stack([np.sin(turn), (np.cos(turn) - 1.0) / 3.0], axis=1)
