"""Blender scenes for the comparison with Cycles, each built by a script. Importing needs bpy.

`CASES` has them by name. A module holds one family; its builders are marked with `case`.
"""

from __future__ import annotations

from . import (  # noqa: F401  (importing a family registers its cases)
    as_found,
    bump,
    cameras,
    coincident,
    default_surfaces,
    dielectric,
    diffuse,
    displacement,
    distributions,
    emissive_meshes,
    evaluation,
    exterior,
    geometry,
    glass,
    hair,
    instancing,
    interior,
    lamp_settings,
    lamps,
    layers,
    linking,
    media,
    metals,
    node_groups,
    old_materials,
    procedural,
    render_settings,
    shader_trees,
    sky,
    textures,
    worlds,
)
from .case import CASES, Case

__all__ = ["CASES", "Case"]
