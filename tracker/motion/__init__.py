"""The motion commands: labels, forecasts, filled gaps and synthesis, as tables and pictures."""
