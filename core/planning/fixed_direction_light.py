"""Which light of emissive meshes is differentiated with its direction held, by the native engine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .._check import RAYS
from ..derivatives.motion import Motion
from ..scene import parameters
from ..scene.material import Material
from ..scene.mesh import Mesh
from ..scene.scene import Scene
from ..tables.materials import EMISSION, LAMBERTIAN, TRANSPARENCY, flags
from .specular import sharp_lobe, specular_materials

# Emissive faces of a mesh, and the alpha of lobes, from which on light holds its direction.
_LEAST_FACES, _ALPHA = 8, 0.25


@dataclass(frozen=True)
class HeldLight:
    """Light whose direction is held; the engine follows the same rule (hold_directions in scene/prepared.cpp).

    Attributes
    ----------
    meshes
        Names of the moving meshes that give it.
    materials
        Names of the materials that receive it.
    alone
        Whether nothing else of the picture's inside changes: what moves is black but for that light, and all that
        it lights receives it.
    """

    meshes: tuple[str, ...] = ()
    materials: tuple[str, ...] = ()
    alone: bool = False


def held_light(scene: Scene, moves: Motion, wrt: Sequence[str]) -> HeldLight:
    """Which light is, as the meshes of `moves` move with the parameters `wrt`."""
    used = set(scene.used_materials)
    closures = {name: scene.closures(name) for name in scene.materials}
    linked = any(light.receivers is not None or light.blockers is not None or not light.casts_shadow
                 for light in scene.lights.values())
    partly = any(not set(RAYS) <= mesh.visible_to for mesh in scene.meshes.values())
    uneven = any(_glows(parts) and not _glows_evenly(parts) for parts in closures.values())
    if lets_light_pass(scene) or linked or partly or uneven:
        return HeldLight()
    glows = {name: _glows(parts) for name, parts in closures.items()}
    meshes = tuple(name for name in moves.meshes if scene.meshes[name].instances is None
                   and int(_by_face(scene.meshes[name], glows).sum()) >= _LEAST_FACES)
    sharp = {name for name in used for c in closures[name] if not c.textures and sharp_lobe(c, _ALPHA)}
    if not meshes or not sharp:
        return HeldLight()
    vertices = all(parameters.split(path)[2] == "vertices" for path in wrt)
    black = {name: all(_is_black(closure) for closure in parts) for name, parts in closures.items()}
    emitters = all(name in meshes or not _by_face(scene.meshes[name], glows).any() for name in moves.meshes)
    dark = all(black[material] for name in moves.meshes for material in scene.meshes[name].used_materials)
    reached = all(name in sharp or black[name] for name in used)
    alone = vertices and emitters and dark and reached and not specular_materials(scene)
    return HeldLight(meshes, tuple(name for name in scene.materials if name in sharp), alone)


def lets_light_pass(scene: Scene) -> bool:
    """Whether some material is transparent."""
    return any(flags(closure) & TRANSPARENCY for name in scene.materials for closure in scene.closures(name))


def _glows(closures: list[Material]) -> bool:
    return any(flags(closure) & EMISSION for closure in closures)


def _glows_evenly(closures: list[Material]) -> bool:
    """Whether the light that a surface of these shaders gives is one constant."""
    layered = closures[0].coat_weight > 0.0 or closures[0].sheen_weight > 0.0
    return len(closures) == 1 and not closures[0].textures and not layered


def _by_face(mesh: Mesh, of_material: dict[str, bool]) -> np.ndarray:
    slots = np.array([of_material[name] for name in mesh.materials])
    return np.resize(slots[:1], len(mesh.faces)) if mesh.face_material is None else slots[mesh.face_material]


def _is_black(closure: Material) -> bool:
    return bool(flags(closure) & LAMBERTIAN) and not closure.textures and not np.any(closure.base_color > 0.0)
