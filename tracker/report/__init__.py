"""report.html: the overlays under one slider, angles, gait figures, and how models compare."""
