"""Lighting as it is found in files: windows with portals, emission planes, skies, HDRIs, tricks with Light Path."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np

from .. import stage
from ..case import case


def _room() -> None:
    """A room with a window in its left wall, of single-sided planes, and a few bodies."""
    wall = stage.principled("Wall", (0.8, 0.78, 0.75), Roughness=0.8)
    stage.add("Floor", stage.plane("Floor", stage.principled("Wood", (0.35, 0.2, 0.1), Roughness=0.3), size=6.0))
    stage.add("Ceiling", stage.plane("Ceiling", wall, size=6.0), (0, 0, 3), (math.pi, 0, 0))
    stage.add("Back", stage.plane("Back", wall, size=6.0), (0, 3, 1), (math.pi / 2, 0, 0))
    stage.add("Right", stage.plane("Right", wall, size=6.0), (3, 0, 1), (0, -math.pi / 2, 0))
    for k, (y, z, size) in enumerate(((-2.0, 1.0, (2.0, 6.0)), (2.0, 1.0, (2.0, 6.0)))):
        stage.add(
            f"Left {k}",
            stage.plane(f"Left {k}", wall, size=1.0),
            (-3, y, z),
            (0, math.pi / 2, 0),
            (size[1], size[0], 1),
        )
    stage.add("Sofa", stage.cube("Sofa", stage.principled("Cloth", (0.2, 0.3, 0.5), Sheen_Weight=0.5), size=1.0),
              (1.2, 1.4, 0.4), (0, 0, 0.2), (1.6, 0.8, 0.8))  # fmt: skip
    stage.add("Vase", stage.sphere("Vase", stage.principled("Glaze", (0.7, 0.2, 0.1), Coat_Weight=1.0), radius=0.4),
              (-0.6, 0.8, 0.4))  # fmt: skip
    stage.camera((0.3, -5.0, 1.5), (0.0, 1.0, 1.1), 28.0)


@case("An interior by day: a sky through a window with a portal and panes of glass", bounces=6, samples=128)
def interior_with_portal() -> None:
    """Panes let shadow rays pass by Light Path."""
    _room()
    tree = stage.world((0.6, 0.8, 1.0), 3.0)
    tree.nodes["Background"].inputs["Strength"].default_value = 3.0
    stage.lamp("SUN", "Sun", 4.0, (0, 0, 5), None, angle=0.01).rotation_euler = (0.4, -0.9, 0.2)
    portal = stage.lamp(
        "AREA", "Portal", 1.0, (-3.0, 0.0, 1.0), (0.0, 0.0, 1.0), shape="RECTANGLE", size=2.0, size_y=3.0
    )
    portal.data.cycles.is_portal = True

    def pane(tree: Any) -> Any:
        path = stage.node(tree, "ShaderNodeLightPath")
        either = stage.node(tree, "ShaderNodeMath", {0: path.outputs["Is Shadow Ray"],
                                                     1: path.outputs["Is Diffuse Ray"]},
                            operation="MAXIMUM")  # fmt: skip
        return stage.node(tree, "ShaderNodeMixShader", {
            "Fac": either, 1: stage.node(tree, "ShaderNodeBsdfGlass", {"IOR": 1.45}),
            2: stage.node(tree, "ShaderNodeBsdfTransparent")})  # fmt: skip

    stage.add(
        "Pane", stage.plane("Pane", stage.material("Pane", pane), size=2.0), (-2.95, 0.0, 1.0), (0, math.pi / 2, 0)
    )


@case("An interior by night: emission planes, a lamp shade that glows, spots with soft edges", bounces=6, samples=128)
def interior_by_night() -> None:
    """Light from meshes and spots alone."""
    _room()
    stage.world((0.01, 0.02, 0.05), 1.0)
    glow = stage.emitter("Glow", (1.0, 0.8, 0.5), 8.0)
    stage.add("Panel", stage.plane("Panel", glow, size=0.8), (0.0, 0.5, 2.95), (math.pi, 0, 0))

    def shade(tree: Any) -> Any:
        return stage.node(tree, "ShaderNodeAddShader", {
            0: stage.node(tree, "ShaderNodeEmission", {"Color": (1.0, 0.6, 0.3), "Strength": 1.0}),
            1: stage.node(tree, "ShaderNodeBsdfPrincipled", {"Base Color": (0.9, 0.8, 0.6)})})  # fmt: skip

    stage.add("Shade", stage.cylinder("Shade", stage.material("Shade", shade), radius=0.35, top=0.2, depth=0.5),
              (2.3, 2.3, 1.6))  # fmt: skip
    for k in range(3):
        stage.lamp("SPOT", f"Spot {k}", 60.0, (-1.5 + 1.5 * k, 2.0, 2.9), (-1.5 + 1.5 * k, 2.4, 0.0), spot_size=1.0,
                   spot_blend=0.6, shadow_soft_size=0.05)  # fmt: skip


@case("Downlights with IES profiles along a wall", bounces=4, samples=96)
def ies_downlights() -> None:
    """Profiles from text within the file, as archviz kits have them."""
    _room()
    stage.world((0.02, 0.02, 0.03), 1.0)
    text = bpy.data.texts.new("profile.ies")
    angles = [0, 10, 20, 30, 40, 50, 60, 70, 80, 90, 180]
    candela = [800, 780, 900, 700, 300, 150, 60, 20, 5, 0, 0]
    text.write("IESNA:LM-63-1995\nTILT=NONE\n1 1000 1 11 1 1 2 0 0 0\n1 1 50\n"
               + " ".join(map(str, angles)) + "\n0\n" + " ".join(map(str, candela)) + "\n")  # fmt: skip
    for k in range(3):
        lamp = stage.lamp("POINT" if k < 2 else "SPOT", f"Downlight {k}", 0.3 if k < 2 else 0.4,
                          (-1.5 + 1.5 * k, 2.2, 2.7), None, shadow_soft_size=0.03)  # fmt: skip
        if k == 2:
            lamp.data.spot_size = 2.4
        if lamp.data.node_tree is None:
            lamp.data.use_nodes = True
        tree = lamp.data.node_tree
        profile = stage.node(tree, "ShaderNodeTexIES", {"Strength": 1.0}, mode="INTERNAL", ies=text)
        emission = next(node for node in tree.nodes if node.type == "EMISSION")
        emission.inputs["Color"].default_value = (1.0, 0.85, 0.6, 1.0)
        tree.links.new(profile.outputs[0], emission.inputs["Strength"])


@case("Light Falloff: constant, linear and smoothed quadratic, on points, spots and areas", bounces=3, samples=96)
def falloffs() -> None:
    """Lamps that light far walls as brightly as near ones."""
    _room()
    stage.world((0.02, 0.02, 0.03), 1.0)
    for k, (kind, output, smooth, energy) in enumerate((
        ("POINT", "Constant", 0.0, 3.0), ("SPOT", "Linear", 0.0, 12.0), ("AREA", "Linear", 0.0, 4.0),
        ("POINT", "Quadratic", 0.5, 20.0))):  # fmt: skip
        lamp = stage.lamp(kind, f"Lamp {k}", energy, (-2.0 + 1.3 * k, 1.0, 2.4), (-2.0 + 1.3 * k, 1.5, 0.0))
        if lamp.data.node_tree is None:
            lamp.data.use_nodes = True
        tree = lamp.data.node_tree
        falloff = stage.node(tree, "ShaderNodeLightFalloff", {"Strength": 1.0, "Smooth": smooth})
        emission = next(node for node in tree.nodes if node.type == "EMISSION")
        tree.links.new(falloff.outputs[output], emission.inputs["Strength"])


def _outside() -> None:
    stage.add("Ground", stage.plane("Ground", stage.principled("Ground", (0.3, 0.3, 0.25)), size=40.0))
    stage.add(
        "House", stage.cube("House", stage.principled("Plaster", (0.8, 0.75, 0.6)), size=2.0), (0, 0, 1), (0, 0, 0.4)
    )
    stage.row([stage.principled("Chrome", Metallic=1.0, Roughness=0.1), stage.principled("Red", (0.7, 0.1, 0.1))],
              y=-1.8, gap=3.0)  # fmt: skip
    stage.camera((2.0, -8.0, 2.5), (0, 0, 0.8), 35.0)


def _sky(kind: str, **settings: Any) -> None:
    _outside()
    tree = stage.world()
    sky = stage.node(tree, "ShaderNodeTexSky", sky_type=kind, **settings)
    background = tree.nodes["Background"]
    background.inputs["Strength"].default_value = 0.3
    tree.links.new(sky.outputs[0], background.inputs["Color"])


@case("A sky with its sun: multiple scattering, low sun", samples=192)
def sky_with_sun() -> None:
    """The default of the Sky Texture."""
    kinds = bpy.types.ShaderNodeTexSky.bl_rna.properties["sky_type"].enum_items.keys()
    _sky("MULTIPLE_SCATTERING" if "MULTIPLE_SCATTERING" in kinds else "NISHITA", sun_elevation=0.35, sun_rotation=2.0,
         sun_size=0.02, sun_intensity=0.5)  # fmt: skip


@case("Skies of old files: Preetham")
def sky_preetham() -> None:
    """A sky of 2.7 with its turbidity and a sun lamp."""
    _sky("PREETHAM", turbidity=3.0, sun_direction=(0.3, 0.5, 0.6))
    bpy.context.scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 1.0
    stage.lamp("SUN", "Sun", 2.0, (0, 0, 5), None, angle=0.05).rotation_euler = (0.6, 0.2, 0.4)


@case("Skies of old files: Hosek and Wilkie, rotated by a Mapping node")
def sky_hosek() -> None:
    """A sky of 2.8 with its albedo."""
    _sky("HOSEK_WILKIE", turbidity=2.5, ground_albedo=0.3, sun_direction=(0.3, -0.5, 0.5))
    tree = bpy.context.scene.world.node_tree
    sky = next(node for node in tree.nodes if node.type == "TEX_SKY")
    place = stage.node(tree, "ShaderNodeTexCoord").outputs["Generated"]
    mapping = stage.node(tree, "ShaderNodeMapping", {"Vector": place, "Rotation": (0.0, 0.0, 1.0)})
    tree.links.new(mapping.outputs[0], sky.inputs["Vector"])
    tree.nodes["Background"].inputs["Strength"].default_value = 1.0


@case("An HDRI with a small sun, mapped with location, scale and colour corrections", samples=96)
def hdri_mapped() -> None:
    """As backgrounds are moved to fit a picture."""
    _outside()
    y, x = np.mgrid[0:64, 0:128]
    pixels = (
        np.stack([0.3 + 0.2 * np.sin(x / 20.0), 0.5 + 0.0 * x, 0.9 - 0.008 * y], axis=-1)
        * np.where(y < 34, 1.0, 0.3)[..., None]
    )
    pixels[12:15, 30:33] = (60.0, 50.0, 35.0)
    image = stage.image("HDRI", pixels, "Linear Rec.709", is_float=True)
    tree = stage.world()
    place = stage.node(tree, "ShaderNodeTexCoord").outputs["Generated"]
    mapping = stage.node(tree, "ShaderNodeMapping", {
        "Vector": place, "Rotation": (0.1, 0.2, 0.9), "Location": (0.0, 0.0, -0.1),
        "Scale": (1.0, 1.0, 1.3)})  # fmt: skip
    texture = stage.node(tree, "ShaderNodeTexEnvironment", {"Vector": mapping}, image=image)
    color = stage.node(tree, "ShaderNodeHueSaturation", {"Saturation": 0.6, "Color": texture})
    tree.links.new(color.outputs[0], tree.nodes["Background"].inputs["Color"])


@case("A mirror ball image as an environment, and a gradient by the direction's height", samples=64)
def mirror_ball() -> None:
    """Light probes of old tutorials."""
    _outside()
    pixels = np.random.default_rng(3).uniform(0.2, 1.5, (8, 8, 3)).repeat(8, 0).repeat(8, 1)
    image = stage.image("Probe", pixels, "Linear Rec.709", is_float=True)
    tree = stage.world()
    texture = stage.node(tree, "ShaderNodeTexEnvironment", image=image, projection="MIRROR_BALL")
    height = stage.node(tree, "ShaderNodeSeparateXYZ", {0: stage.node(tree, "ShaderNodeTexCoord").outputs["Generated"]})
    ramp = stage.node(tree, "ShaderNodeValToRGB", {"Fac": height.outputs[2]})
    ramp.color_ramp.elements[0].color = (0.2, 0.15, 0.1, 1.0)
    mixed = stage.node(tree, "ShaderNodeMixRGB", {0: 0.5, 1: texture, 2: ramp})
    tree.links.new(mixed.outputs[0], tree.nodes["Background"].inputs["Color"])


@case("Area lights of all shapes with spread, close to surfaces; one within a box", bounces=4, samples=96)
def areas_with_spread() -> None:
    """Soft boxes and strips."""
    _outside()
    stage.world((0.1, 0.1, 0.12), 1.0)
    for k, (shape, spread) in enumerate((("SQUARE", 0.4), ("RECTANGLE", 1.2), ("DISK", 2.0), ("ELLIPSE", 0.05))):
        stage.lamp("AREA", f"Area {k}", 120.0, (-3.0 + 2.0 * k, -2.5, 2.0), (-2.0 + 1.5 * k, 0.0, 0.3), shape=shape,
                   size=0.8, size_y=0.3, spread=spread)  # fmt: skip


@case("A picture behind the scene for the camera, corrected by nodes, and a sky that lights it", samples=64)
def camera_sees_photo() -> None:
    """As archviz scenes place photographs outside of windows."""
    _outside()
    tree = stage.world()
    photo = stage.image("Photo", np.random.default_rng(9).uniform(0.1, 0.9, (8, 16, 3)))
    texture = stage.node(tree, "ShaderNodeTexEnvironment", image=photo)
    warm = stage.node(tree, "ShaderNodeBrightContrast", {"Color": texture, "Bright": 0.1, "Contrast": 0.2})
    sky = stage.node(tree, "ShaderNodeTexSky", sky_type="HOSEK_WILKIE", sun_direction=(0.3, -0.5, 0.5))
    shown = stage.node(tree, "ShaderNodeBackground", {"Color": warm})
    light = stage.node(tree, "ShaderNodeBackground", {"Color": sky, "Strength": 0.6})
    path = stage.node(tree, "ShaderNodeLightPath")
    mixed = stage.node(tree, "ShaderNodeMixShader", {"Fac": path.outputs["Is Camera Ray"], 1: light, 2: shown})
    tree.links.new(mixed.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])
