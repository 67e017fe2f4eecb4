"""Settings of renders and view layers: film, filters, overrides, limits of bounces, and what only Cycles has."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import bpy

from . import stage
from .case import case


def _room() -> Any:
    """Three balls before a wall under a lamp and a dim sky; returns Blender's scene."""
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 96, 72
    stage.add("Floor", stage.plane("Floor", stage.diffuse("Floor", (0.6, 0.5, 0.4)), size=6.0))
    stage.add("Wall", stage.plane("Wall", stage.diffuse("Wall", (0.5, 0.6, 0.6)), size=4.0), (0, 2, 1),
              (math.pi / 2, 0, 0))  # fmt: skip
    glass = stage.simple("Glass", "ShaderNodeBsdfGlass", {"Roughness": 0.2, "IOR": 1.4})
    stage.row([stage.principled("Plastic", (0.2, 0.4, 0.7), Roughness=0.4), glass,
               stage.principled("Metal", (0.9, 0.7, 0.4), Metallic=1.0, Roughness=0.3)], segments=48)  # fmt: skip
    stage.lamp("AREA", "Key", 150.0, (-2, -3, 4), (0, 0, 0.5), size=1.5)
    stage.world((0.4, 0.5, 0.7), 0.5)
    stage.camera((0, -6.5, 2.2), (0, 0, 0.7), 38.0)
    return scene


@case("Film exposure of 2.2", bounces=4)
def film_exposure() -> None:
    """Cycles multiplies the picture."""
    _room().cycles.film_exposure = 2.2


@case("A transparent film: the camera does not see the sky", bounces=4)
def film_transparent() -> None:
    """The sky lights the scene, and is seen through glass."""
    _room().render.film_transparent = True


@case("A view layer whose materials are replaced by clay (Material Override)", bounces=4)
def clay() -> None:
    """All three balls, floor and wall."""
    _room()
    bpy.context.view_layer.material_override = stage.principled("Clay", (0.7, 0.6, 0.5), Roughness=0.6)


@case("A wide Blackman-Harris pixel filter of 4 pixels", bounces=3)
def wide_filter() -> None:
    """A soft picture."""
    scene = _room()
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BLACKMAN_HARRIS", 4.0


@case("Limits of kinds of bounces below and above the total", bounces=2, diffuse_bounces=8, glossy_bounces=1,
      transmission_bounces=12)  # fmt: skip
def mixed_limits() -> None:
    """The total counts."""
    _room()


@case("Settings that change no expected picture: dither, passes, light groups, culling without Simplify", bounces=3)
def idle_settings() -> None:
    """Everything off its default that has no effect."""
    scene = _room()
    scene.render.dither_intensity = 2.0
    scene.view_settings.exposure, scene.view_settings.gamma = 2.0, 1.5
    scene.render.filter_size = 4.0
    scene.cycles.use_camera_cull = True
    scene.cycles.use_light_tree = False
    layer = bpy.context.view_layer
    layer.pass_alpha_threshold, layer.use_ao, layer.use_pass_mist = 0.0, False, True
    scene.world.light_settings.ao_factor = 0.1
    scene.world.mist_settings.use_mist = True
    key = bpy.data.objects["Key"].data
    key.specular_factor = key.diffuse_factor = 0.0
    key.use_custom_distance, key.cutoff_distance = True, 1.0
    key.cycles.use_multiple_importance_sampling = True
    for ob in scene.objects:
        ob.cycles.use_motion_blur, ob.cycles.ao_distance = False, 1.0
        ob.display_type = "WIRE"


@case("Orthographic camera with depth of field", bounces=2)
def orthographic_focus() -> None:
    """Focus on the wall."""
    _room()
    lens = bpy.context.scene.camera.data
    lens.type, lens.ortho_scale = "ORTHO", 6.0
    lens.dof.use_dof, lens.dof.focus_distance, lens.dof.aperture_fstop = True, 9.0, 2.0


@case("Caustics switched off", bounces=5, caustics_reflective=False, caustics_refractive=False)
def without_caustics() -> None:
    """Light through the glass ball is missing in Cycles."""
    _room()


@case("Reflective caustics switched off; coats, metal and glossy floor", bounces=5, caustics_reflective=False)
def without_reflected_caustics() -> None:
    """Partly metallic, tinted coat, Glossy shader."""
    _room()
    materials = [stage.principled("Half", (0.9, 0.6, 0.3), Metallic=0.5, Roughness=0.3),
                 stage.principled("Coated", (0.8, 0.8, 0.8), Coat_Weight=1.0, Coat_Tint=(0.6, 0.3, 0.3, 1.0)),
                 stage.simple("Glossy", "ShaderNodeBsdfAnisotropic", {"Roughness": 0.4})]  # fmt: skip
    for name, one in zip(("Plastic", "Glass", "Metal"), materials, strict=True):
        bpy.data.objects[name].data.materials[0] = one


@case("Fast global illumination", bounces=5, use_fast_gi=True)
def fast_global_illumination() -> None:
    """Ambient occlusion after one bounce."""
    _room()


def _closed_room(floor: Any, balls: Sequence[Any]) -> None:
    """A closed room of matte walls, with three balls on its floor, under a lamp."""
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 96, 72
    walls = stage.diffuse("Walls", (0.75, 0.7, 0.6))
    stage.add("Room", stage.cube("Room", walls, size=1.0), (0, 0, 1.5), scale=[5.0, 6.0, 3.0])
    stage.add("Floor", stage.plane("Floor", floor, size=4.8), (0, 0, 0.02))
    stage.row(balls, z=0.62, segments=48)
    stage.lamp("AREA", "Lamp", 60.0, (0.8, -0.5, 2.9), (0.8, -0.5, 0), size=0.6)
    stage.camera((0, -2.8, 1.6), (0, 0.2, 0.6), 24.0)


@case("Filter Glossy: a mirror, polished metals and a coated floor between matte walls", bounces=6, samples=128,
      blur_glossy=1.0)  # fmt: skip
def filtered_mirrors() -> None:
    """Its value in new files."""
    floor = stage.principled("Floor", (0.4, 0.25, 0.15), Specular_IOR_Level=0.0, Coat_Weight=1.0, Coat_Roughness=0.05)
    _closed_room(floor, [stage.principled("Silver", (0.9, 0.9, 0.9), Metallic=1.0, Roughness=0.05),
                         stage.simple("Mirror", "ShaderNodeBsdfAnisotropic", {"Roughness": 0.0}),
                         stage.principled("Gold", (0.9, 0.65, 0.25), Metallic=1.0, Roughness=0.15)])  # fmt: skip


@case("Filter Glossy: glass on a matte table", bounces=8, samples=128, blur_glossy=1.0)
def filtered_glass() -> None:
    """Smooth and slightly rough glass, and water."""
    _closed_room(stage.diffuse("Table", (0.5, 0.5, 0.55)), [
        stage.simple("Glass", "ShaderNodeBsdfGlass", {"IOR": 1.5, "Roughness": 0.0}),
        stage.simple("Green", "ShaderNodeBsdfGlass", {"Color": (0.5, 0.9, 0.6), "IOR": 1.6, "Roughness": 0.1}),
        stage.principled("Water", (0.8, 0.9, 1.0), Transmission_Weight=1.0, Roughness=0.0, IOR=1.33),
    ])  # fmt: skip


@case("Filter Glossy: polished metal beside plastic of the default roughness", bounces=6, samples=128, blur_glossy=1.0)
def filtered_plastic() -> None:
    """Gloss over a diffuse base reflects little."""
    plastic = stage.principled("Plastic", (0.2, 0.4, 0.7))
    _closed_room(stage.principled("Floor", (0.6, 0.5, 0.4)), [
        plastic, stage.principled("Silver", (0.9, 0.9, 0.9), Metallic=1.0, Roughness=0.05),
        stage.principled("Clear", (0.8, 0.3, 0.2), Coat_Weight=1.0)])  # fmt: skip


@case("Filter Glossy: rough metal beside polished metal", bounces=6, samples=128, blur_glossy=1.0, differs=[
    "behind rough glossy bounces lobes stay as they are, which the export says"])  # fmt: skip
def filtered_metals() -> None:
    """A floor of rough metal shows polished balls."""
    floor = stage.principled("Floor", (0.8, 0.8, 0.8), Metallic=1.0, Roughness=0.5)
    _closed_room(floor, [stage.principled("Silver", (0.9, 0.9, 0.9), Metallic=1.0, Roughness=0.05),
                         stage.principled("Gold", (0.9, 0.65, 0.25), Metallic=1.0, Roughness=0.15),
                         stage.principled("Copper", (0.9, 0.5, 0.4), Metallic=1.0, Roughness=0.4)])  # fmt: skip


@case("Motion blur of a moving ball", bounces=2, differs=["motion blur is left out, which the export says"])
def motion_blur() -> None:
    """A ball that crosses the picture."""
    scene = _room()
    ball = bpy.data.objects["Plastic"]
    for frame, x in ((0, -3.0), (2, 0.5)):
        ball.location.x = x
        ball.keyframe_insert("location", frame=frame)
    scene.render.use_motion_blur = True
    scene.frame_set(1)


@case("A floor that only catches shadows", bounces=2, differs=[
    "a shadow catcher is rendered as an ordinary object, which the export says"])  # fmt: skip
def shadow_catcher() -> None:
    """Its surface is not seen in Cycles."""
    _room()
    bpy.data.objects["Floor"].is_shadow_catcher = True
