"""The figure as a silhouette: gait cycles, the best path through them, each frame's pose by its outline."""
