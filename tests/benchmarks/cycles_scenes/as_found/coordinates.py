"""Texture coordinates of all kinds, with mappings of odd scales, and masks that follow them."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from .. import stage
from ..case import case


def _checks() -> Any:
    pixels = np.indices((8, 8)).sum(0) % 2
    colors = np.where(pixels[..., None] > 0, (0.8, 0.3, 0.1), (0.1, 0.3, 0.7)) * np.linspace(0.6, 1.0, 8)[:, None, None]
    return stage.image("Checks", colors)


def _row(outputs: Any, y: float, image: Any, **settings: Any) -> None:
    def made(name: str) -> Any:
        def shader(tree: Any) -> Any:
            place = stage.node(tree, "ShaderNodeTexCoord").outputs[name]
            mapping = stage.node(tree, "ShaderNodeMapping", {
                "Vector": place, "Location": (0.13, -0.4, 0.2), "Rotation": (0.1, 0.2, 0.7),
                "Scale": (1.7, -0.6, 2.3)})  # fmt: skip
            color = stage.node(tree, "ShaderNodeTexImage", {"Vector": mapping}, image=image, **settings)
            return stage.node(tree, "ShaderNodeBsdfPrincipled", {"Base Color": color, "Roughness": 0.6})

        return stage.material(f"{name} {y}", shader)

    stage.row([made(name) for name in outputs], y=y, radius=0.5, gap=1.15)


@case("Texture coordinates: Generated, Normal, UV, Object, Camera, Window, Reflection, with odd mappings")
def all_coordinates() -> None:
    """Each output of the node drives an image."""
    stage.studio(width=5.0)
    image = _checks()
    _row(("Generated", "Normal", "UV", "Object"), -0.7, image)
    _row(("Camera", "Window", "Reflection"), 0.6, image)


@case("Texture coordinates: images projected as boxes, spheres and tubes; clipped and mirrored")
def projections() -> None:
    """Box mapping is the rule in quick set-ups."""
    stage.studio(width=5.0)
    image = _checks()
    _row(("Generated", "Object"), -0.7, image, projection="BOX", projection_blend=0.3)
    _row(("Generated", "Normal"), 0.6, image, projection="SPHERE", extension="CLIP")
    stage.add(
        "Block", stage.cube("Block", bpy.data.materials["Object -0.7"], size=0.8), (2.0, -0.7, 0.6), (0.2, 0.3, 0.5)
    )
    tube = stage.material("Tube", lambda tree: stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": stage.node(
        tree, "ShaderNodeTexImage", {"Vector": stage.node(tree, "ShaderNodeTexCoord").outputs["Generated"]},
        image=image, projection="TUBE", extension="MIRROR")}))  # fmt: skip
    stage.add("Tube", stage.cylinder("Tube", tube, radius=0.5, depth=1.0), (-2.0, 0.6, 0.6))


@case("Layer Weight, Fresnel and geometry drive mixes: rims, dust on top, worn edges")
def driven_mixes() -> None:
    """Factors from the normal, the position and the facing."""
    stage.studio(width=5.0)

    def rim(tree: Any) -> Any:
        weight = stage.node(tree, "ShaderNodeLayerWeight", {"Blend": 0.4})
        ramp = stage.node(tree, "ShaderNodeValToRGB", {"Fac": weight.outputs["Facing"]})
        ramp.color_ramp.interpolation = "EASE"
        ramp.color_ramp.elements[0].position = 0.3
        return stage.node(tree, "ShaderNodeMixShader", {
            "Fac": ramp, 1: stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": (0.1, 0.2, 0.6)}),
            2: stage.node(tree, "ShaderNodeEmission", {"Color": (1.0, 0.4, 0.1), "Strength": 2.0})})  # fmt: skip

    def dust(tree: Any) -> Any:
        normal = stage.node(tree, "ShaderNodeSeparateXYZ", {0: stage.node(
            tree, "ShaderNodeNewGeometry").outputs["Normal"]})  # fmt: skip
        up = stage.node(tree, "ShaderNodeMapRange", {"Value": normal.outputs[2], 1: 0.3, 2: 0.8},
                        interpolation_type="SMOOTHSTEP")  # fmt: skip
        return stage.node(tree, "ShaderNodeMixShader", {
            "Fac": up, 1: stage.node(tree, "ShaderNodeBsdfGlossy", {"Color": (0.7, 0.5, 0.3), "Roughness": 0.3}),
            2: stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": (0.8, 0.8, 0.75)})})  # fmt: skip

    def worn(tree: Any) -> Any:
        bare = stage.node(tree, "ShaderNodeNewGeometry").outputs["Pointiness"]
        ramp = stage.node(tree, "ShaderNodeValToRGB", {"Fac": bare})
        ramp.color_ramp.elements[0].position, ramp.color_ramp.elements[1].position = 0.48, 0.53
        return stage.node(tree, "ShaderNodeBsdfPrincipled", {"Base Color": ramp})

    def fresnel(tree: Any) -> Any:
        many = stage.node(tree, "ShaderNodeMixShader", {
            "Fac": stage.node(tree, "ShaderNodeFresnel", {"IOR": 1.6}),
            1: stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": (0.5, 0.1, 0.1), "Roughness": 0.5}),
            2: stage.node(tree, "ShaderNodeBsdfGlossy", {"Roughness": 0.1})})  # fmt: skip
        velvet = stage.node(tree, "ShaderNodeMixShader", {
            "Fac": 0.3, 1: many, 2: stage.node(tree, "ShaderNodeBsdfSheen", {"Color": (0.9, 0.8, 0.7)})})  # fmt: skip
        return stage.node(tree, "ShaderNodeMixShader", {
            "Fac": stage.node(tree, "ShaderNodeLayerWeight", {"Blend": 0.2}).outputs["Fresnel"], 1: velvet,
            2: stage.node(tree, "ShaderNodeBsdfTranslucent", {"Color": (0.2, 0.6, 0.3)})})  # fmt: skip

    made = [stage.material(one.__name__, one) for one in (rim, dust, fresnel)]
    stage.row(made, y=-0.5, radius=0.6, gap=1.4)
    stage.add("Head", stage.monkey("Head", stage.material("Worn", worn), smooth=True), (0, 1.2, 1.0), scale=0.8)


@case("Masks by coordinates of another object, by Ambient Occlusion and by Wireframe")
def object_masks() -> None:
    """An empty places a gradient; dirt in corners; lines along edges."""
    stage.studio(width=5.0)
    empty = stage.add("Empty", None, (0.4, -0.5, 0.8), (0.3, 0.4, 0.5), (0.5, 0.8, 0.6))

    def gradient(tree: Any) -> Any:
        place = stage.node(tree, "ShaderNodeTexCoord", object=empty)
        color = stage.node(tree, "ShaderNodeValToRGB", {"Fac": stage.node(
            tree, "ShaderNodeTexGradient", {"Vector": place.outputs["Object"]},
            gradient_type="SPHERICAL")})  # fmt: skip
        return stage.node(tree, "ShaderNodeBsdfPrincipled", {"Base Color": color})

    def dirt(tree: Any) -> Any:
        return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": stage.node(
            tree, "ShaderNodeAmbientOcclusion", {"Color": (0.8, 0.7, 0.5), "Distance": 0.7})})  # fmt: skip

    def lines(tree: Any) -> Any:
        wire = stage.node(tree, "ShaderNodeWireframe", {"Size": 0.03})
        return stage.node(tree, "ShaderNodeMixShader", {
            "Fac": wire, 1: stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": (0.6, 0.6, 0.6)}),
            2: stage.node(tree, "ShaderNodeEmission", {"Color": (0.1, 0.4, 1.0)})})  # fmt: skip

    stage.add(
        "Block", stage.cube("Block", stage.material("Gradient", gradient), size=1.2), (-1.6, -0.2, 0.6), (0, 0, 0.4)
    )
    stage.add("Head", stage.monkey("Head", stage.material("Dirt", dirt)), (0.2, 0.2, 0.8), scale=0.7)
    stage.add("Ball", stage.sphere("Ball", stage.material("Lines", lines), radius=0.7, segments=16, smooth=False),
              (1.9, 0.0, 0.7))  # fmt: skip


def _by_window() -> None:
    stage.studio(width=5.0)
    image = _checks()

    def shader(tree: Any) -> Any:
        place = stage.node(tree, "ShaderNodeTexCoord").outputs["Window"]
        color = stage.node(tree, "ShaderNodeTexImage", {"Vector": place}, image=image, interpolation="Closest")
        return stage.node(tree, "ShaderNodeEmission", {"Color": color})

    stage.row([stage.material("Window", shader)], radius=1.0)
    scene = bpy.context.scene
    scene.camera.data.shift_x, scene.camera.data.shift_y = 0.1, -0.2
    scene.render.pixel_aspect_y = 1.3


@case("Window coordinates in a region of the picture, with shift and pixel aspect")
def window_in_region() -> None:
    """Projected backgrounds."""
    _by_window()
    render = bpy.context.scene.render
    render.use_border = render.use_crop_to_border = True
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.2, 0.9, 0.1, 0.85


@case("Window coordinates of an orthographic camera")
def orthographic_window() -> None:
    """The same in parallel projection."""
    _by_window()
    lens = bpy.context.scene.camera.data
    lens.type, lens.ortho_scale = "ORTHO", 5.0
