"""Shadows of the environment, and those that the camera sees in sharp lobes, by samples that start at the camera."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import edgegrad
from edgegrad import AreaLight, Image, Material, Mesh, Mixture, PointLight, Scene, SunLight, World
from edgegrad.rendering.options import RenderOptions
from edgegrad.rendering.renderer import Renderer
from tests.support import shapes
from tests.support.block_statistics import ALARM, NOTICED, check, check_in_stages, compare
from tests.support.engine_options import set_options
from tests.support.picture_differences import agreement, check_transpose
from tests.support.rich_scene import pose, turn
from tests.support.small_scenes import along, moved, need

# An alpha up to which reflecting lobes, too, are sampled from the camera.
ALL_GLOSSY = 4.0
SHIFT = (0.6, 0.3, 0.8)


def over_gloss(floor: Material, *, pane: Material | None = None) -> Scene:
    """A ball before a wall, under an area light; the camera looks at a floor of gloss, or through a rough pane."""
    aim = turn(1.2, 0.0, 0.0)
    ball, ball_faces = shapes.ball(1, 0.5)
    wall, wall_faces = shapes.sheet(2, 6.0)
    ground, ground_faces = shapes.sheet(2, 6.0)
    meshes = {"floor": Mesh(ground, ground_faces, ("floor",)),
              "wall": Mesh(wall @ turn(np.pi / 2, 0.0, 0.0).T + [0.0, 2.0, 2.9], wall_faces, ("wall",)),
              "ball": Mesh(ball + [0.0, 0.6, 1.3], ball_faces, ("wall",))}  # fmt: skip
    materials: dict[str, Material | Mixture] = {"floor": floor, "wall": Material(np.array([0.6, 0.7, 0.5]))}
    if pane is not None:
        slab, slab_faces = shapes.cube(1.0)
        meshes["pane"] = Mesh((slab * [3.0, 3.0, 0.1]) @ aim.T + aim @ [0.0, 0.0, 3.5], slab_faces, ("pane",))
        materials["pane"] = pane
    lamp = AreaLight(to_world=pose(turn(0.9, 0.0, 0.0), 0.4, -2.5, 3.5), size=np.array([0.9, 0.7]), power=150.0)
    return Scene(edgegrad.Camera(pose(aim, *(aim @ [0.0, 0.0, 6.0] + [0.0, 0.0, 0.4])), 0.5, 16, 16), meshes, materials,
                 {"lamp": lamp}, World(np.zeros(3)))  # fmt: skip


def metal(roughness: float) -> Material:
    return Material(np.array([0.9, 0.8, 0.7]), metallic=1.0, roughness=roughness)


def under_a_sky(scene: Scene, *, image: bool) -> Scene:
    scene.lights = {}
    scene.world = World(np.array([0.6, 0.7, 0.8]))
    if image:
        sky = np.random.default_rng(3).uniform(0.1, 2.0, (4, 8, 3)).astype(np.float32)
        scene.images = {"sky": Image(sky)}
        scene.world = replace(scene.world, image="sky")
    return scene


def with_lights(scene: Scene, **lights: Any) -> Scene:
    scene.lights = lights
    return scene


def hidden_from_gloss(scene: Scene) -> Scene:
    """A second lamp that only glossy rays see, beside one that they do not see."""
    lamp = scene.lights["lamp"]
    assert isinstance(lamp, AreaLight)
    seen = frozenset(lamp.visible_to)
    other = replace(lamp, to_world=pose(turn(0.9, 0.0, 0.3), -1.2, -2.0, 3.8), visible_to=seen - {"diffuse"})
    return with_lights(scene, lamp=replace(lamp, visible_to=seen - {"glossy"}), other=other)


def under_a_sheet(scene: Scene, size: float = 0.8) -> Scene:
    """A sheet that gives light instead of the lamp."""
    lamp = scene.lights["lamp"]
    assert isinstance(lamp, AreaLight)
    sheet, faces = shapes.sheet(2, size)
    scene.meshes["sheet"] = Mesh(sheet @ np.diag([1.0, -1.0, -1.0]) @ lamp.to_world[:3, :3].T + lamp.to_world[:3, 3],
                                 faces, ("glow",))  # fmt: skip
    scene.materials["glow"] = Material(np.zeros(3), np.full(3, 12.0 / size**2))
    return with_lights(scene)


def before_a_glowing_wall(scene: Scene) -> Scene:
    scene.materials["bright"] = Material(np.zeros(3), np.array([1.0, 0.9, 0.7]))
    scene.meshes["wall"].materials = ("bright",)
    return with_lights(scene)


def veiled(scene: Scene) -> Scene:
    scene.materials["veil"] = Material(np.array([0.3, 0.5, 0.8]), alpha=0.4)
    scene.meshes["ball"].materials = ("veil",)
    return scene


def repeated(scene: Scene) -> Scene:
    ball = scene.meshes["ball"]
    ball.instances = np.stack([np.eye(4), pose(np.eye(3), -0.9, 0.1, -0.3)])
    return scene


# Lobes that are wide enough for samples from edges to have a known error; behind rough glass they never are.
CASES: dict[str, tuple[Callable[[], Scene], int]] = {
    "lamp, in metal": (lambda: over_gloss(metal(0.6)), 3),
    "plain sky": (lambda: under_a_sky(over_gloss(metal(0.6)), image=False), 3),
    "image of a sky": (lambda: under_a_sky(over_gloss(metal(0.6)), image=True), 3),
    "lamp and sky": (lambda: replace(over_gloss(metal(0.6)), world=World(np.full(3, 0.4))), 3),
    "two lamps, hidden from some rays": (lambda: hidden_from_gloss(over_gloss(metal(0.6))), 3),
    "sun with a disk, ball of light, point": (lambda: with_lights(
        over_gloss(metal(0.6)), sun=SunLight(np.array([0.1, 0.6, -1.0]), 2.0, 0.3),
        bulb=PointLight(np.array([-1.0, -1.5, 2.5]), 60.0, 0.3, True),
        point=PointLight(np.array([1.0, -2.0, 3.0]), 40.0),
    ), 3),
    "glowing sheet": (lambda: under_a_sheet(over_gloss(metal(0.6))), 2),
    "glowing sheet, in metal": (lambda: under_a_sheet(over_gloss(metal(0.6))), 3),
    "glowing wall and sky": (lambda: before_a_glowing_wall(under_a_sky(over_gloss(metal(0.6)), image=True)), 2),
    "veil": (lambda: veiled(over_gloss(metal(0.6))), 3),
    "instances": (lambda: repeated(over_gloss(metal(0.6))), 3),
    "gloss and coat over a diffuse colour": (lambda: over_gloss(Material(
        np.array([0.5, 0.4, 0.3]), roughness=0.6, specular_ior_level=0.8, coat_weight=0.7, coat_roughness=0.5)), 3),
}  # fmt: skip


def _shadows(scene: Scene, alpha: float, spp: int, seeds: int, depth: int) -> np.ndarray:
    renderer = Renderer(scene)
    set_options(renderer, camera_sampled_alpha=alpha)
    tangent = {"meshes.ball.vertices": np.broadcast_to(SHIFT, scene.meshes["ball"].vertices.shape)}
    return np.stack([renderer.render_forward(tangent, spp=spp, max_depth=depth, terms=("shadow",), seed=k)
                     for k in range(seeds)])  # fmt: skip


def _check_equal_means(make: Callable[[], Scene], alpha: float, depth: int) -> None:
    """Lobes up to `alpha` sampled from the camera: the mean is as with all lobes sampled from edges."""
    edges = _shadows(make(), 0.0, 1024, 32, depth)
    outcome = compare(_shadows(make(), alpha, 512, 32, depth), edges.mean(axis=0),
                      edges.std(axis=0, ddof=1) / np.sqrt(len(edges)))  # fmt: skip
    print(outcome)
    check(outcome)
    assert outcome.noticed(ALARM) < NOTICED


@pytest.mark.parametrize("name", CASES)
def test_samples_from_edges_and_from_the_camera_agree(name: str) -> None:
    need("native")
    make, depth = CASES[name]
    _check_equal_means(make, ALL_GLOSSY, depth)


def test_each_lobe_belongs_to_one_kind_of_samples() -> None:
    """The floor's lobes are too wide for samples from the camera, which the scene has for a polished wall."""
    need("native")

    def make() -> Scene:
        scene = over_gloss(metal(0.45))
        scene.materials["wall"] = metal(0.15)
        return scene

    _check_equal_means(make, RenderOptions(1).camera_sampled_alpha, 2)


@pytest.mark.parametrize("what", ["metal", "pane"])
def test_shadows_in_sharp_lobes_agree_with_differences(what: str) -> None:
    """Narrow lobes, which samples from edges reach rarely."""
    need("native")

    def make(theta: float) -> Scene:
        pane = Material(np.full(3, 0.95), kind="GLASS", roughness=0.4, ior=1.3)
        scene = over_gloss(metal(0.25)) if what == "metal" else over_gloss(metal(0.9), pane=pane)
        return moved(scene, theta, "ball", SHIFT)

    check_in_stages(lambda first_seed: agreement(
        along(make, ["meshes.ball.vertices"]), eps=0.02, seeds=16, spp=256, reference_spp=1024, reference_seeds=32,
        thetas=16, first_seed=first_seed, max_depth=3 if what == "metal" else 4))  # fmt: skip


@pytest.mark.parametrize("roughness", [0.4, 0.7, 0.9])
def test_edges_behind_rough_glass_agree_with_differences(roughness: float) -> None:
    """Samples from edges would pass two rough lobes of the pane; those from the camera have little noise."""
    need("native")

    def make(theta: float) -> Scene:
        scene = over_gloss(metal(0.9), pane=Material(np.full(3, 0.95), kind="GLASS", roughness=roughness, ior=1.3))
        return moved(before_a_glowing_wall(scene), theta, "ball", SHIFT)

    found = agreement(along(make, ["meshes.ball.vertices"]), eps=0.02, seeds=16, spp=256, reference_spp=1024,
                      reference_seeds=32, thetas=8, max_depth=4)  # fmt: skip
    print(found, found.noticed(ALARM))
    check(found)
    assert found.noticed(ALARM) < NOTICED


@pytest.mark.parametrize("roughness", [None, 0.6])
@pytest.mark.parametrize("image", [False, True])
def test_a_small_view_has_all_shadows_of_the_sky(image: bool, roughness: float | None) -> None:
    """The camera sees a small part of a wall of which a ball hides the sky. Samples from edges meet it rarely."""
    need("native")

    def make(theta: float) -> Scene:
        scene = under_a_sky(over_gloss(metal(0.9)), image=image)
        if roughness is not None:
            scene.materials["wall"] = metal(roughness)
        # A window of 0.2 m in a wall of 6 m
        scene.camera = edgegrad.Camera(pose(turn(np.pi / 2, 0.0, 0.0), 0.9, -2.0, 1.0), 0.05, 16, 16)
        return moved(scene, theta, "ball", SHIFT)

    found = agreement(along(make, ["meshes.ball.vertices"]), eps=0.04, seeds=16, spp=32, reference_spp=512,
                      reference_seeds=32, thetas=16, max_depth=2)  # fmt: skip
    print(found)
    check(found)
    assert found.noticed(ALARM) < NOTICED


def test_they_have_less_noise_behind_rough_glass() -> None:
    """The standard deviation of blocks, which is known to a fifth from 16 seeds."""
    need("native")
    scene = over_gloss(metal(0.9), pane=Material(np.full(3, 0.95), kind="GLASS", roughness=0.5, ior=1.3))

    def noise(alpha: float) -> float:
        blocks = _shadows(scene, alpha, 64, 16, 4).reshape(16, 2, 8, 2, 8, 3).sum((2, 4), dtype=np.float64)
        return float(np.sqrt(blocks.var(axis=0, ddof=1).mean()))

    assert noise(0.25) < 0.6 * noise(0.0)


@pytest.mark.parametrize("name", ["lamp, in metal", "image of a sky", "veil", "instances"])
def test_modes_are_transposes(name: str) -> None:
    need("native")
    make, depth = CASES[name]
    check_transpose(lambda theta: moved(make(), theta, "ball", SHIFT), ["meshes.ball.vertices"], spp=64, seed=3,
                    max_depth=depth, terms=("shadow",))  # fmt: skip
