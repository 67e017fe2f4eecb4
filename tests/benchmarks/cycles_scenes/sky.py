"""The world: images, rotation, sky textures, what sees it."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np

from . import lamps, stage
from .case import case


def panorama(sun: float = 60.0) -> Any:
    """A small sky with a bright round sun, different in every direction."""
    height, width = 64, 128
    y, x = np.mgrid[0:height, 0:width] + 0.5
    longitude, latitude = (x / width - 0.5) * 2.0 * np.pi, (0.5 - y / height) * np.pi
    out = np.stack([0.3 + 0.2 * np.sin(longitude), 0.4 + 0.1 * np.cos(2 * longitude), 0.6 + 0.3 * np.sin(latitude)], -1)
    out[latitude < 0] *= 0.3
    out[np.hypot((longitude - 0.8) * np.cos(0.7), latitude - 0.7) < 0.12] = sun * np.array([1.0, 0.9, 0.7])
    return stage.image("Panorama", out.astype(np.float32), "Linear Rec.709", is_float=True)


@case("Environment image with rotation and strength, seen directly, in mirrors and in glass", bounces=5)
def environment_image() -> None:
    """Balls on a disk under the open sky."""
    tree = stage.world()
    where = stage.node(tree, "ShaderNodeTexCoord").outputs["Generated"]
    turned = stage.node(tree, "ShaderNodeMapping", {"Vector": where, "Rotation": (0.2, -0.1, 1.3)})
    texture = stage.node(tree, "ShaderNodeTexEnvironment", {"Vector": turned}, image=panorama())
    tree.links.new(texture.outputs["Color"], tree.nodes["Background"].inputs["Color"])
    tree.nodes["Background"].inputs["Strength"].default_value = 0.8
    grey = stage.diffuse("Disk", (0.5, 0.5, 0.5))
    stage.add("Disk", stage.cylinder("Disk", grey, radius=2.6, depth=0.2, segments=64),
              (0, 0, -0.1))  # fmt: skip
    stage.row([stage.diffuse("Chalk"), stage.principled("Metal", (0.9, 0.9, 0.9), Metallic=1.0, Roughness=0.1),
               stage.principled("Plastic", (0.7, 0.2, 0.1), Roughness=0.2)], gap=1.4)  # fmt: skip
    stage.camera((0, -6, 2.0), (0, 0, 0.8), 45.0)


def _sky(**settings: Any) -> None:
    tree = stage.world()
    kinds = bpy.types.ShaderNodeTexSky.bl_rna.properties["sky_type"].enum_items.keys()
    made = stage.node(tree, "ShaderNodeTexSky", sky_type="NISHITA" if "NISHITA" in kinds else "MULTIPLE_SCATTERING")
    for key, value in settings.items():
        setattr(made, key, value)
    tree.links.new(made.outputs["Color"], tree.nodes["Background"].inputs["Color"])
    tree.nodes["Background"].inputs["Strength"].default_value = 0.1


@case("Sky texture without its sun disc, and a sun lamp in its place", differs=[
    "the sky is baked to an equirectangular image; Cycles evaluates it per ray"])  # fmt: skip
def sky_texture() -> None:
    """A clear sky with the sun behind the camera."""
    _sky(sun_disc=False, sun_elevation=0.5, sun_rotation=2.5)
    stage.lamp("SUN", "Sun", 2.0, (0, 0, 5), (1.5, 2.0, 1.5), angle=0.01)
    stage.add("Floor", stage.plane("Floor", stage.diffuse("Floor", (0.5, 0.5, 0.5)), size=40.0))
    stage.row([stage.diffuse("Chalk"), stage.principled("Metal", (0.9, 0.9, 0.9), Metallic=1.0, Roughness=0.2),
               stage.principled("Plastic", (0.7, 0.2, 0.1), Roughness=0.2)], gap=1.4)  # fmt: skip
    stage.camera((0, -6, 2.0), (0, 0, 0.9), 45.0)


@case("A low, wide sun of a sky texture, brighter on its upper side", bounces=2, samples=96)
def low_sun() -> None:
    """Its light comes from a little above its middle."""
    _sky(sun_elevation=0.12, sun_rotation=5.4, sun_size=0.2)
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 96, 72
    stage.add("Floor", stage.plane("Floor", stage.diffuse("Floor", (0.5, 0.5, 0.5)), size=40.0))
    stage.add("Box", stage.cube("Box", stage.diffuse("Box", (0.6, 0.4, 0.3)), size=0.8), (0, 0, 0.4), (0, 0, 0.4))
    stage.camera((0, -5, 4.0), (0.3, 0.2, 0), 40.0)


@case("World hidden from the camera and from reflections")
def world_visibility() -> None:
    """The world lights what is diffuse, but is not seen."""
    stage.world((0.5, 0.6, 0.8), 1.2)
    lamps._things(stage.principled("Polished", (0.4, 0.4, 0.4), Roughness=0.1))
    bpy.context.scene.camera.rotation_euler[0] += 0.15 * math.pi / 3.0
    for wall in ("Wall",):
        bpy.data.objects[wall].location.y = 1.5
        bpy.data.objects[wall].scale = (0.1, 0.05, 1.0)
    seen = bpy.context.scene.world.cycles_visibility
    seen.camera = seen.glossy = False
    stage.lamp("POINT", "Lamp", 60.0, (1.5, -2.5, 2.5), shadow_soft_size=0.1)
