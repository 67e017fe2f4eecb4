"""What the tests share: scenes, meshes, statistics, and the judges of other renderers."""
