"""Translation of node trees to expressions: links, values, colours, textures, normals and images."""

from . import (  # noqa: F401  (they register the node types)
    read_colors,
    read_displacement,
    read_inputs,
    read_mappings,
    read_normals,
    read_tangents,
    read_textures,
)
