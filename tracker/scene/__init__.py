"""A rendered walk whose poses are known."""
