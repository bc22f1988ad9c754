"""The 3D scene of horns in viser, and its same-origin proxy."""
