"""Frames in, frames out, drawing."""
