"""Scenes of several surfaces of gloss and glass, whose derivatives can be compared with differences.

Different estimators have the light of narrow and of wide lobes, of small and of large lights, of mirrors and of rough
surfaces. Where one scene has all of them, each part must be estimated once.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from edgegrad import AreaLight, Material, Mesh, Mixture, PointLight, Scene, SpotLight, SunLight
from edgegrad import expression as e
from edgegrad.scene import parameters
from edgegrad.scene.light import Light
from tests.support import shapes as solids
from tests.support.rich_scene import turn
from tests.torture.drawing.draw import Draw
from tests.torture.tame import ABSENT as TAME
from tests.torture.tame import (
    Comparison,
    curve_of,
    drawn_bounces,
    drawn_camera,
    drawn_images,
    drawn_light,
    drawn_world,
    lamp_paths,
)

# Beginnings of the plan's sentences on parts that do not keep derivatives from being compared.
ABSENT = (*TAME, "seen in mirrors", "seen in lobes")
MATERIALS: dict[str, dict[str, Any]] = {
    "matte": {}, "rough diffuse": {"kind": "DIFFUSE", "diffuse_roughness": 0.6}, "veil": {"alpha": 0.5},
    "metal": {"metallic": 1.0}, "gloss": {"kind": "GLOSSY"}, "plastic": {"specular_ior_level": 0.5},
    "coat": {"coat_weight": 0.8, "roughness": 0.6}, "layers": {"coat_weight": 0.6, "specular_ior_level": 0.5},
    "rough glass": {"kind": "GLASS", "ior": 1.3}, "brushed": {"metallic": 1.0, "anisotropy": 0.5},
    "mirror": {"kind": "GLOSSY", "roughness": 0.0},
}  # fmt: skip
# Mirrors are rare: plans name parts of the light that they throw on other surfaces, and then nothing is compared.
DRAWN = tuple(name for name in MATERIALS if name != "mirror") * 2 + ("gloss", "metal", "mirror")
# From lobes that all estimators follow to lobes that none treats in its own way.
ROUGHNESS = (0.05, 0.1, 0.14, 0.2, 0.25, 0.3, 0.4, 0.5, 0.7)
PARAMETERS = ("vertices", "vertices", "vertices", "transform", "light place", "light size", "light direction",
              "camera pose", "roughness", "color", "sky rotation")  # fmt: skip
MESHES = ("body", "other", "floor", "wall")


def comparison(seed: int) -> Comparison:
    """The comparison of a seed; consecutive seeds go through the parameters."""
    draw = Draw((seed, 9))
    parameter = PARAMETERS[seed % len(PARAMETERS)]
    names = {mesh: draw.one(DRAWN) for mesh in MESHES}
    materials: dict[str, Material | Mixture] = {mesh: _material(draw, name) for mesh, name in names.items()}
    camera, meshes, lights = drawn_camera(draw, parameter), _meshes(draw), _lights(draw, parameter)
    if draw.chance(0.3):
        materials["glow"] = Material(np.zeros(3), np.array([6.0, 5.0, 4.0]))
        vertices, faces = solids.sheet(2, draw.one((0.3, 0.8)))
        place = [draw.uniform(-1.0, 1.0), draw.uniform(-1.0, 1.0), 2.0]
        meshes["lamp"] = Mesh(vertices @ turn(np.pi, 0.0, 0.0).T + place, faces, ("glow",))
    _texture(Draw((seed, 10)), meshes, materials)
    scene = Scene(camera, meshes, materials, lights, drawn_world(draw, parameter), drawn_images(draw))
    path = _path(draw, scene, parameter)
    curve, step = curve_of(draw, scene, path)
    return Comparison(scene, path, curve, step, draw.one((2, 2, 3, 4)), f"{names['body']}, {names['floor']}", parameter,
                      drawn_bounces(seed))


def _material(draw: Draw, name: str) -> Material:
    made: dict[str, Any] = {"base_color": draw.rng.uniform(0.4, 0.9, 3), "roughness": draw.one(ROUGHNESS),
            "coat_roughness": draw.one(ROUGHNESS)} | MATERIALS[name]  # fmt: skip
    return Material(**made)


def _meshes(draw: Draw) -> dict[str, Mesh]:
    """A body and another one, clear of each other, of a floor and of a wall: nothing touches."""
    shapes = (lambda: solids.cube(1.1), lambda: solids.ball(1, 0.75), lambda: solids.sheet(2, 1.4))

    def solid(material: str, at: tuple[float, float, float], size: float) -> Mesh:
        vertices, faces = draw.one(shapes)()
        smooth = len(faces) > 60 and draw.chance(0.5)
        vertices = size * vertices @ turn(*draw.rng.normal(scale=0.5, size=3)).T + at
        return Mesh(vertices, faces, (material,), smoothing=faces.copy() if smooth else None)

    floor, faces = solids.sheet(2, 7.0)
    wall = solids.sheet(2, 5.0)[0] @ turn(np.pi / 2, 0.0, 0.0).T @ turn(0.0, 0.0, draw.uniform(-3.0, 3.0)).T
    across = np.cross(wall[1] - wall[0], wall[2] - wall[0])
    away = -2.6 / np.linalg.norm(across) * across
    return {"body": solid("body", (0.1, 0.0, 0.5), 0.8), "other": solid("other", (-0.9, 0.8, 0.3), 0.5),
            "floor": Mesh(floor - [0.0, 0.0, 0.7], faces, ("floor",)),
            "wall": Mesh(wall + away + [0.0, 0.0, 1.9], faces, ("wall",))}  # fmt: skip


def _texture(draw: Draw, meshes: dict[str, Mesh], materials: dict[str, Material | Mixture]) -> None:
    """In some scenes, give surfaces an image as their colour or roughness, with or without seams."""
    if not draw.chance(0.3):
        return
    for name in MESHES:
        mesh, material = meshes[name], materials[name]
        if not draw.chance(0.6) or not isinstance(material, Material):
            continue
        places = mesh.vertices @ draw.rng.normal(scale=0.4, size=(3, 2))
        seams = draw.rng.normal(scale=0.5, size=(len(mesh.faces), 1, 2)) if draw.chance(0.4) else 0.0
        mesh.attributes = {"UVMap": (places[mesh.faces] + seams).astype(np.float32)}
        image = e.ImageTexture("colors", e.Attribute("UVMap"))
        if draw.chance(0.7) or not material.roughness:
            material.textures = {"base_color": image}
        else:
            material.textures = {"roughness": e.Math("MULTIPLY", e.Channel(image, 0), material.roughness)}


def _lights(draw: Draw, parameter: str) -> dict[str, Light]:
    """Of one to three lights, some are small."""
    lights = {"lamp": drawn_light(draw, parameter)}
    for k in range(draw.one((0, 0, 1, 2))):
        lights[f"more {k}"] = drawn_light(draw, "")
    for one in lights.values():
        if not draw.chance(0.4):
            continue
        if isinstance(one, AreaLight):
            one.size = 0.3 * one.size
        elif isinstance(one, PointLight | SpotLight):
            one.radius *= 0.3
        elif isinstance(one, SunLight):
            one.angle *= 0.3
    return lights


def _path(draw: Draw, scene: Scene, parameter: str) -> str:
    mesh = draw.one(MESHES)
    if parameter == "roughness":
        rough = [name for name in MESHES if parameters.get(scene, f"materials.{name}.roughness") > 0.0]
        return f"materials.{draw.one(rough)}.roughness" if rough else "materials.body.base_color"
    choices = {
        **lamp_paths(scene.lights["lamp"]), "vertices": (f"meshes.{mesh}.vertices",),
        "transform": (f"meshes.{mesh}.transform",), "camera pose": ("camera.to_world",),
        "color": (f"materials.{mesh}.base_color",), "sky rotation": ("world.rotation",),
    }  # fmt: skip
    return choices[parameter][0]
