"""Uses of a learned model: labels, forecasts, gaps, other frame rates."""
