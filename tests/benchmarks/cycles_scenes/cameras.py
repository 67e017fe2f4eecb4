"""Cameras: projections, sensor fit, shift, pixel aspect, crop, depth of field, pixel filters."""

from __future__ import annotations

import math
from typing import Any

import bpy

from . import stage
from .case import case


def _court() -> Any:
    """A court with columns, all around the middle; returns Blender's scene."""
    stage.add("Floor", stage.plane("Floor", _checks(), size=24.0))
    colors = ((0.8, 0.2, 0.2), (0.2, 0.7, 0.3), (0.2, 0.3, 0.8), (0.8, 0.7, 0.2))
    for k in range(12):
        angle = 2.0 * math.pi * (k + 0.5) / 12.0
        one = stage.diffuse(f"Column {k}", colors[k % 4])
        shape = stage.cylinder(f"Column {k}", one, radius=0.4, depth=1.0 + 0.25 * k, segments=12)
        stage.add(f"Column {k}", shape, (4.5 * math.sin(angle), 4.5 * math.cos(angle), 0.5 + 0.125 * k))
    stage.add(
        "Block", stage.cube("Block", stage.diffuse("Block", (0.7, 0.7, 0.7)), size=1.0), (0.3, 1.5, 0.5), (0, 0, 0.4)
    )
    stage.lamp("SUN", "Sun", 2.5, (0, 0, 5), (2.0, 1.5, 0), angle=0.05)
    stage.world((0.4, 0.55, 0.8), 0.6)
    return bpy.context.scene


def _checks() -> Any:
    def shader(tree: Any) -> Any:
        where = stage.node(tree, "ShaderNodeTexCoord").outputs["UV"]
        checks = stage.node(tree, "ShaderNodeTexChecker", {
            "Vector": where, "Scale": 24.0, "Color1": (0.7, 0.7, 0.7), "Color2": (0.25, 0.2, 0.2)})  # fmt: skip
        return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": checks.outputs["Color"]})

    return stage.material("Checks", shader)


@case("Perspective with shift and vertical sensor fit, Gaussian pixel filter", bounces=1)
def shifted_camera() -> None:
    """A lens shifted to the left and up."""
    scene = _court()
    ob = stage.camera((0.5, -7.0, 2.5), (0, 0, 0.8), 26.0)
    ob.data.sensor_fit, ob.data.sensor_height = "VERTICAL", 20.0
    ob.data.shift_x, ob.data.shift_y = -0.15, 0.1
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "GAUSSIAN", 2.0


@case("Portrait format with automatic sensor fit, pixel aspect 1:1.5, 80 %, box filter", bounces=1)
def pixel_aspect() -> None:
    """Pixels that are not square."""
    scene = _court()
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 130, 170, 80
    scene.render.pixel_aspect_x, scene.render.pixel_aspect_y = 1.0, 1.5
    ob = stage.camera((0.5, -7.0, 2.5), (0, 0, 0.8), 35.0)
    ob.data.shift_x, ob.data.shift_y = 0.05, -0.1
    scene.cycles.pixel_filter_type = "BOX"


@case("Render region cropped to a part of the picture; clip start and end", bounces=1)
def cropped() -> None:
    """A region that is not centred."""
    scene = _court()
    ob = stage.camera((0.5, -7.0, 2.5), (0, 0, 0.8), 30.0)
    ob.data.clip_start, ob.data.clip_end = 4.0, 12.0
    scene.render.resolution_x, scene.render.resolution_y = 240, 180
    scene.render.use_border = scene.render.use_crop_to_border = True
    scene.render.border_min_x, scene.render.border_max_x = 0.3, 0.9
    scene.render.border_min_y, scene.render.border_max_y = 0.1, 0.6


@case("Orthographic camera with shift", bounces=1)
def orthographic() -> None:
    """A view from above at an angle."""
    _court()
    ob = stage.camera((6.0, -9.0, 8.0), (0, 0, 0.5))
    ob.data.type, ob.data.ortho_scale = "ORTHO", 11.0
    ob.data.shift_x, ob.data.shift_y = 0.1, -0.05


@case("Equirectangular panorama, whole", bounces=1)
def panorama() -> None:
    """All directions from the middle of the court."""
    _court()
    ob = stage.camera((0.0, 0.0, 1.2), (1.0, 2.0, 1.4))
    _equirectangular(ob)


@case("Equirectangular panorama, part of the sphere", bounces=1)
def partial_panorama() -> None:
    """A range of longitudes and latitudes that is not centred, in a shifted picture."""
    _court()
    ob = stage.camera((0.0, 0.0, 1.2), (-1.0, 2.0, 1.0))
    ob.data.shift_x, ob.data.shift_y = 0.15, 0.1
    lens = _equirectangular(ob)
    lens.longitude_min, lens.longitude_max = -1.0, 2.0
    lens.latitude_min, lens.latitude_max = -0.9, 0.6


@case("Equidistant fisheye that fills a picture twice as wide as high", bounces=1)
def equidistant_fisheye() -> None:
    """More than half of all directions, in an ellipse."""
    scene = _court()
    scene.render.resolution_x, scene.render.resolution_y = 240, 120
    _panorama(stage.camera((0.0, 0.0, 1.2), (1.0, 2.0, 1.4)), "FISHEYE_EQUIDISTANT").fisheye_fov = 3.6


@case("Equisolid fisheye with vertical sensor fit and pixel aspect 1:1.5", bounces=1)
def equisolid_fisheye() -> None:
    """A disc that is smaller than the picture, whose middle is shifted by fractions of the picture's sides."""
    scene = _court()
    scene.render.pixel_aspect_x, scene.render.pixel_aspect_y = 1.0, 1.5
    ob = stage.camera((0.0, 0.0, 1.2), (-1.0, 2.0, 1.0))
    ob.data.sensor_fit, ob.data.sensor_height, ob.data.shift_x, ob.data.shift_y = "VERTICAL", 20.0, 0.2, -0.1
    lens = _panorama(ob, "FISHEYE_EQUISOLID")
    lens.fisheye_lens, lens.fisheye_fov = 7.0, 2.4


@case("Fisheye by a polynomial, Blender's default", bounces=1)
def polynomial_fisheye() -> None:
    """A lens that was measured."""
    _court()
    _panorama(stage.camera((0.0, 0.0, 1.2), (1.0, 2.0, 1.4)), "FISHEYE_LENS_POLYNOMIAL")


def _equirectangular(ob: Any) -> Any:
    return _panorama(ob, "EQUIRECTANGULAR")


def _panorama(ob: Any, kind: str) -> Any:
    ob.data.type = "PANO"
    lens = ob.data if hasattr(ob.data, "panorama_type") else ob.data.cycles  # Blender 5.0 moved it
    lens.panorama_type = kind
    return lens


@case("Depth of field with a round aperture", bounces=1, samples=96)
def round_aperture() -> None:
    """Focus on the block."""
    _court()
    ob = stage.camera((0.5, -7.0, 2.0), (0, 0, 0.8), 50.0)
    ob.data.dof.use_dof, ob.data.dof.focus_distance, ob.data.dof.aperture_fstop = True, 8.0, 0.12


@case("Depth of field with five blades, turned, ratio 2, focused on an object", bounces=1, samples=96)
def bladed_aperture() -> None:
    """Small bright lamps out of focus show the aperture."""
    _court()
    ob = stage.camera((0.5, -7.0, 2.0), (0, 0, 0.8), 50.0)
    dof = ob.data.dof
    dof.use_dof, dof.focus_object, dof.aperture_fstop = True, bpy.data.objects["Block"], 0.08
    dof.aperture_blades, dof.aperture_rotation, dof.aperture_ratio = 5, 0.4, 2.0
    for k in range(5):
        one = stage.sphere(
            f"Spark {k}", stage.emitter(f"Spark {k}", (1.0, 0.8, 0.3 + 0.15 * k), 60.0), radius=0.05, segments=12
        )
        stage.add(f"Spark {k}", one, (-2.0 + k, 3.0, 2.0 + 0.2 * k))
