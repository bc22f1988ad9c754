"""Measured motion: step tests and the numbers made of them."""
