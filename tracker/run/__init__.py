"""A finished run and its folder."""
