"""Silhouettes of objects as pictures, whose derivatives the engine has.

The coverage of a pixel by some objects is its radiance in another scene: these objects emit 1, all others are black and
hide them as in the fit's scene, and nothing else gives light. Only light that is seen directly is computed, so the
derivative of coverage consists of the engine's terms of edges that the camera sees, and nothing is approximated.

Distance fields do not emit. If some of the objects are fields, the picture is the negative: the objects are black, and
the world and all else emit 1.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from .._fields import near
from ..rendering.renderer import Renderer
from ..scene import parameters
from ..scene.material import Material, Mixture
from ..scene.scene import Scene, World

# Parameters that move a silhouette, by collection. Opacities could too, but have no derivative here.
_SHAPE = {
    "meshes": ("vertices", "transform", "instances"),
    "fields": ("values", "transform"),
}


def moves_silhouettes(path: str) -> bool:
    """Whether the coverage of pixels depends on a parameter in a differentiable way."""
    collection, _, fieldname = parameters.split(path)
    return collection == "camera" or fieldname in _SHAPE.get(collection, ())


def is_negative(scene: Scene, objects: Iterable[str]) -> bool:
    """Whether the picture of the silhouette is 1 - coverage."""
    return any(name in scene.fields for name in objects)


def check_silhouette(where: str, scene: Scene, objects: Sequence[str]) -> None:
    """Refuse objects whose silhouette can't be rendered; ``ValueError`` names the object."""
    if not objects:
        raise ValueError(f"{where}: objects is empty; name at least one mesh or field")
    known: dict[str, Any] = {**scene.meshes, **scene.fields}
    for name in objects:
        if name not in known:
            raise ValueError(f"{where}: objects names '{name}', but there is no such mesh or field{near(name, known)}")
        if "camera" not in known[name].visible_to:
            raise ValueError(f"{where}: objects names '{name}', which is invisible to cameras and has no silhouette")
        used = known[name].materials if name in scene.meshes else (known[name].material,)
        if all(getattr(scene.materials.get(one), "kind", "") == "TRANSPARENT" for one in used):
            raise ValueError(f"{where}: objects names '{name}', whose material is Transparent, so that it has no "
                             "silhouette")  # fmt: skip
    other = next((name for name in scene.fields if name not in objects), None)
    if is_negative(scene, objects) and other is not None:
        raise ValueError(f"{where}: objects has a field but not the field '{other}'; the silhouette of some of several "
                         f"fields can't be rendered in this version; add '{other}', or remove it from the scene")


def silhouette_scene(scene: Scene, objects: frozenset[str]) -> Scene:
    """Return the scene whose picture is the coverage by these objects, or its negative (`is_negative`).

    Its arrays are those of the given scene.
    """
    negative = is_negative(scene, objects)
    materials: dict[str, Material | Mixture] = {}

    def flat(name: str, glows: bool) -> str:
        """Add a material that glows or is black, and return its name."""
        key = f"{name} ({'glows' if glows else 'black'})"
        if key not in materials:
            material = scene.materials[name]
            if isinstance(material, Mixture) and any(_lets_through(scene.materials[part]) for part in material.parts):
                materials[key] = replace(material, parts=tuple(flat(part, glows) for part in material.parts))
            elif isinstance(material, Mixture):
                materials[key] = _flat(Material(), glows)
            else:
                materials[key] = _flat(material, glows)
        return key

    return Scene(
        scene.camera,
        {name: replace(mesh, materials=tuple(flat(one, (name in objects) != negative) for one in mesh.materials),
                       normals=None, smoothing=None) for name, mesh in scene.meshes.items()},
        materials,
        world=World(np.full(3, float(negative))),
        images=scene.images,
        fields={name: replace(one, material=flat(one.material, False)) for name, one in scene.fields.items()},
    )  # fmt: skip


def _lets_through(material: Material | Mixture) -> bool:
    """Whether light passes through the surface in a straight line, as through a leaf that is cut out by its alpha."""
    if isinstance(material, Mixture) or material.kind == "TRANSPARENT":
        return True
    return material.kind == "PRINCIPLED" and (material.alpha < 1.0 or "alpha" in material.textures)


def _flat(material: Material, glows: bool) -> Material:
    if material.kind == "TRANSPARENT":
        colors = {key: value for key, value in material.textures.items() if key == "base_color"}
        return replace(material.as_surface(), emission=np.zeros(3), textures=colors)
    passes = _lets_through(material)
    return Material(
        np.zeros(3), np.full(3, float(glows)), alpha=material.alpha if passes else 1.0,
        textures={"alpha": material.textures["alpha"]} if passes and "alpha" in material.textures else {},
    )  # fmt: skip


class Silhouettes:
    """The scenes of all silhouettes of a fit, kept in step with the fit's scene."""

    def __init__(self, work: Scene, of: Iterable[frozenset[str]], paths: Sequence[str], threads: int,
                 engine: str) -> None:  # fmt: skip
        self._work = work
        wrt = [path for path in paths if moves_silhouettes(path)]
        self.renderers = {
            objects: Renderer(silhouette_scene(work, objects), threads=threads, engine=engine, learn=True, wrt=wrt,
                              watched=False) for objects in dict.fromkeys(of)
        }  # fmt: skip

    def update(self, changed: Sequence[str]) -> None:
        """Take over parameters of the fit's scene that have changed."""
        moved = [path for path in changed if moves_silhouettes(path) and not path.startswith("camera.")]
        if not moved:
            return
        for renderer in self.renderers.values():
            for path in moved:
                parameters.put(renderer.scene, path, parameters.get(self._work, path))
            renderer.update(moved)
