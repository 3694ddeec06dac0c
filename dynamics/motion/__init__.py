"""What a learned model is asked: labels, forecasts, gaps, rates."""
