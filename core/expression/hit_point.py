"""Nodes of values at the surface point that a ray has hit."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from .nodes import Expression, Operand, nodes_of

COORDINATES = ("POSITION", "NORMAL", "TRUE_NORMAL", "INCOMING", "REFLECTION")
LIGHT_PATHS = ("CAMERA", "DIFFUSE", "GLOSSY", "TRANSMISSION", "SHADOW")
BOUNCES = ("ALL", "DIFFUSE", "GLOSSY", "TRANSMISSION", "TRANSPARENT")


@dataclass(frozen=True)
class Attribute(Expression):
    """An interpolated attribute of the mesh or field (UV map, colour, other values); 0 if that does not have it.

    Attributes of one value repeat it; two values become (u, v, 0, 1), three become (x, y, z, 1).

    Attributes
    ----------
    required
        True: a scene is invalid if no mesh or field with the material has the attribute. False: a missing attribute is
        0, as in Blender.
    is_position
        Whether the attribute is a position of the surface. `Bump` takes the slope of positions on both sides of a
        surface alike. Bumps of other attributes that rise on the front sink on the back, as in Cycles.
    """

    name: str
    required: bool = field(default=True, compare=False)
    is_position: bool = False


@dataclass(frozen=True)
class Coordinates(Expression):
    """A geometric vector at the hit point, in world space.

    Attributes
    ----------
    kind
        ``"POSITION"``: the hit point, metres. ``"NORMAL"`` (smooth, without normal maps) and ``"TRUE_NORMAL"`` (of
        the triangle): unit normals on the viewer's side. ``"INCOMING"``: unit vector towards the origin of the
        ray. ``"REFLECTION"``: the incoming vector, reflected about the normal. Generated and object coordinates
        are attributes.
    """

    kind: str
    choices: ClassVar = {"kind": COORDINATES}


@dataclass(frozen=True)
class Backfacing(Expression):
    """1 if the ray has hit the back (clockwise) side, else 0."""


@dataclass(frozen=True)
class LightPath(Expression):
    """1 for rays of one kind, else 0.

    Light sampling evaluates emission for no kind at all, as Cycles does. So emission for diffuse rays, say, is found
    only by the share of diffuse rays that multiple importance sampling leaves to rays that meet the surface.

    Attributes
    ----------
    kind
        ``"CAMERA"``, ``"DIFFUSE"``, ``"GLOSSY"``, ``"TRANSMISSION"`` or ``"SHADOW"``.
    """

    kind: str
    choices: ClassVar = {"kind": LIGHT_PATHS}


@dataclass(frozen=True)
class RayBounces(Expression):
    """Number of bounces of a path before its ray meets the surface, as Cycles counts them.

    Rays to lights count those of the surface that they leave, and themselves under ``"ALL"``. Surfaces on the way of
    shadow rays, points of emitters that light sampling finds, and the boundary terms of derivatives count the last
    bounce only.

    Attributes
    ----------
    kind
        ``"ALL"`` (without transparent surfaces), ``"DIFFUSE"``, ``"GLOSSY"``, ``"TRANSMISSION"`` or
        ``"TRANSPARENT"``.
    """

    kind: str
    choices: ClassVar = {"kind": BOUNCES}


@dataclass(frozen=True)
class RayLength(Expression):
    """Distance from where the ray was scattered last, past transparent surfaces; 0 for shadow rays.

    Camera rays start at the camera's position or lens, not at its near plane.
    """


@dataclass(frozen=True)
class Fresnel(Expression):
    """Reflectance of a smooth dielectric in the direction of the incoming ray.

    Attributes
    ----------
    ior
        Index of refraction relative to the outside; its inverse is used on back faces.
    normal
        Unit vector, or None for the smooth normal.
    """

    ior: Operand = 1.5
    normal: Operand | None = None


@dataclass(frozen=True)
class LayerWeight(Expression):
    """Weight from the angle between the normal and the direction to the viewer.

    Attributes
    ----------
    output
        ``"FRESNEL"`` or ``"FACING"``.
    """

    output: str
    blend: Operand = 0.5
    normal: Operand | None = None
    choices: ClassVar = {"output": ("FRESNEL", "FACING")}


def required_attributes(node: Expression) -> set[str]:
    """Names of the attributes that at least one mesh or field with the material must have."""
    return {found.name for found in nodes_of(node) if isinstance(found, Attribute) and found.required}
