"""Many clips followed, each by itself."""
