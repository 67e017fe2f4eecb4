"""Geometry that Cycles makes while it renders: hair, points, displaced vertices; and faces that lie on each other."""
