"""Cameras and films as shots use them."""

from __future__ import annotations

import math
from typing import Any

import bpy
from mathutils import Vector

from .. import stage
from ..case import case


def _set() -> None:
    stage.studio(width=6.0)
    stage.row(
        [
            stage.principled("Red", (0.7, 0.1, 0.1)),
            stage.principled("Chrome", Metallic=1.0, Roughness=0.1),
            stage.principled("Glass", (1, 1, 1), Transmission_Weight=1.0, Roughness=0.0),
        ]
    )


@case("An orthographic camera with shift and a near clipping plane that cuts bodies open", bounces=4)
def orthographic_section() -> None:
    """A section of a model."""
    _set()
    camera = bpy.context.scene.camera
    camera.data.type, camera.data.ortho_scale = "ORTHO", 5.0
    camera.data.shift_x, camera.data.shift_y = 0.1, -0.05
    camera.data.clip_start = (camera.location - Vector((0, 0, 0.6))).length


@case("A filter of box shape", bounces=3)
def box_filter() -> None:
    """As for textures that are rendered."""
    _set()
    bpy.context.scene.cycles.pixel_filter_type = "BOX"


@case("A Gaussian filter of 3 pixels", bounces=3)
def gaussian_filter() -> None:
    """A soft picture."""
    _set()
    bpy.context.scene.cycles.pixel_filter_type, bpy.context.scene.cycles.filter_width = "GAUSSIAN", 3.0


@case("A camera in a glass ball, with depth of field at a shifted lens", bounces=8, samples=96)
def camera_in_glass() -> None:
    """The first surface is met from within."""
    _set()
    camera = bpy.context.scene.camera
    camera.data.shift_x, camera.data.clip_start = 0.15, 0.01
    camera.data.dof.use_dof, camera.data.dof.focus_distance, camera.data.dof.aperture_fstop = True, 6.5, 0.2
    stage.add("Dome", stage.sphere("Dome", bpy.data.materials["Glass"], radius=0.5), camera.location)


@case("A room behind a pane in the sun: glass that shadow rays pass, and a blind", bounces=6, samples=128)
def pane_in_sun() -> None:
    """The glass of architects."""

    def pane(tree: Any) -> Any:
        path = stage.node(tree, "ShaderNodeLightPath")
        kinds = {0: path.outputs["Is Shadow Ray"], 1: path.outputs["Is Diffuse Ray"]}
        passes = stage.node(tree, "ShaderNodeMath", kinds, operation="MAXIMUM")
        return stage.node(tree, "ShaderNodeMixShader", {
            0: passes, 1: stage.node(tree, "ShaderNodeBsdfGlass", {"Roughness": 0.0}),
            2: stage.node(tree, "ShaderNodeBsdfTransparent", {"Color": (0.9, 0.95, 0.9)})})  # fmt: skip

    wall = stage.principled("Wall", (0.8, 0.8, 0.8))
    stage.add("Floor", stage.plane("Floor", stage.principled("Oak", (0.4, 0.25, 0.15)), size=4.0))
    stage.add("Ceiling", stage.plane("Ceiling", wall, size=4.0), (0, 0, 3.0))
    stage.add("Back", stage.plane("Back", wall, size=4.0), (0, 2.0, 1.5), (math.pi / 2, 0, 0))
    for k, (place, scale) in enumerate((((-2.0, 0.0, 0.4), (0.1, 4.0, 0.8)), ((-2.0, 0.0, 2.7), (0.1, 4.0, 0.6)),
                                        ((-2.0, 1.5, 1.6), (0.1, 1.0, 1.6)))):  # fmt: skip
        stage.add(f"Wall {k}", stage.cube("Wall", wall, size=1.0), place, (0, 0, 0), scale)
    stage.add("Pane", stage.cube("Pane", stage.material("Pane", pane), size=1.0), (-2.0, -0.5, 1.6), (0, 0, 0),
              (0.02, 3.0, 1.6))  # fmt: skip
    for k in range(5):
        stage.add(f"Slat {k}", stage.cube("Slat", stage.diffuse("Slat", (0.3, 0.2, 0.1)), size=1.0),
                  (-1.8, -0.5, 1.0 + 0.3 * k), (0, 0.6, 0), (0.15, 3.0, 0.02))  # fmt: skip
    stage.lamp("SUN", "Sun", 6.0, (-5, 0, 5), (0, 0.3, 1.2), angle=math.radians(2.0))
    stage.world((0.5, 0.7, 1.0), 1.0)
    stage.camera((1.8, -3.0, 1.6), (-1.0, 0.6, 1.3), 24.0)
