"""Fields whose outlines the camera sees, before a textured sheet and behind the corner of another one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from edgegrad import Field, Material, Scene, World
from edgegrad.expression import Coordinates, VectorMath
from tests.support.fields.splines import Floats, exact_sphere, sampled, torus
from tests.support.small_scenes import camera, matte, rectangle

GLOW = Material(np.zeros(3), np.array([3.0, 2.0, 1.0]))
SKY = World(np.array([0.2, 0.5, 1.0]))
SHIFT = (1.0, 0.5, 0.4)


def doughnut(size: int = 28, **others: Any) -> Field:
    """A torus, which hides a part of itself where it is seen at an angle."""
    return sampled(torus, size, **others)


def over_a_sheet(fields: Mapping[str, Field], **others: Any) -> Scene:
    """Fields in front of a textured sheet that glows, and behind the corner of another one."""
    position = VectorMath("SCALE", Coordinates("POSITION"), scale=0.5)
    pattern = Material(np.zeros(3), textures={"emission": VectorMath("ADD", position, (1.0, 1.0, 1.0))})
    meshes = {"behind": rectangle((0.3, 0.0, -1.2), (1.2, 0.0, 0.2), (0.0, 1.4, 0.0), "pattern"),
              "before": rectangle((0.7, 0.5, 1.2), (0.3, 0.1, 0.0), (0.0, 0.4, 0.1), "lamp")}
    materials = {"pattern": pattern, "lamp": GLOW, "clay": matte(0.7, 0.6, 0.5)}
    given: dict[str, Any] = {"camera": camera((0.4, -0.5, 3.0), size=16), "meshes": meshes, "world": SKY,
                             "fields": fields, "materials": materials}
    return Scene(**(given | others))


def shifted(scene: Scene, theta: float) -> tuple[Scene, Mapping[str, Floats]]:
    """The scene with its camera shifted, and the tangent of the shift."""
    to_world, tangent = np.array(scene.camera.to_world, float), np.zeros((4, 4))
    tangent[:3, 3] = SHIFT
    return replace(scene, camera=replace(scene.camera, to_world=to_world + theta * tangent)), {
        "camera.to_world": tangent}


FIELDS = {
    "sphere": lambda: {"ball": exact_sphere(0.7, 20)},
    "torus": lambda: {"ring": doughnut()},
    "placed": lambda: {"ring": replace(doughnut(), transform=np.array(
        [[0.8, 0.1, 0.5, 0.1], [-0.3, 1.0, 0.2, 0.0], [-0.6, -0.2, 0.7, 0.1], [0.0, 0.0, 0.0, 1.0]]))},
    "mirrored": lambda: {"ring": replace(doughnut(), transform=np.diag([-1.0, 1.2, 1.0, 1.0]))},
}


def bent(scene: Scene, theta: float, what: str) -> tuple[Scene, Mapping[str, Floats]]:
    """The scene with a changed field, and the tangent of its parameter."""
    (name, field), = scene.fields.items()
    if what == "values":
        x, y, z = (np.linspace(-1.0, 1.0, n) for n in field.values.shape)
        tangent = 0.15 + 0.1 * np.cos(2.0 * x[:, None, None] + 1.0) * np.sin(3.0 * y[None, :, None]) + 0.05 * z
        moved = replace(field, values=(field.values + theta * tangent).astype(np.float32))
    else:
        tangent = np.zeros((4, 4))
        tangent[:3] = [[0.2, -0.5, 0.3, 0.5], [0.5, -0.1, -0.4, -0.3], [-0.3, 0.4, 0.1, 0.4]]
        moved = replace(field, transform=field.transform + theta * tangent)
    return replace(scene, fields={name: moved}), {f"fields.{name}.{what}": tangent}
