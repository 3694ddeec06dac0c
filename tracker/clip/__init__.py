"""A clip followed from its first frame to its last."""
