"""Tests of fits of any animatable property of Blender, and of vertices under modifiers."""
