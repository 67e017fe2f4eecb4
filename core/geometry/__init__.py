"""Geometry of meshes: edge topology, convexity, bounding boxes and intersecting pairs."""
