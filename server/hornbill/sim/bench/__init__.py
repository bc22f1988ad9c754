"""Simulated servos on an event loop."""
