"""Registration of templates in a frame."""
