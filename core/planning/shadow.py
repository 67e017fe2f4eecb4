"""What the shadow boundary term has besides edges, and what it leaves out, in words."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .._check import RAYS
from ..derivatives.motion import Motion
from ..scene.light import has_size, turns_with_point
from ..scene.names import listed
from ..scene.scene import Scene
from ..tables.materials import NORMAL_MAP, flags


def horizon_rule(scene: Scene, moves: Motion, max_depth: int) -> tuple[bool, str]:
    """Whether faces that are shaded with other normals than their own may cut off other light than before, in words.

    The native engine follows the same rule (horizons_move in derivative_call.cpp).
    """
    bent = bent_meshes(scene)
    if not bent:
        return False, "skipped: horizons, since no mesh is shaded with other normals than those of its faces"
    sized = [name for name, light in scene.lights.items() if has_size(light)]
    lit = [f"the lights {listed(sized)}"] if sized else []
    if scene.emitters:
        lit.append("emissive meshes")
    if np.any(scene.world.color * scene.world.strength):
        lit.append("the sky")
    if max_depth > 2:
        lit.append("other surfaces")
    if not lit:
        return False, "skipped: horizons, since all lights are without size: where faces cut them off is at edges"
    turning = any(map(turns_with_point, scene.lights.values()))
    if not (moves.meshes or moves.sky or set(sized) & set(moves.lights) or (moves.camera and turning)):
        return False, "skipped: horizons, since neither surfaces nor what lights them moves"
    of = " and ".join([", ".join(lit[:-1]), lit[-1]] if lit[1:] else lit)
    return True, f"besides edges: the horizons of the faces of {listed(bent)}, where they cut off light of {of}"


def bent_meshes(scene: Scene) -> list[str]:
    """Meshes that may be shaded with other normals than those of their faces."""
    mapped = {name for name in scene.materials if any(flags(closure) & NORMAL_MAP for closure in scene.closures(name))}
    turned = set(scene.meshes_with(mapped))
    return [name for name, mesh in scene.meshes.items() if mesh.smoothing is not None or name in turned]


def missing_shadows(scene: Scene, moves: Motion) -> Iterator[str]:
    """Sentences on jumps of direct light that no edge carries: nothing computes them."""
    sized = any(has_size(light) for light in scene.lights.values())
    sized = sized or bool(scene.emitters)
    sky = bool(np.any(scene.world.color * scene.world.strength))
    scattered = set(RAYS) - {"camera"}
    partly = [name for name, mesh in scene.meshes.items() if 0 < len(scattered & mesh.visible_to) < len(scattered)]
    if partly and (sized or sky):
        yield (f"shadows of {listed(partly)}, which only some kinds of rays meet: taken as those of shadow rays, or "
               "of diffuse ones under a sky of one colour")
