"""Draws the servo and horn models of the 3D view with numpy alone and writes them as GLB files."""
