"""Scenes in Blender whose properties move their pictures."""
