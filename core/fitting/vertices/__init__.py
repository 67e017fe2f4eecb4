"""Vertices of meshes as variables of a fit: what they may do, their steps, and which steps keep a surface clean."""
