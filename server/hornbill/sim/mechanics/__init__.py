"""The horn, its load and its environment, in fixed steps."""
