"""Shading normals as expressions: bump and normal maps. Their values are unit vectors in world space."""

from __future__ import annotations

from dataclasses import dataclass

from .nodes import Expression, Operand


@dataclass(frozen=True)
class Bump(Expression):
    """The normal of a surface that is displaced by a height: Blender's Bump node (Mikkelsen 2010).

    The slope of the height is a finite difference: the height is also evaluated at two points beside the hit point, at
    a distance of `step`. Attributes and positions are extended linearly from the hit face to these points. Other
    values, such as normals and directions, are those of the hit point.

    Attributes
    ----------
    height
        Height above the surface, in units of `distance`.
    strength
        0: `normal`; 1: the bent normal; they are mixed in between.
    distance
        Factor of the height, metres.
    step
        Distance of the points at which the height is evaluated, metres, > 0. Cycles uses a tenth of a pixel
        (*Filter Width*). Details of the height that are smaller than the step are rendered with less contrast.
    normal
        Unit vector that is bent, or None for the smooth normal.
    invert
        Whether the height points into the surface.
    """

    height: Operand
    strength: Operand = 1.0
    distance: Operand = 1.0
    step: Operand = 1e-4
    normal: Operand | None = None
    invert: bool = False


@dataclass(frozen=True)
class NormalMap(Expression):
    """The normal of a normal map in tangent space: Blender's Normal Map node.

    Attributes
    ----------
    color
        Colour of the normal map; (0.5, 0.5, 1) is the smooth normal.
    strength
        As `Material.normal_strength`.
    uv
        UV map that defines the tangents, as `Material.normal_uv`. Meshes without it have the smooth normal.
    """

    color: Operand
    strength: Operand = 1.0
    uv: str = "UVMap"
