"""Tests in a real Blender with a window."""
