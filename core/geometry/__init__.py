"""Questions about the geometry of meshes: which edges exist, which shapes are convex, which boxes meet."""
