"""The film as a whole, before anything is followed: the camera's path, the scene, and what stands before it."""
