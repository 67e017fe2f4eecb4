"""Between which meshes the direction of light is held where they nearly touch, by the native engine."""

from __future__ import annotations

from collections.abc import Callable
from itertools import permutations

from .held_light import HeldLight
from .light import PointLight, SpotLight
from .material import Material
from .material_table import NORMAL_MAP, TRANSPARENCY, flags
from .mesh import Mesh
from .motion import Motion
from .primary_plan import is_stepped
from .scene import Scene
from .specular_plan import may_be_specular


def touching_meshes(scene: Scene, moves: Motion, held: HeldLight, max_depth: int) -> list[tuple[str, str]]:
    """Pairs of names: on the first mesh light of the second may be held, as something of `moves` moves.

    Where surfaces nearly touch and move along each other, derivatives of light that rides on one of them have no
    variance on the other (native/scene/contact.h; the engine follows the same rule, contact_meshes.cpp). `held` is
    light that holds its direction everywhere.
    """
    leaves = {name: scene.leaves(name) for name in scene.materials}
    clear = any(flags(leaf) & TRANSPARENCY for parts in leaves.values() for leaf in parts)
    if max_depth < 2 or held.meshes or clear or not (moves.meshes or moves.camera):
        return []
    def named(is_such: Callable[[Material], object]) -> set[str]:
        return {name for name, parts in leaves.items() if any(map(is_such, parts))}

    perfect, mapped = named(may_be_specular), named(lambda leaf: flags(leaf) & NORMAL_MAP)
    jumping = named(lambda leaf: any(map(is_stepped, leaf.textures.values())))
    disks = any(isinstance(light, PointLight | SpotLight) and light.radius > 0.0 and not light.sphere
                for light in scene.lights.values())
    plain = {name: mesh for name, mesh in scene.meshes.items() if perfect.isdisjoint(mesh.used_materials)
             and not (disks and (_is_smooth(mesh) or not mapped.isdisjoint(mesh.used_materials)))}
    return [(one, other) for one, other in permutations(plain, 2)
            if jumping.isdisjoint(plain[other].used_materials) and (max_depth > 2 or scene.emits(other))]


def _is_smooth(mesh: Mesh) -> bool:
    return mesh.smoothing is not None and bool((mesh.smoothing >= 0).any())
