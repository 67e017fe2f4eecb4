"""Expressions beside the shader nodes that they stand for, by groups of nodes."""

from tests.support.node_cases.images import image_pixels, images, shading
from tests.support.node_cases.tables import ranges, tables
from tests.support.node_cases.textures import textures
from tests.support.node_cases.values import colors, inputs, mapping, math, mix, vector_math

__all__ = [
    "colors", "image_pixels", "images", "inputs", "mapping", "math", "mix", "ranges", "shading", "tables", "textures",
    "vector_math",
]  # fmt: skip
