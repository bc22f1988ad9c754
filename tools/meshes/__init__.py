"""Servo and horn models of the 3D view, written as GLB files."""
