"""Explanations for parameters whose gradient is zero in all iterations of a fit, entirely or in part."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Collection, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ...geometry.camera_view import in_picture
from ...planning.scene_plan import Plan
from ...planning.term import UNREAD
from ...scene import parameters
from ...scene.camera import Camera
from ...scene.material import Mixture
from ...scene.placement import expanded
from ...scene.scene import Scene
from ..silhouettes import moves_silhouettes

# Smallest fraction of zero entries that is reported: the cameras rarely see all sides of a mesh.
WORTH_A_NOTE = 0.01


def why_untouched(scene: Scene, losses: NDArray[np.float64], path: str, planned: Plan) -> str:
    """Return the most likely reason why the gradient of the parameter `path` is zero everywhere.

    Parameters
    ----------
    losses
        Most recent loss of each picture.
    planned
        Plan of the derivatives with respect to all fitted parameters.
    """
    collection, name, fieldname = parameters.split(path)
    if not losses.any():
        return "the pictures already equal their targets"
    if collection == "materials" and not _is_used(scene, name):
        return "no mesh or field uses this material"
    if planned.zero.get(path) == UNREAD:
        return f"{UNREAD} (a texture replaces it, or it has no effect on a light without size)"
    if collection == "lights" and fieldname == "color" and np.size(parameters.get(scene, path)):
        held = parameters.owner(scene, path)[0]
        if not getattr(held, "power", getattr(held, "strength", 1.0)):
            return "this light's power is 0"
    if collection == "world" and fieldname == "color" and not scene.world.strength:
        return "the world's strength is 0"
    if fieldname in ("power", "strength") and not np.any(parameters.owner(scene, path)[0].color):
        return "its colour is black"
    return planned.zero.get(path) or ("nothing that the cameras see depends on it (out of view, hidden, "
                                      "unlit, or masked)")


def warn_of_untouched(scene: Scene, touched: Mapping[str, NDArray[np.bool_]], losses: NDArray[np.float64],
                      driven: Collection[str], outlines: bool, planned: Callable[[], Plan]) -> None:  # fmt: skip
    """Warn the caller of `edgegrad.fit`, two calls up, of parameters without any gradient.

    Parameters
    ----------
    touched
        For each parameter: True where some gradient was not 0.
    losses
        Most recent loss of each picture.
    driven
        Names of the driven variables among the parameters.
    outlines
        Whether all targets are silhouettes.
    planned
        Returns the plan of the derivatives.
    """
    for path, one in touched.items():
        if one.any():
            continue
        reason = ("nothing that the cameras see depends on it" if path in driven
                  else "silhouettes do not depend on it" if outlines and not moves_silhouettes(path)
                  else why_untouched(scene, losses, path, planned()))  # fmt: skip
        warnings.warn(f"fit: no gradient for '{path}', because {reason}", RuntimeWarning, stacklevel=4)


def untouched_part(scene: Scene, cameras: Sequence[Camera], path: str, touched: NDArray[np.bool_]) -> str | None:
    """Describe the entries of a parameter whose gradient was exactly 0 in all pictures; None if there are few.

    Parameters
    ----------
    touched
        Array of the parameter's shape: True where some gradient was not 0.
    """
    collection, name, fieldname = parameters.split(path)
    if collection == "fields" and (fieldname == "values" or parameters.layer_of(fieldname) is not None):
        return None  # what is away from the surface never has a gradient
    if not touched.any() or touched.mean() > 1.0 - WORTH_A_NOTE:
        return None
    found = f"{np.mean(~touched):.0%} of the gradient of '{path}' is exactly 0"
    if collection == "meshes" and fieldname == "vertices" and scene.meshes[name].is_single:
        points = expanded(scene.meshes[name]).vertices
        still = ~touched.any(axis=1)
        seen = np.any([in_picture(camera, points) for camera in cameras], axis=0)
        parts = {"lie outside all pictures": still & ~seen, "are hidden, unlit or masked": still & seen}
        why = [f"{np.mean(part):.0%} of the vertices {words}" for words, part in parts.items()
               if np.mean(part) >= WORTH_A_NOTE]  # fmt: skip
        return f"{found}: {', '.join(why)}" if why else None
    if collection == "images":
        return f"{found}: these texels are out of view, hidden, unlit or masked"
    return f"{found}: nothing that the cameras see depends on these entries"


def _is_used(scene: Scene, name: str) -> bool:
    """Whether a mesh or field uses the material, or a mixture that contains it."""
    users = {name, *(other for other, m in scene.materials.items() if isinstance(m, Mixture) and name in m.parts)}
    if any(one.material in users for one in scene.fields.values()):
        return True
    return any(not users.isdisjoint(mesh.materials) for mesh in scene.meshes.values())
