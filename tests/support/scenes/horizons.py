"""Smooth bodies whose own horizon hides light from them."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace

import numpy as np

import edgegrad
from tests.support import shapes
from tests.support.motions import camera_moves
from tests.support.rich_scene import pose, turn
from tests.support.shapes import displaced_sphere
from tests.support.small_scenes import Floats, Make, camera, glowing, matte, rectangle

SIDE = np.array([1.9, 0.7, 0.5])
# What shines along -Z shines at the body.
AT_BODY = np.stack([np.array([0.0, 0.0, -1.0]), np.array([-0.3465, 0.938, 0.0]), np.array([0.938, 0.3465, 0.0])], 1)
LIGHTS: dict[str, edgegrad.PointLight | edgegrad.SpotLight | edgegrad.SunLight | edgegrad.AreaLight] = {
    "sphere": edgegrad.PointLight(SIDE, 90.0, 0.5, True),
    "disk": edgegrad.PointLight(SIDE, 90.0, 0.5, False),
    "spot": edgegrad.SpotLight(SIDE, np.array([-1.0, -0.3, -0.2]), 90.0, 1.3, 0.5, 0.4),
    "rectangle": edgegrad.AreaLight(pose(AT_BODY, *SIDE.tolist()), np.array([0.9, 1.2]), "RECTANGLE", 60.0),
    "spread": edgegrad.AreaLight(pose(AT_BODY, *SIDE.tolist()), np.array([0.9, 1.2]), "RECTANGLE", 60.0, 1.9),
    "ellipse": edgegrad.AreaLight(pose(AT_BODY, *SIDE.tolist()), np.array([0.9, 1.2]), "ELLIPSE", 60.0),
    "sun": edgegrad.SunLight(np.array([-1.0, -0.3, -0.1]), 3.0, 0.5),
}


def body(material: str = "clay") -> edgegrad.Mesh:
    """A convex ball of 80 faces, shaded as if it were round."""
    data = displaced_sphere(2, 0.0)
    vertices, faces = np.asarray(data["vertices"]), np.asarray(data["faces"], np.int32)
    return edgegrad.Mesh(vertices @ turn(0.3, 0.5, 0.2), faces, (material,), smoothing=faces)


def body_under(light: str) -> edgegrad.Scene:
    """The body lit by a light, an emissive mesh ("mesh"), the sky ("sky", "sky image") or a bright wall ("wall")."""
    scene = edgegrad.Scene(camera((0, 0.4, 3.6), size=24), {"body": body()}, {"clay": matte(0.7, 0.6, 0.5)})
    if light == "mesh":
        vertices, faces = shapes.ball(1, 0.5)
        scene.meshes["lamp"] = edgegrad.Mesh(vertices + SIDE, faces, ("lamp",))
        scene.materials["lamp"] = glowing(15.0)
    elif light.startswith("sky"):
        scene.world = edgegrad.World(np.array([0.5, 0.6, 0.8]), 1.0)
        if light == "sky image":
            pixels = np.full((8, 16, 3), 0.2, np.float32)
            pixels[1, 3:5] = [9.0, 8.0, 6.0]
            pixels[3:5, 10] = [1.0, 3.0, 9.0]
            scene.images["sky"] = edgegrad.Image(pixels)
            scene.world = edgegrad.World(np.ones(3), 1.0, "sky", turn(0.1, 0.4, -0.3))
    elif light == "wall":
        scene.meshes["wall"] = rectangle((0.0, -1.2, 0.0), (0, 0, 1.5), (1.5, 0, 0), "wall")
        scene.materials["wall"] = matte(0.8, 0.7, 0.4)
        scene.lights["lamp"] = edgegrad.PointLight(np.array([-1.5, 1.5, 0.5]), 200.0)
    else:
        scene.lights["lamp"] = deepcopy(LIGHTS[light])
    return scene


def moves(make: Callable[[], edgegrad.Scene], name: str) -> Make:
    """A mesh moves, turns and stretches."""

    def moved(theta: float) -> edgegrad.Scene:
        scene = make()
        mesh = scene.meshes[name]
        center = mesh.vertices.mean(axis=0)
        around = mesh.vertices - center
        mesh.vertices = mesh.vertices + theta * (np.array([0.5, 0.3, -0.4]) + 0.8 * around[:, [1, 2, 0]])
        return scene

    return moved


def body_moves(light: str) -> Make:
    return moves(lambda: body_under(light), "body")


def light_changes(light: str, **rates: float | Floats) -> tuple[Make, list[str]]:
    """Numbers of the light grow."""

    def make(theta: float) -> edgegrad.Scene:
        scene = body_under(light)
        lamp = scene.lights["lamp"]
        grown = {field: getattr(lamp, field) + theta * np.asarray(rate) for field, rate in rates.items()}
        scene.lights["lamp"] = replace(lamp, **{k: (float(v) if np.ndim(v) == 0 else v) for k, v in grown.items()})
        return scene

    return make, [f"lights.lamp.{field}" for field in rates]


def sky_turns(theta: float) -> edgegrad.Scene:
    scene = body_under("sky image")
    scene.world = replace(scene.world, rotation=scene.world.rotation @ turn(0.3 * theta, 0.5 * theta, -0.4 * theta))
    return scene


def view_moves(light: str) -> Make:
    return camera_moves(lambda: body_under(light))


def glossy(theta: float) -> edgegrad.Scene:
    """Rough metal."""
    scene = body_moves("rectangle")(theta)
    scene.materials["clay"] = edgegrad.Material(np.array([0.8, 0.6, 0.4]), roughness=0.5, metallic=1.0)
    return scene


def translucent(theta: float) -> edgegrad.Scene:
    """Light from both sides counts, each by a lobe of its own."""
    scene = body_moves("rectangle")(theta)
    scene.materials["thin"] = edgegrad.Material(np.array([0.8, 0.6, 0.4]), kind="TRANSLUCENT")
    scene.materials["both"] = edgegrad.Mixture(("clay", "thin"), np.array([0.5, 0.5]))
    # A bowl, whose inner side is seen and whose outer one is lit.
    mesh, still = scene.meshes["body"], body()
    kept = mesh.faces[still.vertices[still.faces].mean(axis=1)[:, 2] < 0.3]
    scene.meshes["body"] = edgegrad.Mesh(mesh.vertices, kept, ("both",), smoothing=kept)
    return scene


def placed(theta: float) -> edgegrad.Scene:
    """Two instances, one mirrored."""
    scene = body_under("rectangle")
    scene.meshes["body"].instances = np.stack([
        pose(0.6 * turn(0.2, 0.5 + 1.5 * theta, 0.1), 0.5, 0.2, 0.2),
        pose(0.5 * turn(0.1, 0.3, 0.5 - theta) @ np.diag([-0.8, 0.7, 1.1]), -0.7, 0.1, 0.0),
    ])
    return scene


def seen_in_wall(theta: float) -> edgegrad.Scene:
    """A body that the camera doesn't see, whose light a wall takes: the cut is at the path's second vertex."""
    scene = body_moves("rectangle")(theta)
    scene.meshes["wall"] = rectangle((0.0, -1.2, 0.0), (0, 0, 1.5), (1.5, 0, 0), "wall")
    scene.materials["wall"] = matte(0.8, 0.7, 0.4)
    scene.lights["lamp"] = replace(LIGHTS["rectangle"], receivers=("body",))
    scene.camera = camera((0, 1.6, 3.6), (0, -1.0, 0.6), size=24)
    return scene


BODY = ["meshes.body.vertices"]
CASES: dict[str, tuple[Make, list[str]]] = {
    **{f"{light}: body moves": (body_moves(light), BODY) for light in (*LIGHTS, "mesh", "sky", "sky image")},
    **{f"{light}: light moves": light_changes(light, position=np.array([1.0, -0.4, 0.3]))
       for light in ("sphere", "disk", "spot")},
    **{f"{light}: light grows": light_changes(light, radius=0.6) for light in ("sphere", "disk")},
    "rectangle: light grows": light_changes("rectangle", size=np.array([0.7, -0.3])),
    "sun: light turns": light_changes("sun", direction=np.array([0.3, 0.1, 0.6])),
    "sun: light grows": light_changes("sun", angle=1.0),
    "mesh: light moves": (moves(lambda: body_under("mesh"), "lamp"), ["meshes.lamp.vertices"]),
    "sky image: light turns": (sky_turns, ["world.rotation"]),
    **{f"{light}: camera moves": (view_moves(light), ["camera.to_world"]) for light in ("sphere", "disk")},
    "glossy": (glossy, BODY),
    "translucent": (translucent, BODY),
    "instances": (placed, ["meshes.body.instances"]),
}
DEEP: dict[str, tuple[Make, list[str]]] = {
    "body before a wall": (body_moves("wall"), BODY),
    "wall moves": (moves(lambda: body_under("wall"), "wall"), ["meshes.wall.vertices"]),
    "seen by way of a wall": (seen_in_wall, BODY),
}
