"""Figures, poses, the scaled prismatic model, motion capture."""
