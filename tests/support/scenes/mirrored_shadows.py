"""Shadows, and surfaces that light each other, seen in perfect mirrors and through smooth glass.

The mirrors and glasses are visible to the camera alone: they hide no light from what they show, and reflect none to it.
The lights themselves are not visible in them.
"""

from __future__ import annotations

from copy import deepcopy
from dataclasses import replace

import numpy as np

import edgegrad
from tests.support import shapes
from tests.support.motions import camera_moves
from tests.support.scenes.box_under_lights import ABOVE, LIGHTS, at, light_changes, mesh_moves, scene_under, sky_turns
from tests.support.small_scenes import Make, box, camera, glowing, rectangle

MIRROR = edgegrad.Material(np.array([0.9, 0.8, 0.7]), kind="GLOSSY", roughness=0.0, multiscatter=False)
GLASS = edgegrad.Material(np.ones(3), kind="GLASS", roughness=0.0, ior=1.4, multiscatter=False)
# Camera's rays, and those that mirrors and glass send on.
DIRECT = frozenset({"camera", "glossy", "transmission"})


def in_mirror(scene: edgegrad.Scene, theta: float = 0.0) -> edgegrad.Scene:
    """A mirror beside the scene, which moves and turns, and a camera that sees the scene there."""
    mirror = rectangle((0, 1.2, -1.5), (1.6, 0, 0), (0, 1.3, 0), "mirror")
    mirror.vertices = mirror.vertices + theta * np.array([[0, 0, 0.5], [0, 0, -0.2], [0, 0, 0.1], [0, 0, 0.8]])
    scene.meshes["mirror"] = replace(mirror, visible_to=frozenset({"camera"}))
    scene.materials["mirror"] = deepcopy(MIRROR)
    scene.camera = camera((0.4, 2.6, 2.2), (0.1, 0.9, -1.5), 40, 0.45)
    return scene


def behind_glass(scene: edgegrad.Scene, shape: str, theta: float = 0.0, ior: float = 0.0) -> edgegrad.Scene:
    """A slab or a ball of glass before the camera."""
    if shape == "slab":
        glass = box((0.05, 2.0, 1.5), (0.6, 0.15, 0.6), "glass", 0.2)
    else:
        vertices, faces = shapes.ball(3, 0.42)
        glass = edgegrad.Mesh(vertices + [0.0, 1.75, 1.25], faces, ("glass",), smoothing=faces.copy())
    glass.vertices = glass.vertices + theta * np.array([0.5, -0.3, 0.4])
    scene.camera = replace(ABOVE, width=40, height=40)
    scene.lights = {name: replace(lamp, visible_to=frozenset({"diffuse"})) for name, lamp in scene.lights.items()}
    scene.meshes["glass"] = replace(glass, visible_to=DIRECT)
    scene.materials["glass"] = replace(GLASS, ior=GLASS.ior + ior)
    return scene


def mirrored(make: Make) -> Make:
    return lambda theta: in_mirror(make(theta))


def box_moves(light: str) -> Make:
    return mirrored(mesh_moves(lambda: scene_under(light), "box", np.array([1.0, 0.3, 0.2])))


def floor_moves(light: str) -> Make:
    return mirrored(mesh_moves(lambda: scene_under(light), "floor", np.array([0.3, 0.8, -0.2])))


def light_moves(light: str, **rates: object) -> tuple[Make, list[str]]:
    make, paths = light_changes(light, **rates)
    return mirrored(make), paths


def view_moves(light: str) -> Make:
    return camera_moves(lambda: in_mirror(scene_under(light)))


def through(shape: str, light: str, moving: str) -> Make:
    def make(theta: float) -> edgegrad.Scene:
        scene = scene_under(light)
        if moving == "box":
            scene.meshes["box"].vertices = scene.meshes["box"].vertices + theta * np.array([1.0, 0.3, 0.2])
        return behind_glass(scene, shape, theta if moving == "glass" else 0.0, theta if moving == "ior" else 0.0)

    return make


def veiled(theta: float) -> edgegrad.Scene:
    """Two half-transparent boxes, one behind the other."""
    scene = in_mirror(box_moves("point")(theta))
    scene.meshes["other"] = box((0.3, 1.3, 0.0), (0.3, 0.1, 0.25), "veil", -0.3)
    scene.materials["clay"] = edgegrad.Material(np.array([0.7, 0.3, 0.2]), alpha=0.6)
    scene.materials["veil"] = edgegrad.Material(np.array([0.3, 0.7, 0.2]), alpha=0.5)
    return scene


def bounced(moving: str) -> Make:
    """A lit wall that lights the scene in the mirror past a box; half of its light passes a veil."""

    def make(theta: float) -> edgegrad.Scene:
        scene = in_mirror(scene_under("point"), theta if moving == "mirror" else 0.0)
        scene.meshes["wall"] = rectangle((1.5, 1.0, 0.2), (0, 0.9, 0), (0, 0, 0.9), "floor")
        scene.lights = {"lamp": edgegrad.PointLight(np.array([0.9, 1.9, 0.1]), 90.0, receivers=("wall",),
                                                    casts_shadow=False)}
        if moving == "veil":
            scene.materials["clay"] = edgegrad.Material(np.array([0.7, 0.3, 0.2]), alpha=0.6)
        for name in {"veil": ["box"]}.get(moving, [moving]):
            if name in ("box", "wall", "floor"):
                mesh = scene.meshes[name]
                mesh.vertices = mesh.vertices + theta * np.array([0.8, 0.4, 0.3])
        return scene

    return make


def behind(light: str, moving: str = "box") -> Make:
    """A box whose shadow falls on a wall, which lights what the mirror shows."""

    def make(theta: float) -> edgegrad.Scene:
        scene = in_mirror(scene_under("sky" if light == "sky" else "point"), theta if moving == "mirror" else 0.0)
        scene.meshes["wall"] = rectangle((1.1, 0.8, 0.1), (0, 0.8, 0), (0, 0, 0.9), "floor")
        place = np.array([-1.3, 0.9, 0.1])
        along_x = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])  # turns what shines along -Z
        if light == "rectangle":
            scene.lights = {"lamp": edgegrad.AreaLight(at(along_x, place), np.array([0.3, 0.3]), power=100.0,
                                                       receivers=("wall",))}
        elif light == "point":
            scene.lights = {"lamp": edgegrad.PointLight(place, 90.0, receivers=("wall",))}
        elif light == "mesh":
            scene.lights = {}
            scene.meshes["lamp"] = rectangle((-1.3, 0.9, 0.1), (0, 0.15, 0), (0, 0, 0.15), "lamp")
            scene.materials["lamp"] = glowing(400.0)
        if moving in scene.meshes and moving != "mirror":
            mesh = scene.meshes[moving]
            mesh.vertices = mesh.vertices + theta * np.array([0.8, 0.4, 0.3])
        return scene

    return make


BOX, FLOOR, SPIN = ["meshes.box.vertices"], ["meshes.floor.vertices"], np.array([0.4, 0.3, -0.2])
CASES: dict[str, tuple[Make, list[str]]] = {
    **{f"{light}: box moves": (box_moves(light), BOX) for light in (*LIGHTS, "mesh", "sky", "sky image")},
    **{f"{light}: floor moves": (floor_moves(light), FLOOR) for light in ("point", "disk", "rectangle", "sun", "mesh")},
    **{f"{light}: mirror moves": (lambda theta, light=light: in_mirror(scene_under(light), theta),
                                  ["meshes.mirror.vertices"]) for light in ("point", "disk", "sky")},
    **{f"{light}: camera moves": (view_moves(light), ["camera.to_world"]) for light in ("spot", "rectangle")},
    "point: light moves": light_moves("point", position=np.array([1.0, -0.4, 0.3])),
    "disk: light moves": light_moves("disk", position=np.array([1.0, -0.4, 0.3])),
    "rectangle: light moves and turns": light_moves("rectangle", moves=np.array([0.6, -0.4, 0.3]), turns=SPIN),
    "sun: light turns": light_moves("sun", direction=np.array([0.7, 0.1, 0.5])),
    "sky image: light turns": (mirrored(sky_turns()), ["world.rotation"]),
    "mesh: light moves": (mirrored(mesh_moves(lambda: scene_under("mesh"), "lamp", np.array([1.0, -0.4, 0.3]))),
                          ["meshes.lamp.vertices"]),
    "slab: box moves under a rectangle": (through("slab", "rectangle", "box"), BOX),
    "slab: slab moves under a point": (through("slab", "point", "glass"), ["meshes.glass.vertices"]),
    "slab: index under a point": (through("slab", "point", "ior"), ["materials.glass.ior"]),
    "ball: box moves under a point": (through("ball", "point", "box"), BOX),
    "ball: ball moves under a rectangle": (through("ball", "rectangle", "glass"), ["meshes.glass.vertices"]),
    "ball: index under a sun": (through("ball", "sun", "ior"), ["materials.glass.ior"]),
    "veils: box moves under a point": (veiled, BOX),
    "bounced: box moves": (bounced("box"), BOX),
    "bounced: wall moves": (bounced("wall"), ["meshes.wall.vertices"]),
    "bounced: floor moves": (bounced("floor"), FLOOR),
    "bounced: mirror moves": (bounced("mirror"), ["meshes.mirror.vertices"]),
    "bounced: veil moves": (bounced("veil"), BOX),
    **{f"behind: box moves under a {light}": (behind(light), BOX) for light in ("rectangle", "sky", "mesh")},
    "behind: mirror moves": (behind("rectangle", "mirror"), ["meshes.mirror.vertices"]),
}


def depth_of(name: str) -> int:
    """Segments of the longest path: to the glass, through it, to the lit point and to its light."""
    return 4 if name.startswith(("slab", "ball", "bounced", "behind")) else 3


def options_of(name: str) -> dict[str, int]:
    """Few samples of many pixels, since several features within a quarter of a pixel may be missed."""
    few = {"spp": 128, "seeds": 16} if name.startswith(("bounced", "behind")) else {"spp": 64, "seeds": 8}
    return {**few, "reference_spp": 256, "max_depth": depth_of(name)}
