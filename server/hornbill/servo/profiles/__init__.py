"""Named sets of values, comparison and restore."""
