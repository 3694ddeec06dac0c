"""Reading frames of videos, writing them, and drawing on them."""
