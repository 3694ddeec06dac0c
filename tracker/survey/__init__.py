"""The film as a whole, before anything is followed: camera, scene and foreground."""
