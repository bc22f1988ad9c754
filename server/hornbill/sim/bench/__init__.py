"""Simulated servos at work on an event loop."""
