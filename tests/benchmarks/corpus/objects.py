"""Which object of a scene to change, for benchmarks that move or recolour one object of each scene of the corpus."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad.scene import parameters
from edgegrad.scene.placement import placed_meshes

# Objects that cover less of the picture say little; those that cover more are floors and walls.
LEAST_SHARE, MOST_SHARE = 0.01, 0.4


@dataclass(frozen=True)
class Candidate:
    """A mesh of the scene, the part of the picture that it covers, and its box in world space."""

    name: str
    share: float
    low: NDArray[np.float64]
    high: NDArray[np.float64]

    @property
    def diagonal(self) -> float:
        """Length of the diagonal of the box."""
        return float(np.linalg.norm(self.high - self.low))


def candidates(scene: edgegrad.Scene) -> list[Candidate]:
    """Return the meshes that cover a moderate part of the picture, the largest first; emissive ones are left out."""
    found = []
    for (name, mesh), placed in zip(scene.meshes.items(), placed_meshes(scene), strict=True):
        if scene.emits(name) or mesh.instances is not None or not len(mesh.faces):
            continue
        share = _share(scene, name)
        if LEAST_SHARE <= share <= MOST_SHARE:
            found.append(Candidate(name, share, placed.vertices.min(axis=0), placed.vertices.max(axis=0)))
    return sorted(found, key=lambda one: -one.share)


def clear_of_others(scene: edgegrad.Scene, one: Candidate, share: float) -> NDArray[np.float64]:
    """(3,) shift like `sideways`, to the right or to the left: where more of the object is seen.

    An object that starts behind another one, or inside it, has no gradient by what it hides there.
    """
    path = f"meshes.{one.name}.transform"
    truth = np.array(parameters.get(scene, path), np.float64)
    right = sideways(scene, one, share)
    across = scene.camera.to_world[:3, 0]
    left = right - 2.0 * (right @ across) * across
    seen = []
    for shift in (right, left):
        moved = truth.copy()
        moved[:3, 3] += shift
        parameters.put(scene, path, moved)
        seen.append(_share(scene, one.name))
    parameters.put(scene, path, truth)
    return right if seen[0] >= seen[1] else np.asarray(left)


def _share(scene: edgegrad.Scene, name: str) -> float:
    """Part of the picture that a mesh covers: its mean if the mesh alone glows, and all else is black."""
    black, white = "(black)", "(white)"
    masked = edgegrad.Scene(
        camera=scene.camera,
        meshes={key: replace(mesh, materials=(white if key == name else black,) * len(mesh.materials), attributes={})
                for key, mesh in scene.meshes.items()},
        materials={black: edgegrad.Material(np.zeros(3)), white: edgegrad.Material(np.zeros(3), np.ones(3))},
    )  # fmt: skip
    return float(edgegrad.render(masked, spp=4, max_depth=1).mean())


def colored(scene: edgegrad.Scene, one: Candidate) -> str | None:
    """Return the path of the base colour of a mesh with one untextured material of its own; None if it has none."""
    names = set(scene.meshes[one.name].materials)
    if len(names) != 1:
        return None
    name = names.pop()
    material = scene.materials[name]
    shared = any(name in mesh.materials for key, mesh in scene.meshes.items() if key != one.name)
    plain = isinstance(material, edgegrad.Material) and "base_color" not in material.textures
    if not plain or shared or material.kind in ("TRANSPARENT", "GLASS", "REFRACTION"):  # type: ignore[union-attr]
        return None
    return f"materials.{name}.base_color"


def sideways(scene: edgegrad.Scene, one: Candidate, share: float) -> NDArray[np.float64]:
    """(3,) shift in the plane of the camera's picture, of this part of the diagonal of the object's box."""
    right, up = scene.camera.to_world[:3, 0], scene.camera.to_world[:3, 1]
    direction = 0.8 * right + 0.6 * up
    return np.asarray(share * one.diagonal * direction / np.linalg.norm(direction))
