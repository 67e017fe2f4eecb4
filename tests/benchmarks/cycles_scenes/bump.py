"""Bump maps, displacement that is rendered as bump, and what is baked."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

from . import stage
from .case import case

Height = Callable[[Any], Any]  # the height's socket or node in a node tree


def _small(width: float = 6.0) -> None:
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 120, 90
    stage.studio(width=width)


def _heights(size: int, cells: int) -> Any:
    """Round bumps in a square grid, as an image of heights."""
    y, x = ((np.mgrid[0:size, 0:size] + 0.5) / size * cells) % 1.0 * 2.0 - 1.0
    height = np.maximum(1.0 - x**2 - y**2, 0.0)
    return stage.image(f"Heights {size}", np.repeat(height[..., None], 3, axis=2), "Non-Color")


def _bumped(name: str, height: Height, kind: str = "ShaderNodeBsdfPrincipled", normal: Height | None = None,
            invert: bool = False, strength: float = 1.0, distance: float = 0.05, width: float | None = None,
            **inputs: Any) -> Any:  # fmt: skip
    """A material whose normal is that of a Bump node."""

    def shader(tree: Any) -> Any:
        bump = stage.node(tree, "ShaderNodeBump", {"Strength": strength, "Distance": distance, "Height": height(tree)},
                          invert=invert)  # fmt: skip
        if normal is not None:
            tree.links.new(normal(tree), bump.inputs["Normal"])
        if width is not None:
            bump.inputs["Filter Width"].default_value = width
        values = {key.replace("_", " "): value for key, value in inputs.items()}
        return stage.node(tree, kind, {**values, "Normal": bump.outputs["Normal"]})

    return stage.material(name, shader)


def _image(image: Any) -> Height:
    return lambda tree: stage.node(tree, "ShaderNodeTexImage", image=image).outputs["Color"]


def _texture(kind: str, output: int | str = 0, coordinate: str = "Object", settings: dict[str, Any] | None = None,
             **inputs: Any) -> Height:  # fmt: skip
    def make(tree: Any) -> Any:
        place = stage.node(tree, "ShaderNodeTexCoord").outputs[coordinate]
        values = {key.replace("_", " "): value for key, value in inputs.items()}
        return stage.node(tree, kind, {"Vector": place, **values}, **(settings or {})).outputs[output]

    return make


@case("Bump of images: coarse and fine texels, strength, distance, inverted")
def image_bump() -> None:
    """Balls and tiles."""
    _small()
    fine, coarse = _image(_heights(256, 8)), _image(_heights(24, 4))
    stage.row([
        _bumped("Diffuse", fine, Specular_IOR_Level=0.0),
        _bumped("Weak", fine, strength=0.3, Roughness=0.3),
        _bumped("Inverted", fine, invert=True, Specular_IOR_Level=0.0),
        _bumped("Metal", fine, distance=0.03, Metallic=1.0, Roughness=0.35),
    ], y=-0.8)  # fmt: skip
    stage.add("Tile", stage.plane("Tile", _bumped("Coarse", coarse, distance=0.1, Specular_IOR_Level=0.0), size=2.0),
              (-1.2, 1.2, 0.9), (1.1, 0, 0.2))  # fmt: skip
    stage.add("Back", stage.plane("Back", _bumped("Behind", fine, distance=0.04, Roughness=0.6), size=1.8),
              (1.2, 1.2, 0.9), (1.1 + np.pi, 0, -0.2))  # fmt: skip


@case("Bump of procedural textures on scaled, mirrored and instanced objects")
def procedural_bump() -> None:
    """Noise, Voronoi, waves, bricks."""
    _small()
    noise = _texture("ShaderNodeTexNoise", Scale=4.0, Detail=2.0)
    ridges = _texture("ShaderNodeTexNoise", coordinate="Generated", settings={"noise_type": "RIDGED_MULTIFRACTAL"},
                      Scale=6.0, Detail=3.0)  # fmt: skip
    cells = _texture("ShaderNodeTexVoronoi", "Distance", settings={"feature": "SMOOTH_F1"}, Scale=5.0)
    waves = _texture("ShaderNodeTexWave", "Fac", Scale=3.0, Distortion=2.0)
    balls = stage.row([
        _bumped("Noise", noise, distance=0.15, Specular_IOR_Level=0.0),
        _bumped("Ridges", ridges, distance=0.02, Specular_IOR_Level=0.0),
        _bumped("Cells", cells, distance=0.2, Roughness=0.4),
        _bumped("Waves", waves, distance=0.05, Metallic=1.0, Roughness=0.4),
    ], y=-0.8)  # fmt: skip
    balls[0].scale, balls[1].scale = (1.0, 0.6, 1.2), (-1.0, 1.0, 1.0)
    for k, place in enumerate([(-1.4, 1.3, 0.5), (1.4, 1.3, 0.5)]):
        stage.add(f"Copy {k}", balls[2].data, place, (0.3, 0.2 * k, 0.5), 1.0 + 0.4 * k)


@case("Bump on bump, bump on a normal map, and bent normals that colour a surface")
def bump_chains() -> None:
    """Balls."""
    _small()
    fine = _image(_heights(256, 8))
    noise = _texture("ShaderNodeTexNoise", Scale=3.0, Detail=1.0)

    def inner(tree: Any) -> Any:
        return stage.node(tree, "ShaderNodeBump", {"Distance": 0.2, "Height": noise(tree)}).outputs[0]

    def mapped(tree: Any) -> Any:
        y, x = np.mgrid[0:64, 0:64] / 64.0
        normal = np.stack([0.5 + 0.2 * np.sin(12.6 * x), 0.5 + 0.2 * np.cos(12.6 * y), np.full_like(x, 0.95)], axis=-1)
        image = bpy.data.images.get("Normals") or stage.image("Normals", normal, "Non-Color", is_float=True)
        texture = stage.node(tree, "ShaderNodeTexImage", image=image)
        return stage.node(tree, "ShaderNodeNormalMap", {"Strength": 0.8, "Color": texture.outputs["Color"]}).outputs[0]

    def faced(tree: Any) -> Any:
        weight = stage.node(tree, "ShaderNodeLayerWeight", {"Blend": 0.4, "Normal": inner(tree)})
        return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": weight.outputs["Facing"]})

    def mixed(tree: Any) -> Any:
        mix = stage.node(tree, "ShaderNodeMix", data_type="VECTOR")
        mix.inputs[0].default_value = 0.6
        tree.links.new(mapped(tree), mix.inputs[4])
        tree.links.new(inner(tree), mix.inputs[5])
        return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Normal": mix.outputs[1]})

    stage.row([
        _bumped("Bump on bump", fine, normal=inner, Specular_IOR_Level=0.0),
        _bumped("Bump on map", fine, normal=mapped, distance=0.03, Specular_IOR_Level=0.0),
        stage.material("Facing", faced),
        stage.material("Mixed", mixed),
    ], y=-0.6)  # fmt: skip


@case("Bump of glass, glossy and translucent surfaces", bounces=6, samples=96)
def bump_glass() -> None:
    """Rough glass, so that caustics stay quiet."""
    _small(5.0)
    noise = _texture("ShaderNodeTexNoise", Scale=3.0, Detail=0.0)
    stage.row([
        _bumped("Glass", noise, "ShaderNodeBsdfGlass", distance=0.05, Roughness=0.4),
        _bumped("Glossy", noise, "ShaderNodeBsdfAnisotropic", distance=0.05, Roughness=0.4),
        _bumped("Translucent", noise, "ShaderNodeBsdfTranslucent", distance=0.1),
    ])  # fmt: skip


@case("Fine bump far away: heights that vary within a pixel, filter widths")
def fine_bump() -> None:
    """A floor of noise up to the horizon."""
    noise = _texture("ShaderNodeTexNoise", Scale=8.0, Detail=8.0)
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 120, 90
    stage.add("Floor", stage.plane("Floor", _bumped("Fine", noise, distance=0.05, Specular_IOR_Level=0.0), size=200.0))
    stage.row([
        _bumped("Sharp", noise, distance=0.05, Specular_IOR_Level=0.0),
        _bumped("Blurred", noise, distance=0.05, width=4.0, Specular_IOR_Level=0.0),
    ], y=0.0)  # fmt: skip
    stage.lamp("SUN", "Sun", 2.0, (0, 0, 0), (1.0, 0.5, -1.0), angle=0.1)
    stage.world((0.3, 0.4, 0.6), 0.5)
    stage.camera((0.0, -5.0, 1.4), (0.0, 0.0, 0.7), 35.0)


def _displaced(name: str, height: Height, space: str | None, scale: float = 0.1, **inputs: Any) -> Any:
    """A material whose output has a displacement; without a space the height is linked itself."""
    made = stage.principled(name, **inputs)
    tree = made.node_tree
    output = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    if space is None:
        tree.links.new(height(tree).outputs[0], output.inputs["Displacement"])
    else:
        moved = stage.node(tree, "ShaderNodeDisplacement", {"Height": height(tree), "Midlevel": 0.3, "Scale": scale},
                           space=space)  # fmt: skip
        tree.links.new(moved.outputs[0], output.inputs["Displacement"])
    return made


@case("Displacement rendered as bump, with its scale, in object and world space")
def displacement_bump() -> None:
    """Balls of several sizes."""
    _small()
    noise = _texture("ShaderNodeTexNoise", Scale=4.0, Detail=1.0)
    balls = stage.row([
        _displaced("Object", noise, "OBJECT", Specular_IOR_Level=0.0),
        _displaced("World", noise, "WORLD", Specular_IOR_Level=0.0),
        _displaced("Scaled", noise, "OBJECT", Specular_IOR_Level=0.0),
        _displaced("Plastic", _image(_heights(128, 6)), "OBJECT", 0.05, Roughness=0.3),
    ], y=-0.6)  # fmt: skip
    balls[2].scale = (1.6, 1.6, 1.6)
    balls[2].location.z = 0.9
    both = _displaced("Both", noise, "OBJECT", Specular_IOR_Level=0.0)
    bump = stage.node(both.node_tree, "ShaderNodeBump", {"Distance": 0.02, "Height": _texture(
        "ShaderNodeTexWave", "Fac", Scale=6.0)(both.node_tree)})  # fmt: skip
    shader = next(node for node in both.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    both.node_tree.links.new(bump.outputs[0], shader.inputs["Normal"])
    stage.row([both, _displaced("Raw", lambda tree: stage.node(tree, "ShaderNodeVectorMath", {0: _texture(
        "ShaderNodeTexNoise", "Color", Scale=3.0)(tree), "Scale": 0.2}, operation="SCALE"), None,
        Specular_IOR_Level=0.0)], y=1.2)  # fmt: skip


@case("Images that are missing: files that are gone, nodes without an image")
def missing_images() -> None:
    """Balls that Cycles renders magenta."""
    _small()

    def gone(name: str, space: str = "sRGB") -> Any:
        image = bpy.data.images.new(name, 8, 8)
        image.source = "FILE"
        image.filepath = f"//{name}.png"
        image.colorspace_settings.name = space
        return image

    def shader(image: Any, output: str = "Color") -> Any:
        def make(tree: Any) -> Any:
            texture = stage.node(tree, "ShaderNodeTexImage", image=image).outputs[output]
            return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": texture})

        return make

    stage.row([
        stage.material("Gone", shader(gone("gone"))),
        stage.material("Data", shader(gone("data", "Non-Color"))),
        stage.material("None", shader(None)),
        stage.material("Alpha", shader(gone("alpha"), "Alpha")),
    ], y=-0.6)  # fmt: skip


def _unreadable(tree: Any) -> Any:
    """A node that is baked, of one colour."""
    return stage.node(tree, "ShaderNodeWavelength", {"Wavelength": 590.0})


@case("Baked values on faces smaller than a texel, beside large faces of another material")
def baked_tiny_faces() -> None:
    """A floor with a fine cloud of small squares above it."""
    _small()
    rng = np.random.default_rng(3)
    place = rng.uniform(-1.0, 1.0, (600, 3)) * (2.2, 1.2, 0.4) + (0.0, 0.0, 0.7)
    side = np.array([(-1, 0, -1), (1, 0, -1), (1, 0, 1), (-1, 0, 1)]) * 0.03
    points = np.concatenate([(place[:, None] + side).reshape(-1, 3), [(-40, 40, -20), (40, 40, -20), (40, 40, 40),
                                                                     (-40, 40, 40)]])  # fmt: skip
    faces = np.arange(len(points)).reshape(-1, 4)
    small = stage.material("Small", lambda tree: stage.node(tree, "ShaderNodeEmission", {"Color": _unreadable(tree)}))
    mesh = stage.mesh("Cloud", points.tolist(), faces.tolist(), small, stage.diffuse("Wall", (0.4, 0.4, 0.4)))
    mesh.polygons[len(faces) - 1].material_index = 1
    stage.add("Cloud", mesh)


@case("Materials that are baked on instances made by geometry nodes")
def baked_instances() -> None:
    """A grid of cubes."""
    _small()
    group = bpy.data.node_groups.new("Instances", "GeometryNodeTree")
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    made = stage.material("Baked", lambda tree: stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": _unreadable(tree)}))
    grid = stage.node(group, "GeometryNodeMeshGrid", {"Size X": 4.0, "Size Y": 2.0, "Vertices X": 4, "Vertices Y": 3})
    cube = stage.node(group, "GeometryNodeMeshCube", {"Size": (0.6, 0.6, 0.6)})
    copies = stage.node(group, "GeometryNodeInstanceOnPoints", {"Points": grid, "Instance": cube})
    painted = stage.node(group, "GeometryNodeSetMaterial", {"Geometry": copies, "Material": made})
    stage.node(group, "NodeGroupOutput", {0: painted})
    ob = stage.add("Instances", stage.plane("Instances", size=1.0), (0, 0, 0.4))
    ob.modifiers.new("Instances", "NODES").node_group = group


@case("Textures that are baked, as fine as the camera sees them")
def baked_textures() -> None:
    """Balls with noise whose mapping is a setting of the node, and a normal in object space."""
    _small()

    def noise(tree: Any) -> Any:
        made = stage.node(tree, "ShaderNodeTexNoise", {"Scale": 3.0, "Detail": 1.0})
        made.texture_mapping.scale = (2.0, 1.0, 1.5)
        return made

    def colored(tree: Any) -> Any:
        return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": noise(tree).outputs["Color"]})

    def bent(tree: Any) -> Any:
        color = stage.node(tree, "ShaderNodeCombineColor", {0: 0.7, 1: 0.4, 2: 0.9})
        normal = stage.node(tree, "ShaderNodeNormalMap", {"Strength": 0.5, "Color": color}, space="OBJECT")
        return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Normal": normal})

    stage.row([
        stage.material("Colored", colored),
        _bumped("Bumped", lambda tree: noise(tree).outputs[0], distance=0.1, Specular_IOR_Level=0.0),
        stage.material("Object space", bent),
    ], y=-0.6)  # fmt: skip
