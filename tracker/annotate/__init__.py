"""The marking page: its frames, table, advice and server."""
