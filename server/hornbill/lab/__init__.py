"""Measured motion: step tests and their metrics."""
