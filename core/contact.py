"""Between which meshes the direction of light is held where they nearly touch, by the native engine."""

from __future__ import annotations

from itertools import permutations

from .held_light import HeldLight, lets_light_pass
from .light import turns_with_point
from .motion import Motion
from .primary_plan import is_stepped
from .scene import Scene
from .shadow_plan import is_bent
from .specular_plan import specular_materials


def touching_meshes(scene: Scene, moves: Motion, held: HeldLight, max_depth: int) -> list[tuple[str, str]]:
    """Pairs of names: on the first mesh light of the second may be held, as something of `moves` moves.

    Where surfaces nearly touch and move along each other, derivatives of light that rides on one of them have no
    variance on the other (native/scene/contact.h; the engine follows the same rule, contact_meshes.cpp). `held` is
    light that holds its direction everywhere.
    """
    if max_depth < 2 or held.meshes or lets_light_pass(scene) or not (moves.meshes or moves.camera):
        return []
    leaves = {name: scene.leaves(name) for name in scene.materials}
    perfect = set(specular_materials(scene))
    jumping = {name for name, parts in leaves.items()
               if any(is_stepped(texture) for leaf in parts for texture in leaf.textures.values())}
    turning = any(map(turns_with_point, scene.lights.values()))
    plain = {name: mesh for name, mesh in scene.meshes.items()
             if perfect.isdisjoint(mesh.used_materials) and not (turning and is_bent(scene, name))}
    return [(one, other) for one, other in permutations(plain, 2)
            if jumping.isdisjoint(plain[other].used_materials) and (max_depth > 2 or scene.emits(other))]
