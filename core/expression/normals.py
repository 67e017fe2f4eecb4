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
class AtHitPoint(Expression):
    """A value at the hit point, also where a bump evaluates its height at points beside it.

    So a height that depends on this value alone has no slope. Cycles has it so for Camera Data and Tangent nodes.
    """

    value: Operand


@dataclass(frozen=True)
class DisplacedBump(Expression):
    """The normal of a mesh whose vertices are displaced, bent by the same displacement: *Displacement and Bump*.

    Cycles takes the slopes of the height on the surface before displacement: a step beside the hit point is a step
    between the points that lay there before. It computes the normal in the object's space, from the smooth normal
    before displacement, which such meshes keep. Here the object's transform is a rotation with a uniform scale, and
    follows from the hit face: the face has its place after displacement also as an attribute.

    Attributes
    ----------
    height
        Height above the surface, metres.
    step
        As in `Bump`.
    before, after
        Position of the hit point before and after displacement, in the object's space.
    side
        -1 if the object is mirrored, else 1.
    """

    height: Operand
    step: Operand
    before: Operand
    after: Operand
    side: Operand = 1.0


@dataclass(frozen=True)
class DisplacedPosition(Expression):
    """The position before displacement, as heights of a `DisplacedBump` read it; its operands are those of the bump.

    Beside the hit point, Cycles does not stay on the surface before displacement: it goes along the tangents of the
    displaced surface, by the mean length of the steps before displacement.
    """

    before: Operand
    after: Operand


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
