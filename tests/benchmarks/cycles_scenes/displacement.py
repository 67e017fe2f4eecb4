"""True displacement: materials that move the vertices of finely subdivided meshes."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from . import stage
from .case import case


def _set() -> None:
    """Light from one side, so that relief shows."""
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 128, 96
    stage.lamp("SUN", "Sun", 3.0, (0, 0, 3), (1.5, 0.8, 1.5), angle=0.05)
    stage.world((0.4, 0.5, 0.65), 0.5)
    stage.camera((0.0, -4.0, 2.4), (0, 0, 0.2), 45.0)


def _displaced(name: str, method: str, color: Any, displacement: Any) -> Any:
    """A diffuse material whose displacement `displacement` makes for its node tree."""
    made = stage.material(name, lambda tree: stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": color}))
    made.displacement_method = method
    output = made.node_tree.get_output_node("CYCLES")
    made.node_tree.links.new(displacement(made.node_tree).outputs[0], output.inputs["Displacement"])
    return made


def _noise(tree: Any, scale: float, coordinates: str = "Object") -> Any:
    where = stage.node(tree, "ShaderNodeTexCoord").outputs[coordinates]
    return stage.node(tree, "ShaderNodeTexNoise", {"Vector": where, "Scale": scale, "Detail": 1.0}).outputs[0]


@case("A landscape: a subdivided plane that is displaced by noise, smooth and flat shaded", bounces=2)
def landscape() -> None:
    """The tutorial's terrain."""
    _set()
    rocks = _displaced("Rock", "DISPLACEMENT", (0.6, 0.5, 0.4), lambda tree: stage.node(
        tree, "ShaderNodeDisplacement", {"Height": _noise(tree, 1.5), "Midlevel": 0.5, "Scale": 1.2}))  # fmt: skip
    ground = stage.add("Ground", stage.grid("Ground", rocks, size=5.0, cells=50), (0, 0.3, 0))
    ground.data.polygons.foreach_set("use_smooth", np.arange(2500) % 50 < 25)


def _bricks(depth: float) -> list[Any]:
    """Two stretched spheres with bricks of this depth, in the object's space and in the world's."""
    _set()
    stage.add("Floor", stage.plane("Floor", stage.diffuse("Floor", (0.3, 0.3, 0.3)), size=12.0))
    y, x = np.mgrid[0:32, 0:32]
    bricks = np.clip(1.5 * np.abs(np.sin(0.2 * x + 0.5 * np.pi * (y // 16)) * np.sin(0.2 * y)), 0.0, 1.0)
    picture = stage.image("Bricks", np.repeat(bricks[..., None], 3, axis=2), "Non-Color")
    made = []
    for k, space in enumerate(("OBJECT", "WORLD")):
        wall = _displaced(f"Wall {space}", "DISPLACEMENT", (0.6, 0.3, 0.2), lambda tree, space=space: stage.node(
            tree, "ShaderNodeDisplacement",
            {"Height": stage.node(tree, "ShaderNodeTexImage", image=picture), "Midlevel": 0.0, "Scale": depth},
            space=space))  # fmt: skip
        body = stage.sphere(f"Body {k}", wall, stage.diffuse("Plain", (0.2, 0.4, 0.6)), radius=0.6, segments=32)
        ob = stage.add(f"Body {k}", body, (-0.9 + 1.8 * k, 0, 0.6), (0.2, 0.1, 0.4), (1.0, 1.3, 0.8))
        divide = ob.modifiers.new("Subdivision", "SUBSURF")
        divide.levels = divide.render_levels = 2
        made.append(body)
    return made


@case("An image as height on spheres with a Subdivision modifier and uneven scale, in both spaces; a UV seam",
      bounces=2)
def displaced_image() -> None:
    """The object's space and the world's."""
    _bricks(0.1)


@case("Displaced faces beside faces of a material that stays, which keep their normals", bounces=2, differs=(
    "shadows of faces that displacement turns over start elsewhere at grazing light",))  # fmt: skip
def displaced_slots() -> None:
    """A second material."""
    for body in _bricks(0.15):
        body.polygons.foreach_set("material_index", (np.arange(len(body.polygons)) % 32 < 6).astype(np.int32))


@case("Vector displacement: in object and tangent space, and the sum of two displacements", bounces=2)
def vector_displacement() -> None:
    """Colours as vectors."""
    _set()

    def colored(tree: Any, space: str) -> Any:
        where = stage.node(tree, "ShaderNodeTexCoord").outputs["Generated"]
        noise = stage.node(tree, "ShaderNodeTexNoise", {"Vector": where, "Scale": 3.0, "Detail": 0.0})
        return stage.node(tree, "ShaderNodeVectorDisplacement",
                          {"Vector": noise.outputs[1], "Midlevel": 0.5, "Scale": 0.8}, space=space)  # fmt: skip

    def both(tree: Any) -> Any:
        one = stage.node(tree, "ShaderNodeDisplacement", {"Height": _noise(tree, 3.0), "Scale": 0.4})
        return stage.node(tree, "ShaderNodeVectorMath", {0: colored(tree, "WORLD"), 1: one}, operation="ADD")

    makers = {"Object": lambda tree: colored(tree, "OBJECT"), "Tangent": lambda tree: colored(tree, "TANGENT"),
              "Sum": both}  # fmt: skip
    for k, (name, make) in enumerate(makers.items()):
        body = _displaced(name, "DISPLACEMENT", (0.3 + 0.2 * k, 0.5, 0.6 - 0.2 * k), make)
        ob = stage.add(name, stage.grid(name, body, size=1.2, cells=40), (-1.35 + 1.35 * k, 0, 0.3), (0.5, 0, 0.3))
        ob.data.polygons.foreach_set("use_smooth", np.ones(1600, bool))


@case("Displacement and bump on a coarse mesh: fine noise that its vertices cannot show", bounces=2)
def displacement_and_bump() -> None:
    """The method "Displacement and Bump"."""
    _set()
    rough = _displaced("Rough", "BOTH", (0.5, 0.5, 0.45), lambda tree: stage.node(
        tree, "ShaderNodeDisplacement", {"Height": _noise(tree, 4.0), "Scale": 0.3}))  # fmt: skip
    ob = stage.add("Rough", stage.grid("Rough", rough, size=3.0, cells=24), (0, 0, 0.2), (0.3, 0, 0))
    ob.data.polygons.foreach_set("use_smooth", np.ones(576, bool))


@case("Displacement on a shared mesh that is placed three times", bounces=2)
def displaced_instances() -> None:
    """The mesh moves once for all objects that share it."""
    _set()
    stage.add("Floor", stage.plane("Floor", stage.diffuse("Floor", (0.3, 0.3, 0.3)), size=12.0))
    stone = _displaced("Stone", "DISPLACEMENT", (0.5, 0.5, 0.45), lambda tree: stage.node(
        tree, "ShaderNodeDisplacement", {"Height": _noise(tree, 2.0, "Generated"), "Scale": 0.6}))  # fmt: skip
    mesh = stage.sphere("Stone", stone, radius=0.5, segments=64)
    for k in range(3):
        stage.add(f"Stone {k}", mesh, (-1.2 + 1.2 * k, 0, 0.45), (0.4 * k, 0.2, 0), 0.8 + 0.2 * k)
