"""Shared code of the tests: scenes, meshes, statistics, and comparisons with other renderers."""
