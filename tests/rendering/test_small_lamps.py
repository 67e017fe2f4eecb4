"""A sphere light and a ball of emissive triangles with its power give the same pictures and derivatives.

`python -m tests.benchmarks.case_noise rendering.test_small_lamps --spp 16 --depth 2` compares their noise.
"""

from __future__ import annotations

import numpy as np
import pytest

from edgegrad import Camera, Material, Mesh, PointLight, Renderer, Scene, World
from tests.support import shapes
from tests.support.rich_scene import pose, turn
from tests.support.small_scenes import Make, along, matte, moved, need

AT = np.array([0.5, 0.4, 2.2])
POWER = 60.0


def beneath_a_lamp(radius: float, splits: int | None) -> Scene:
    """A ball over a floor, lit by a sphere light, or by a convex ball of 8 * 4^splits faces with its power."""
    floor, floor_faces = shapes.sheet(2, 4.0)
    ball, ball_faces = shapes.ball(1, 0.4)
    aim = turn(1.0, 0.0, 0.0)
    scene = Scene(
        Camera(pose(aim, *(aim @ [0.0, 0.0, 5.0])), 0.7, 24, 24),
        {"floor": Mesh(floor, floor_faces, ("clay",)), "ball": Mesh(ball + [0.0, 0.0, 0.6], ball_faces, ("clay",))},
        {"clay": matte(0.7, 0.6, 0.5)}, {}, World(np.full(3, 0.05)),
    )  # fmt: skip
    if splits is None:
        scene.lights = {"lamp": PointLight(AT, POWER, radius, True)}
        return scene
    lamp, faces = shapes.octahedral_ball(splits)
    lamp = radius * lamp
    a, b, c = (lamp[faces[:, k]] for k in range(3))
    area = 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
    scene.materials["glow"] = Material(np.zeros(3), kind="DIFFUSE", emission=np.full(3, POWER / (np.pi * area)))
    scene.meshes["lamp"] = Mesh(lamp + AT, faces, ("glow",))
    return scene


def _lamp_moves(radius: float, splits: int | None) -> Make:
    def make(theta: float) -> Scene:
        scene = beneath_a_lamp(radius, splits)
        if splits is not None:
            return moved(scene, theta, "lamp", (1.0, 0.0, 0.0))
        light = scene.lights["lamp"]
        assert isinstance(light, PointLight)
        light.position = light.position + theta * np.array([1.0, 0.0, 0.0])
        return scene

    return make


def _ball_moves(radius: float, splits: int | None) -> Make:
    return lambda theta: moved(beneath_a_lamp(radius, splits), theta, "ball", (1.0, 0.0, 0.0))


LAMPS = {"sphere light": None, "32 faces": 1, "128 faces": 2, "512 faces": 3}
CASES: dict[str, tuple[Make, list[str], int]] = {}
for _radius in (0.02, 0.1, 0.3):
    for _name, _splits in LAMPS.items():
        _path = "lights.lamp.position" if _splits is None else "meshes.lamp.vertices"
        CASES[f"{_radius} m, {_name}: lamp moves"] = (_lamp_moves(_radius, _splits), [_path], 2)
        CASES[f"{_radius} m, {_name}: ball moves"] = (_ball_moves(_radius, _splits), ["meshes.ball.vertices"], 2)


@pytest.mark.parametrize("what", ["lamp moves", "ball moves"])
def test_derivatives_are_those_of_a_sphere_light(what: str) -> None:
    """Sums of halves of the picture, within their noise and a hundredth, by which 512 faces are no sphere."""
    need("native")
    found = []
    for name in ("sphere light", "512 faces"):
        make, paths, depth = CASES[f"0.3 m, {name}: {what}"]
        scene, rate = along(make, paths)(0.0)
        renderer = Renderer(scene)
        pictures = [renderer.render_forward(rate, spp=64, max_depth=depth, seed=seed) for seed in range(16)]
        found.append(np.asarray(pictures, np.float64).reshape(16, 2, -1).sum(axis=2))
    gap = np.abs(found[0].mean(axis=0) - found[1].mean(axis=0))
    noise = np.sqrt(sum(sums.var(axis=0, ddof=1) / 16 for sums in found))
    size = np.abs(found[0].mean(axis=0)).max()
    assert (gap <= 4.5 * noise + 0.01 * size).all()
    assert (noise < 0.3 * size).all()
