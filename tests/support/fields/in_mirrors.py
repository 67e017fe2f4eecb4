"""Distance fields that the camera sees in perfect mirrors and through smooth glass, and all that moves them there."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import replace
from typing import Any

import numpy as np

from edgegrad import Field, PointLight, Scene, World
from edgegrad.scene import parameters
from tests.support.fields.outlined import doughnut
from tests.support.fields.splines import Floats, exact_sphere
from tests.support.scenes.mirrors_and_glass import MATERIALS, ball
from tests.support.small_scenes import box, camera, matte, rectangle

# Segments of the paths that show the field: those of the chain, and the one that meets the field.
DEPTHS = {"flat mirror": 2, "round mirror": 2, "pane": 3, "ball of glass": 3, "two mirrors": 3,
          "crossed sheet": 2, "crossed field": 2, "crossed meshes": 2, "mirror": 3, "glass": 4}


def placed(field: Field, where: tuple[float, float, float], size: float = 1.0) -> Field:
    """The field, turned, at a place."""
    transform = np.eye(4)
    transform[:3, :3] = size * np.array([[0.8, 0.0, 0.6], [0.36, 0.8, -0.48], [-0.48, 0.6, 0.64]])
    transform[:3, 3] = where
    return replace(field, transform=transform)


def shown_by(optics: str, shape: str = "ring", **others: Any) -> Scene:
    """A dark field in front of a sheet that glows, seen by way of mirrors or glass."""
    field = doughnut() if shape == "ring" else exact_sphere(0.6, 20)
    sheet = rectangle((0.2, 0.3, 2.6), (1.5, 0.2, 0.0), (-0.1, -1.1, 0.3), "warm")
    mirror = rectangle((0, 0, -1), (1.6, 0, 0), (0, 1.6, 0), "mirror")
    over = camera((0.6, 1.6, 2.2), (0.1, 0.0, -1.2), 16, 0.9)
    before = camera((0, 0, 4.5), (0, 0, 0), 16, 0.6)
    own: dict[str, Any] = {"camera": over}
    match optics:
        case "flat mirror":
            meshes, where = {"mirror": mirror}, (0.2, 0.1, 1.0)
        case "crossed sheet" | "crossed field" | "crossed meshes":
            meshes, where = {"mirror": mirror}, (0.2, 0.1, 1.0)
            # Its edges are out of sight
            sheet = rectangle((0.2, 0.1, 1.0), (3.0, 0.1, 0.3), (-0.1, 3.0, 0.2), "warm")
            own = {"camera": camera((0.6, 1.6, 2.2), (0.2, 0.1, -3.0), 16, 0.3)}
        case "two mirrors":
            second = rectangle((0, 0, 4.0), (-2.5, 0, 0), (0, 2.5, 0.3), "mirror")
            meshes, where = {"mirror": mirror, "second": second}, (0.5, 1.1, 0.6)
            own = {"camera": camera((0.5, 0.3, 2.2), (0, 0, -1), 16, 0.8)}
        case "round mirror":
            meshes, where = {"mirror": ball((0, 0, 0), 1.0, "mirror")}, (1.0, 1.2, 1.6)
            sheet = rectangle((1.9, 2.2, 2.6), (1.2, -0.9, 0.1), (0.3, 0.4, -1.0), "warm")
            own = {"camera": before}
        case "pane":
            meshes, where = {"glass": box((0, 0, 0), (1.6, 1.2, 0.4), "glass", 0.7)}, (0.1, 0.1, -1.6)
            sheet = rectangle((0.3, 0.2, -3.0), (1.0, 0.2, 0.0), (-0.1, 0.8, 0.3), "warm")
            own = {"camera": before}
        case _:
            meshes, where = {"glass": ball((0, 0, 0), 1.0, "glass")}, (0.3, 0.2, -3.0)
            sheet = rectangle((0.3, 0.2, -4.5), (2.0, 0.2, 0.0), (-0.1, 1.5, 0.3), "warm")
            own = {"camera": before}
    fields, shown = {"body": placed(field, where)}, {"sheet": sheet}
    if optics == "crossed meshes":
        fields, shown["other"] = {}, box(where, (0.4, 0.3, 0.35), "cold", 0.5)
    elif optics == "crossed field":
        shown, fields["other"] = {}, placed(exact_sphere(0.6, 20, material="grey"), (0.5, 0.1, 1.2))
        own["lights"] = {"lamp": PointLight(np.array([0.4, 0.3, -3.0]), power=300.0, casts_shadow=False)}
    if optics.startswith("crossed"):
        for one in (*fields.values(), *shown.values()):
            one.visible_to = frozenset(["glossy", "shadow", "diffuse"])  # the camera sees them in the mirror alone
    given: dict[str, Any] = {
        "meshes": {**meshes, **shown}, "fields": fields, "world": World(np.ones(3), 0.3),
        "materials": {**MATERIALS, "clay": matte(0.0, 0.0, 0.0), "grey": matte(0.5, 0.5, 0.6)}}
    return Scene(**(given | own | others))


def changed(scene: Scene, what: str, theta: float) -> tuple[Scene, Mapping[str, Floats]]:
    """The scene with one of its parts changed by theta, and the tangent of this change."""
    optic = next((name for name in ("mirror", "glass") if name in scene.meshes), "")
    path = {
        "values": "fields.body.values", "transform": "fields.body.transform", "other": "fields.other.transform",
        "optic": f"meshes.{optic}.vertices", "sheet": "meshes.sheet.vertices", "camera": "camera.to_world",
        "ior": "materials.glass.ior"}[what]
    value = np.array(parameters.get(scene, path), np.float64)
    tangent = np.zeros_like(value)
    match what:
        case "values":
            x, y, z = (np.linspace(-1.0, 1.0, n) for n in value.shape)
            tangent = 0.15 + 0.1 * np.cos(2.0 * x[:, None, None] + 1.0) * np.sin(3.0 * y[None, :, None]) + 0.05 * z
        case "transform" | "other":
            tangent[:3] = [[0.2, -0.5, 0.3, 0.5], [0.5, -0.1, -0.4, -0.3], [-0.3, 0.4, 0.1, 0.4]]
        case "camera":
            tangent[:3, 3] = 1.0, -0.5, 0.2
        case "optic" | "sheet":
            tangent = np.array([0.6, -0.4, 0.3]) + 0.2 * value[:, [1, 2, 0]]
        case "ior":
            tangent = np.ones_like(value)
    moved = replace(scene, camera=replace(scene.camera), meshes={k: replace(m) for k, m in scene.meshes.items()},
                    fields={k: replace(f) for k, f in scene.fields.items()},
                    materials={k: replace(m) for k, m in scene.materials.items()})
    parameters.put(moved, path, value + theta * tangent)
    return moved, {path: tangent}


def optical(material: str) -> Scene:
    """A field that is a mirror or glass, before a sheet that glows and in front of another one."""
    shown = {"card": rectangle((0.4, 0.5, 1.9), (0.5, 0.1, 0.0), (0.0, 0.3, 0.2), "warm"),
             "behind": rectangle((0.0, 0.1, -2.2), (0.7, 0.1, 0), (-0.1, 0.5, 0.2), "cold")}
    return Scene(camera=camera((0, 0, 4.5), (0, 0, 0), 16, 0.5), meshes=shown,
                 fields={"body": placed(exact_sphere(0.8, 24, material=material), (0.0, 0.0, 0.0))},
                 materials=deepcopy(MATERIALS), world=World(np.ones(3), 0.3))
