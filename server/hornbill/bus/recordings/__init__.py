"""Recordings: writing, reading, playing, and the folders they are kept in."""
