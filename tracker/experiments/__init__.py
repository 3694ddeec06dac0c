"""The papers' experiments on a user's captures, on one page."""
