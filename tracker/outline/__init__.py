"""The figure as a silhouette: gait cycles, a best path through them, and every frame's pose on its outline."""
