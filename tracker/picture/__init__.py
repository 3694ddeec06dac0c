"""What a frame shows, before any figure is laid on it."""
