"""The harmonic stride: learning it, fitting it to measurements, filling gaps."""
