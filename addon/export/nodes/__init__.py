"""Translation of node trees to expressions: links, values, colours, textures, normals and images."""

from . import read_colors, read_inputs, read_normals, read_textures  # noqa: F401  (they register the node types)
