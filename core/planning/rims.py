"""Rims of the transmission lobes of rough glass, in words: what is computed as they move, and what is left out.

Microfacets are never turned away from their surface, so that beyond some angle about its normal no light is refracted
towards the viewer, and just before it some is. The native engine follows the same rule (`rims_move` of
``native/engine/interior_rules.cpp``).
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import TYPE_CHECKING

from ..scene.light import has_size
from ..scene.material import Material
from ..scene.scene import Scene
from ..tables.materials import REFRACTION, flags
from .specular import asks_bending

if TYPE_CHECKING:
    from ..derivatives.motion import Motion


def rough_glass(scene: Scene) -> list[str]:
    """Names of the materials of some mesh that may refract roughly somewhere."""
    return [name for name in scene.used_materials if any(_may_refract_roughly(c) for c in scene.closures(name))]


def _may_refract_roughly(closure: Material) -> bool:
    return bool(flags(closure) & REFRACTION) and (closure.roughness > 0.0 or "roughness" in closure.textures)


def _moving_rims(scene: Scene, moves: Motion, wrt: Collection[str], max_depth: int) -> list[str]:
    """Names of the materials whose lobes' rims may move."""
    if max_depth < 2:
        return []
    materials = rough_glass(scene)
    return materials if moves.any or asks_bending(scene, materials, wrt) else []


def rim_rule(scene: Scene, moves: Motion, wrt: Collection[str], max_depth: int) -> str | None:
    """What is computed of rims; None: none moves."""
    materials = _moving_rims(scene, moves, wrt, max_depth)
    if not materials:
        return None
    return f"besides: the directions at which rough glass ({', '.join(materials)}) stops to let light through"


def missing_rims(scene: Scene, moves: Motion, wrt: Collection[str], max_depth: int) -> Iterator[str]:
    """Sentences on rims that nothing computes: of lights without size they are lines on the glass."""
    materials = _moving_rims(scene, moves, wrt, max_depth)
    lights = [name for name, light in scene.lights.items()
              if not has_size(light) and "transmission" in light.visible_to]
    if materials and lights:
        yield (f"lines on rough glass ({', '.join(materials)}) where it stops to let light through of lights without "
               f"size ({', '.join(lights)})")
