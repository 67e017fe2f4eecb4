"""Reverse mode beside forward mode, <w, J v> = <J^T w, v>, for every kind of material and every instruction set."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import edgegrad
from edgegrad.derivatives.table_derivatives import ParameterMap, with_requested
from edgegrad.rendering import native_engine
from edgegrad.rendering.options import RenderOptions
from edgegrad.scene import parameters
from edgegrad.scene.material import KINDS
from edgegrad.tables.tables import flatten
from tests.support import shapes
from tests.support.picture_differences import need_every_table

# Kinds by name, and Principled with each of its lobes, rough and perfect.
MATERIALS: dict[str, dict[str, Any]] = {
    **{kind: {"kind": kind, "roughness": 0.4} for kind in KINDS},
    **{f"perfect {kind}": {"kind": kind, "roughness": 0.0} for kind in ("GLOSSY", "GLASS", "REFRACTION")},
    "equal indices": {"kind": "GLASS", "roughness": 0.4, "ior": 1.0},
    "coat": {"coat_weight": 0.7, "coat_roughness": 0.3, "roughness": 0.6},
    "perfect coat": {"coat_weight": 0.7, "coat_roughness": 0.0, "roughness": 0.6},
    "metal": {"metallic": 1.0, "roughness": 0.3, "anisotropy": 0.4},
    "transmission": {"transmission": 0.8, "roughness": 0.3},
    "sheen": {"sheen_weight": 0.5, "sheen_roughness": 0.4},
    "subsurface": {"subsurface_weight": 0.5},
    "alpha": {"alpha": 0.6},
    "rough diffuse": {"kind": "DIFFUSE", "diffuse_roughness": 0.5},
}
PATHS = ("meshes.body.vertices", "materials.clay.base_color", "materials.clay.roughness", "camera.to_world",
         "lights.lamp.position", "world.color")  # fmt: skip


def ball_in_light(**material: Any) -> edgegrad.Scene:
    """A smooth ball under a lamp and a sky, seen with few pixels."""
    scene = shapes.scene(*shapes.ball(1), world=0.5)
    scene.camera.width, scene.camera.height = 8, 6
    mesh = scene.meshes["object"]
    scene.meshes = {"body": replace(mesh, smoothing=mesh.faces.copy())}
    scene.materials = {"clay": edgegrad.Material(np.array([0.5, 0.3, 0.4]), **material)}
    scene.lights = {"lamp": edgegrad.PointLight(np.array([2.0, -2.0, 3.0]), power=200.0, radius=0.3)}
    return scene


@pytest.mark.parametrize("isa", native_engine.instruction_sets())
@pytest.mark.parametrize("name", MATERIALS)
def test_reverse_mode_is_the_transpose_of_forward_mode(name: str, isa: str) -> None:
    need_every_table()
    scene = ball_in_light(**MATERIALS[name])
    rng = np.random.default_rng(5)
    adjoint = rng.normal(size=(*scene.camera.size, 3)).astype(np.float32)
    options = RenderOptions(spp=4, seed=2, max_depth=3, terms=("interior",))
    for path in PATHS:
        tangent = {path: rng.normal(size=np.shape(parameters.get(scene, path)))}
        tables = with_requested(scene, flatten(scene), tangent)
        derivative = ParameterMap(scene, tables, tangent)
        wanted, velocity = derivative.requested, derivative.push_forward(tangent)
        engine = native_engine.Engine(tables, 1, isa)
        engine.set_edges(tables.edges())
        image = engine.forward(tables, velocity, wanted, options).astype(np.float64)
        gradient = engine.backward(tables, adjoint, wanted, options)
        one = float(np.sum(image * adjoint))
        other = sum(float(np.sum(gradient[table] * velocity[table])) for table in gradient)
        scale = float(np.linalg.norm(image) * np.linalg.norm(adjoint)) / np.sqrt(adjoint.size)
        # Floats cancel where nothing but rounding is left, as in glass of equal indices.
        assert one == pytest.approx(other, abs=1e-4 * scale + 1e-6), path
