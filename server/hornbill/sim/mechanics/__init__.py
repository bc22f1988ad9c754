"""The horn, its load and its surroundings, in fixed steps."""
