"""Blender with a window: what the add-on does while an artist works."""
