"""The figure as a silhouette: gait cycles, the best path through them, every frame's pose on its outline."""
