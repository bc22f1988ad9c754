"""Materials of the models: colours as seen on screen, metalness and roughness."""

from tools.meshes.gltf import Material

CAP = Material("cap", (43, 47, 53), 0.35, 0.46)
"""Bottom and top of the case: dark anodised."""
BODY = Material("body", (128, 134, 141), 0.92, 0.40)
"""Middle of the case and its ears: blasted aluminium."""
PLAIN = Material("plain", (104, 110, 117), 0.85, 0.5)
"""The same, for distant models."""
PLATE = Material("plate", (176, 182, 188), 0.95, 0.36)
"""The name plate."""
MARK = Material("mark", (28, 31, 35), 0.2, 0.6)
"""Engraving of the name plate."""
INDEX = Material("index", (236, 239, 241), 0.0, 0.5)
"""Line on the case that marks 0°."""
STEEL = Material("steel", (168, 173, 178), 1.0, 0.27)
BLACK = Material("black", (26, 28, 31), 0.1, 0.55)
"""Screws of the case, seal of the bearing."""
BRASS = Material("brass", (206, 166, 88), 1.0, 0.26)
RUBBER = Material("rubber", (24, 25, 27), 0.0, 0.72)
HORN = Material("horn", (163, 166, 169), 0.0, 0.34)
CONTACT = Material("contact", (255, 255, 255), 0.0, 1.0, shadow=True)
"""Shadow on the floor around a case."""
