"""The scene as its user writes it: meshes, materials, lights, camera, world, and the paths that name their numbers."""
