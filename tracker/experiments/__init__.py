"""The papers' experiments on somebody's captures, on one page."""
