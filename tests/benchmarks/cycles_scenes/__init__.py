"""Blender scenes for the comparison with Cycles, each built by a script. Importing needs bpy.

`CASES` has them by name. A module holds one family; its builders are marked with `case`.
"""

from __future__ import annotations

from . import (  # noqa: F401  (importing a family registers its cases)
    cameras,
    coincident,
    dielectric,
    diffuse,
    displacement,
    emissive_meshes,
    evaluation,
    exterior,
    geometry,
    glass,
    hair,
    instancing,
    interior,
    lamps,
    layers,
    linking,
    metals,
    procedural,
    shader_trees,
    sky,
    textures,
)
from .case import CASES, Case

__all__ = ["CASES", "Case"]
