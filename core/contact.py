"""Between which meshes the direction of light is held where they nearly touch, by the native engine."""

from __future__ import annotations

from itertools import permutations

from .held_light import HeldLight
from .material_table import NORMAL_MAP, TRANSPARENCY, flags
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
    bends = {name for name, parts in leaves.items()
             if any(flags(leaf) & NORMAL_MAP or may_be_specular(leaf) for leaf in parts)}
    jumping = {name for name, parts in leaves.items()
               if any(is_stepped(texture) for leaf in parts for texture in leaf.textures.values())}
    flat = [name for name, mesh in scene.meshes.items() if (mesh.smoothing is None or bool((mesh.smoothing < 0).all()))
            and bends.isdisjoint(mesh.used_materials)]
    return [(one, other) for one, other in permutations(flat, 2)
            if jumping.isdisjoint(scene.meshes[other].used_materials) and (max_depth > 2 or scene.emits(other))]
