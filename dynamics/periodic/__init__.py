"""The harmonic stride at work: learned, fitted to what was measured, and filling gaps."""
