"""Tests of the Blender add-on."""
