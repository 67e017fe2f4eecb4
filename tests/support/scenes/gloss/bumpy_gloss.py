"""A bumpy glossy ball beside a lamp: its gloss ends where lamps are behind the smooth surface."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from edgegrad import Image, Material, Mesh, PointLight, Scene, SunLight
from edgegrad import expression as e
from tests.support.shapes import ball
from tests.support.small_scenes import Make, camera

LAMP, SUN = PointLight(np.array([3.0, -1.0, 0.5]), 300.0, 0.9), SunLight(np.array([-1.0, 0.2, -0.1]), 3.0, 0.4)
GLOSS = Material(np.array([0.8, 0.7, 0.6]), kind="GLOSSY", roughness=0.9)
LAYERS = Material(np.array([0.2, 0.3, 0.4]), metallic=0.7, roughness=0.7, coat_weight=1.0, coat_roughness=0.6)


def bumpy(material: Material, **lights: PointLight | SunLight) -> Scene:
    """A smooth ball whose normals an image bends strongly."""
    vertices, faces = ball(3)
    pixels = np.ones((8, 8, 3), np.float32)
    pixels[..., :2] = np.clip(np.random.default_rng(1).normal(0.5, 0.35, (8, 8, 2)), 0.0, 1.0)
    bent = replace(material, textures={"normal": e.ImageTexture("map", e.Attribute("UV"))}, normal_uv="UV")
    uv = vertices[faces][..., :2].astype(np.float32)
    made = Mesh(vertices, faces, ("ball",), smoothing=faces, attributes={"UV": uv})
    scene = Scene(camera((0.0, -3.5, 1.0), (0.0, 0.0, 0.0), 32, 0.7), {"ball": made}, {"ball": bent})
    scene.images, scene.lights = {"map": Image(pixels)}, lights
    return scene


def camera_turns(make: Callable[[], Scene]) -> Make:
    """The camera goes about the ball, so that the ends of lit gloss move in the picture."""
    def at(theta: float) -> Scene:
        scene, turn = make(), np.eye(4)
        turn[:2, :2] = [[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]]
        scene.camera.to_world = turn @ scene.camera.to_world
        return scene
    return at


CASES = {
    "gloss beside a lamp": (camera_turns(lambda: bumpy(GLOSS, lamp=LAMP)), ["camera.to_world"]),
    "gloss in the sun": (camera_turns(lambda: bumpy(GLOSS, sun=SUN)), ["camera.to_world"]),
    "layers beside a lamp": (camera_turns(lambda: bumpy(LAYERS, lamp=LAMP)), ["camera.to_world"]),
}
