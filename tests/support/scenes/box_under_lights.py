"""A box over a floor under every kind of light, and every way in which its shadow moves."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace

import numpy as np

import edgegrad
from tests.support import shapes
from tests.support.rich_scene import pose, turn
from tests.support.small_scenes import Floats, Make, box, camera, glowing, matte, rectangle

ABOVE = camera((0, 3.2, 2.4), (0, 0, 0.1), 24)
DOWN = turn(-0.5 * np.pi, 0, 0)  # what shines along -Z shines along -Y
TILTED = turn(0.0, 0.0, -0.35) @ DOWN


def at(rotation: Floats, place: Floats) -> Floats:
    """A pose."""
    return pose(rotation, *(float(x) for x in place))


HIGH = np.array([0.5, 2.2, -0.3])
LIGHTS: dict[str, edgegrad.PointLight | edgegrad.SpotLight | edgegrad.SunLight | edgegrad.AreaLight] = {
    "point": edgegrad.PointLight(HIGH, 90.0),
    "sphere": edgegrad.PointLight(HIGH, 90.0, 0.3, True),
    "disk": edgegrad.PointLight(HIGH, 90.0, 0.3, False),
    "spot": edgegrad.SpotLight(HIGH, np.array([-0.25, -1.0, 0.1]), 90.0, 1.3, 0.5),
    "sized spot": edgegrad.SpotLight(HIGH, np.array([-0.25, -1.0, 0.1]), 90.0, 1.3, 0.5, 0.2),
    "rectangle": edgegrad.AreaLight(at(TILTED, HIGH), np.array([0.9, 0.5]), "RECTANGLE", 40.0),
    "spread": edgegrad.AreaLight(at(TILTED, HIGH), np.array([0.9, 0.5]), "RECTANGLE", 40.0, 1.6),
    "ellipse": edgegrad.AreaLight(at(TILTED, HIGH), np.array([0.9, 0.5]), "ELLIPSE", 40.0),
    "hard sun": edgegrad.SunLight(np.array([-0.3, -1.0, 0.2]), 3.0),
    "sun": edgegrad.SunLight(np.array([-0.3, -1.0, 0.2]), 3.0, 0.3),
}


def scene_under(light: str) -> edgegrad.Scene:
    """A box over a floor, lit by a light, an emissive mesh ("mesh"), or the sky ("sky", "sky image")."""
    scene = edgegrad.Scene(
        deepcopy(ABOVE),
        {
            "floor": rectangle((0, 0, 0), (0, 0, 3), (3, 0, 0), "floor"),
            "box": box((0.1, 0.7, 0.0), (0.35, 0.2, 0.3), "clay", 0.5),
        },
        {"floor": matte(), "clay": matte(0.7, 0.3, 0.2)},
    )
    if light == "mesh":
        vertices, faces = shapes.ball(1, 0.35)
        scene.meshes["lamp"] = edgegrad.Mesh(vertices + HIGH, faces, ("lamp",))
        scene.materials["lamp"] = glowing(15.0)
    elif light.startswith("sky"):
        scene.world = edgegrad.World(np.array([0.5, 0.6, 0.8]), 1.0)
        if light == "sky image":
            pixels = np.full((8, 16, 3), 0.2, np.float32)
            pixels[1, 3:5] = [9.0, 8.0, 6.0]
            pixels[2, 10] = [1.0, 3.0, 9.0]
            scene.images["sky"] = edgegrad.Image(pixels)
            scene.world = edgegrad.World(np.ones(3), 1.0, "sky", turn(0.1, 0.4, -0.3) @ turn(0.5 * np.pi, 0, 0))
    else:
        scene.lights["lamp"] = deepcopy(LIGHTS[light])
    return scene


def mesh_moves(make: Callable[[], edgegrad.Scene], name: str, rate: Floats) -> Make:
    """A mesh moves and stretches."""

    def moved(theta: float) -> edgegrad.Scene:
        scene = make()
        mesh = scene.meshes[name]
        center = mesh.vertices.mean(axis=0)
        mesh.vertices = mesh.vertices + theta * (np.asarray(rate) + 0.2 * (mesh.vertices - center)[:, [1, 2, 0]])
        return scene

    return moved


def box_moves(light: str) -> Make:
    return mesh_moves(lambda: scene_under(light), "box", np.array([1.0, 0.3, 0.2]))


def floor_moves(light: str) -> Make:
    return mesh_moves(lambda: scene_under(light), "floor", np.array([0.3, 0.8, -0.2]))


def light_changes(light: str, **rates: float | Floats) -> tuple[Make, list[str]]:
    """Numbers of the light grow; `turns` is the rotation vector of its pose, `moves` its translation."""

    def make(theta: float) -> edgegrad.Scene:
        scene = scene_under(light)
        lamp = scene.lights["lamp"]
        change = {}
        for field, rate in rates.items():
            if field in ("turns", "moves"):
                continue
            change[field] = getattr(lamp, field) + theta * np.asarray(rate)
        if "turns" in rates or "moves" in rates:
            to_world = np.array(lamp.to_world)
            to_world[:3, :3] = turn(*(theta * np.asarray(rates.get("turns", np.zeros(3))))) @ to_world[:3, :3]
            to_world[:3, 3] += theta * np.asarray(rates.get("moves", np.zeros(3)))
            change["to_world"] = to_world
        scene.lights["lamp"] = replace(lamp, **{k: (float(v) if np.ndim(v) == 0 else v) for k, v in change.items()})
        return scene

    fields = [f for f in rates if f not in ("turns", "moves")]
    if set(rates) & {"turns", "moves"}:
        fields.append("to_world")
    return make, [f"lights.lamp.{field}" for field in fields]


def lamp_moves() -> Make:
    return mesh_moves(lambda: scene_under("mesh"), "lamp", np.array([1.0, -0.4, 0.3]))


def sky_turns() -> Make:
    def make(theta: float) -> edgegrad.Scene:
        scene = scene_under("sky image")
        scene.world = replace(scene.world, rotation=scene.world.rotation @ turn(0.3 * theta, 0.5 * theta, -0.4 * theta))
        return scene

    return make


def camera_moves(light: str, view: edgegrad.Camera = ABOVE) -> Make:
    def make(theta: float) -> edgegrad.Scene:
        scene = scene_under(light)
        to_world = np.array(view.to_world)
        to_world[:3, :3] = turn(0.2 * theta, 0.3 * theta, 0.1 * theta) @ to_world[:3, :3]
        to_world[:3, 3] += theta * np.array([0.5, -0.3, 0.4])
        scene.camera = replace(view, to_world=to_world)
        return scene

    return make


def seen_by(view: edgegrad.Camera, light: str) -> Make:
    def make(theta: float) -> edgegrad.Scene:
        scene = box_moves(light)(theta)
        scene.camera = deepcopy(view)
        return scene

    return make


BOX, FLOOR, POSE = ["meshes.box.vertices"], ["meshes.floor.vertices"], ["camera.to_world"]
CASES: dict[str, tuple[Make, list[str]]] = {
    **{f"{light}: box moves": (box_moves(light), BOX) for light in (*LIGHTS, "mesh", "sky", "sky image")},
    **{f"{light}: floor moves": (floor_moves(light), FLOOR) for light in (*LIGHTS, "mesh", "sky", "sky image")},
    **{f"{light}: camera moves": (camera_moves(light), POSE)
       for light in ("spot", "sphere", "disk", "rectangle", "sun", "sky")},
    **{f"{light}: light moves": light_changes(light, position=np.array([1.0, -0.4, 0.3]))
       for light in ("point", "sphere", "disk", "spot", "sized spot")},
    "sphere: light grows": light_changes("sphere", radius=0.6),
    "disk: light grows": light_changes("disk", radius=0.6),
    "sized spot: light turns": light_changes("sized spot", direction=np.array([0.5, 0.0, 0.6])),
    "rectangle: light moves and turns": light_changes("rectangle", moves=np.array([0.6, -0.4, 0.3]),
                                                      turns=np.array([0.4, 0.3, -0.2])),
    "ellipse: light moves and turns": light_changes("ellipse", moves=np.array([0.6, -0.4, 0.3]),
                                                    turns=np.array([0.4, 0.3, -0.2])),
    "rectangle: light grows": light_changes("rectangle", size=np.array([0.7, -0.3])),
    "spread: light moves and turns": light_changes("spread", moves=np.array([0.6, -0.4, 0.3]),
                                                   turns=np.array([0.4, 0.3, -0.2])),
    "hard sun: light turns": light_changes("hard sun", direction=np.array([0.7, 0.1, 0.5])),
    "sun: light turns": light_changes("sun", direction=np.array([0.7, 0.1, 0.5])),
    "sun: light grows": light_changes("sun", angle=1.0),
    "mesh: light moves": (lamp_moves(), ["meshes.lamp.vertices"]),
    "sky image: light turns": (sky_turns(), ["world.rotation"]),
    "lens: box moves": (seen_by(replace(ABOVE, aperture_radius=0.1, focus_distance=2.5), "sphere"), BOX),
    "orthographic: box moves": (seen_by(replace(ABOVE, kind="ORTHOGRAPHIC", ortho_width=2.4), "sphere"), BOX),
    "orthographic: camera moves": (camera_moves("sphere", replace(ABOVE, kind="ORTHOGRAPHIC", ortho_width=2.4)), POSE),
    "panorama: box moves": (
        seen_by(replace(camera((0.4, 1.2, 1.3), (0, 0.3, 0)), kind="EQUIRECTANGULAR", width=48), "sphere"), BOX),
    "wide filter and crop: box moves": (
        seen_by(replace(ABOVE, width=32, height=32, crop=(4, 3, 28, 27), filter="BLACKMAN_HARRIS", filter_width=3.0,
                        pixel_aspect=1.3), "sphere"), BOX),
}
