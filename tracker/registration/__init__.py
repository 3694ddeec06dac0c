"""Where templates settle in a frame."""
