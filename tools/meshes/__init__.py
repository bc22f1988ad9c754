"""Draws the servo and horn models of the 3D view and writes them as GLB files."""
