"""The scene as the user writes it: meshes, materials, lights, camera, world, and the paths of their parameters."""
