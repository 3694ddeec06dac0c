"""Reports: the film with the figure, angles, gait figures, and comparisons of models and runs."""
