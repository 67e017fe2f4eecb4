"""Geometry of meshes: edges and the faces along them, edges of several meshes in one place, and views of cameras."""
