"""The page on which joints are marked: its frames, its table, its advice and its server."""
