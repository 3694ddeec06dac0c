"""A frame on its own: planes, tones, camera, background."""
