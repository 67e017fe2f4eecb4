"""A whole exterior: a house, trees as instances, fields, sun and sky."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np

from . import sky, stage
from .case import case


def _ground() -> Any:
    """Rolling ground, smooth-shaded, coloured by a vertex attribute."""

    def shader(tree: Any) -> Any:
        paint = stage.node(tree, "ShaderNodeVertexColor", layer_name="Grass")
        return stage.node(tree, "ShaderNodeBsdfPrincipled", {"Base Color": paint.outputs["Color"], "Roughness": 0.9})

    made = stage.grid("Ground", stage.material("Ground", shader), size=60.0, cells=60)
    points = np.array([v.co for v in made.vertices])
    far = np.clip((np.hypot(points[:, 0], points[:, 1]) - 6.0) / 10.0, 0.0, 1.0)
    points[:, 2] = far * (0.8 * np.sin(0.35 * points[:, 0]) + 0.6 * np.cos(0.27 * points[:, 1]))
    made.vertices.foreach_set("co", points.ravel())
    made.polygons.foreach_set("use_smooth", np.ones(len(made.polygons), bool))
    layer = made.color_attributes.new("Grass", "FLOAT_COLOR", "POINT")
    rng = np.random.default_rng(5)
    green = rng.uniform(0.6, 1.0, (len(points), 1)) * np.array([[0.15, 0.35, 0.08]])
    layer.data.foreach_set("color", np.column_stack([green, np.ones(len(points))]).ravel())
    return made


def _leaves(one: Any) -> Any:
    """A crown of 400 quads that are turned at random."""
    rng = np.random.default_rng(11)
    centre = rng.normal(size=(400, 3))
    centre *= (rng.uniform(0.4, 1.0, (400, 1)) ** (1 / 3)) / np.linalg.norm(centre, axis=1, keepdims=True)
    u, v = rng.normal(size=(2, 400, 3))
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v -= u * np.sum(u * v, axis=1, keepdims=True)
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    corners = np.stack([centre + 0.12 * (a * u + b * v) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))], axis=1)
    faces = np.arange(1600).reshape(400, 4).tolist()
    return stage.mesh("Crown", (corners.reshape(-1, 3) * [1.2, 1.2, 1.4]).tolist(), faces, one)


def _trees() -> None:
    def leaf(tree: Any) -> Any:
        front = stage.node(tree, "ShaderNodeBsdfPrincipled", {"Base Color": (0.1, 0.3, 0.05), "Roughness": 0.5})
        through = stage.node(tree, "ShaderNodeBsdfTranslucent", {"Color": (0.3, 0.5, 0.08)})
        return stage.node(tree, "ShaderNodeMixShader", {"Fac": 0.4, 1: front, 2: through})

    group = bpy.data.collections.new("Tree")
    trunk = stage.cylinder(
        "Trunk", stage.diffuse("Bark", (0.2, 0.13, 0.08)), radius=0.18, top=0.08, depth=2.0, segments=10
    )
    parts = [
        stage.add("Trunk", trunk, (0, 0, 1.0)),
        stage.add("Crown", _leaves(stage.material("Leaf", leaf)), (0, 0, 2.8)),
    ]
    for ob in parts:
        bpy.context.scene.collection.objects.unlink(ob)
        group.objects.link(ob)
    rng = np.random.default_rng(2)
    places = [(-4.5, 2.0), (-3.4, 5.0), (4.6, 3.0), (5.5, 6.5), (-6.5, 7.0), (1.5, 9.0), (8.0, 9.0), (-9.5, 3.5)]
    for k, (x, y) in enumerate(places):
        ob = stage.add(
            f"Tree {k}", None, (x, y, -0.1), (0, 0, rng.uniform(0, 2 * math.pi)), float(rng.uniform(0.8, 1.4))
        )
        ob.instance_type, ob.instance_collection = "COLLECTION", group


def _house() -> None:
    plaster = stage.diffuse("Plaster", (0.8, 0.75, 0.65))
    body = stage.cube("House", plaster, size=2.0)
    stage.add("House", body, (0.2, 4.0, 1.2), (0, 0, 0.25), [1.8, 1.4, 1.2])
    tiles = stage.principled("Tiles", (0.45, 0.15, 0.1), Roughness=0.7)
    roof = stage.mesh("Roof", [(-2, -1.7, 0), (2, -1.7, 0), (2, 1.7, 0), (-2, 1.7, 0), (-2, 0, 1.2), (2, 0, 1.2)],
                      [(0, 1, 5, 4), (2, 3, 4, 5), (0, 4, 3), (1, 2, 5), (0, 3, 2, 1)], tiles)  # fmt: skip
    stage.add("Roof", roof, (0.2, 4.0, 2.4), (0, 0, 0.25))
    pane = stage.principled("Window", (0.02, 0.03, 0.04), Roughness=0.05, Specular_IOR_Level=0.8)
    turn = 0.25
    for k, x in enumerate((-0.9, 0.9)):
        centre = (
            0.2 + x * math.cos(turn) + 1.405 * math.sin(turn),
            4.0 + x * math.sin(turn) - 1.405 * math.cos(turn),
            1.4,
        )
        stage.add(f"Window {k}", stage.plane(f"Window {k}", pane, size=0.8), centre, (math.pi / 2, 0, turn))
    car = stage.principled("Car paint", (0.1, 0.2, 0.6), Metallic=0.6, Roughness=0.3, Coat_Weight=1.0)
    stage.add("Car", stage.sphere("Car", car, segments=48), (2.6, 1.0, 0.45), (0, 0, 0.4), [0.9, 0.45, 0.4])


@case("An exterior: a house, trees as instances, rolling ground, sun and an environment image", bounces=4, samples=96)
def exterior() -> None:
    """A village house at noon."""
    stage.add("Ground", _ground())
    _trees()
    _house()
    tree = stage.world()
    texture = stage.node(tree, "ShaderNodeTexEnvironment", image=sky.panorama(sun=1.0))
    tree.links.new(texture.outputs["Color"], tree.nodes["Background"].inputs["Color"])
    stage.lamp("SUN", "Sun", 3.0, (0, 0, 5), (0, 0, 0), angle=0.01, color=(1.0, 0.95, 0.85))
    bpy.data.objects["Sun"].rotation_euler = stage.aim((-4, -5, 7), (0, 0, 0))
    stage.camera((1.0, -7.5, 2.2), (0.2, 3.0, 1.4), 32.0)
