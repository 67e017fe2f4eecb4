"""Edgegrad as a render engine of Blender: final renders with passes, and the rendered view of 3D views."""
