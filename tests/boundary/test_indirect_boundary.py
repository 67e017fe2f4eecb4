"""The indirect boundary term: edges between two surfaces that light each other, against central differences.

The scenes' lamps are hidden from what moves, or nothing can come between them and what they light: their derivatives
are those of shading, of edges that the camera sees, and of edges between surfaces.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

import edgegrad
from edgegrad.rendering.options import TERMS
from edgegrad.rendering.renderer import Renderer
from edgegrad.scene.bounces import UNLIMITED, Bounces
from tests.rendering.test_moving_scenes import cornell
from tests.support.block_statistics import ALARM, Agreement, compare
from tests.support.engine_options import set_options
from tests.support.picture_differences import agreement, check_transpose
from tests.support.slow_cases import slow_but
from tests.support.small_scenes import Make, along, box, camera, glowing, matte, need, rectangle, white_world

SIZE = 16


def bounced_light(view: edgegrad.Camera | None = None) -> edgegrad.Scene:
    """A box between a floor and a ceiling; the lamp is near the ceiling and shines on nothing else."""
    return edgegrad.Scene(
        view or camera((0.3, 0.9, 2.6), (0, 0.35, 0), SIZE, 0.9),
        {
            "floor": rectangle((0, 0, 0), (0, 0, 1.2), (1.2, 0, 0), "floor"),
            "ceiling": rectangle((0, 1.6, 0), (1.2, 0, 0), (0, 0, 1.2), "ceiling"),
            "lamp": rectangle((0, 1.3, 0), (0, 0, 0.4), (0.4, 0, 0), "lamp"),
            "box": box((0.1, 0.4, 0.1), (0.3, 0.12, 0.25), "clay", 0.4),
        },
        {
            "floor": matte(0.8, 0.7, 0.6),
            "ceiling": matte(0.9, 0.9, 0.8),
            "lamp": glowing(8.0),
            "clay": matte(0.3, 0.5, 0.7),
        },
    )


def mirrored_edge(roughness: float) -> edgegrad.Scene:
    """A black box over a floor of rough metal that reflects a wall; the lamp lights the wall alone, from nearby."""
    metal = edgegrad.Material(np.array([0.9, 0.8, 0.6]), kind="GLOSSY", roughness=float(np.sqrt(roughness)))
    return edgegrad.Scene(
        camera((0, 1.0, 2.2), (0, 0.1, 0), SIZE, 0.7),
        {
            "floor": rectangle((0, 0, 0.2), (0, 0, 0.8), (0.9, 0, 0), "metal"),
            "wall": rectangle((0, 0.7, -1.2), (1.5, 0, 0), (0, 1.0, 0), "wall"),
            "lamp": rectangle((0, 1.9, -0.9), (0, 0.1, 0), (0.6, 0, 0), "lamp"),
            "box": box((0.1, 0.45, -0.2), (0.25, 0.12, 0.1), "black", 0.3),
        },
        {"metal": metal, "wall": matte(0.8, 0.6, 0.5), "lamp": glowing(30.0), "black": matte(0.0, 0.0, 0.0)},
    )


def behind_rough_glass() -> edgegrad.Scene:
    """The same box before the wall, seen through a sheet that refracts roughly."""
    scene = mirrored_edge(0.3)
    sheet = rectangle((0, 0.6, 0.4), (0.9, 0, 0), (0, 0.8, 0), "glass")
    scene.meshes = {name: scene.meshes[name] for name in ("wall", "lamp", "box")} | {"sheet": sheet}
    scene.materials["glass"] = edgegrad.Material(np.full(3, 0.9), kind="REFRACTION", roughness=0.5, ior=1.2)
    scene.camera = camera((0, 0.8, 2.2), (0, 0.5, 0), SIZE, 0.7)
    return scene


def below() -> edgegrad.Scene:
    """Bounced light on the floor below the box, and little else."""
    return bounced_light(camera((0.2, 0.32, 1.3), (0.1, 0.0, 0.1), SIZE, 0.8))


def mirrored_room() -> edgegrad.Scene:
    """Bounced light as seen in a wall of nearly smooth metal alone: boundaries behind the metal."""
    scene = bounced_light(camera((0.0, 0.9, 2.0), (0, 0.7, -1.0), SIZE, 0.7))
    scene.meshes["mirror"] = rectangle((0, 0.8, -1.3), (1.2, 0, 0), (0, 0.8, 0), "metal")
    scene.materials["metal"] = edgegrad.Material(
        np.array([0.9, 0.8, 0.6]), kind="GLOSSY", roughness=float(np.sqrt(0.05))
    )
    return scene


def veiled() -> edgegrad.Scene:
    """Bounced light past a box that lets a part of it through, and through a sheet that does."""
    scene = bounced_light()
    scene.materials["clay"].alpha = 0.4
    scene.materials["veil"] = edgegrad.Material(np.array([0.5, 0.6, 0.7]), alpha=0.5)
    scene.meshes["veil"] = rectangle((0.0, 0.8, 0.1), (0, 0, 0.7), (0.7, 0, 0), "veil")
    return scene


def windowed() -> edgegrad.Scene:
    """Bounced light past a sheet of which one half lets light through: what parts them is never a silhouette."""
    scene = bounced_light()
    sheet = rectangle((0.1, 0.5, 0.1), (0.0, 0.05, 0.5), (0.5, 0.1, 0.0), "clay")
    sheet.materials = ("clay", "pane")
    sheet.face_material = np.arange(len(sheet.faces), dtype=np.int32) % 2
    scene.materials["pane"] = replace(scene.materials["clay"], alpha=0.1)
    scene.meshes["box"] = sheet
    return scene


def instanced() -> edgegrad.Scene:
    """The box twice, one of them stretched."""
    scene = bounced_light()
    poses = np.stack([np.eye(4), np.eye(4)])
    poses[0, :3, 3] = (-0.3, 0.1, 0.0)
    poses[1, :3, :3] = np.diag([0.5, 1.4, 0.7])
    poses[1, :3, 3] = (0.4, -0.2, 0.2)
    scene.meshes["box"].instances = poses
    return scene


def reflected_shadow(sky: bool = False) -> edgegrad.Scene:
    """A wall that is lit by a floor on which a box casts its shadow: the camera sees the wall alone."""
    scene = edgegrad.Scene(
        camera((0, 0.35, 0.9), (0, 0.5, -1.0), SIZE, 0.4),
        {
            "floor": rectangle((0, 0, 0), (0, 0, 1.0), (1.0, 0, 0), "floor"),
            "wall": rectangle((0, 0.7, -1.0), (1.0, 0, 0), (0, 0.7, 0), "wall"),
            "lamp": rectangle((0.1, 1.6, -0.1), (0.25, 0, 0), (0, 0, 0.25), "lamp"),
            "box": box((0.0, 0.8, -0.1), (0.3, 0.05, 0.3), "black", 0.3),
        },
        {"floor": matte(0.9, 0.7, 0.6), "wall": matte(0.8, 0.8, 0.9), "lamp": glowing(20.0), "black": matte(0, 0, 0)},
    )
    if sky:
        del scene.meshes["lamp"]
        scene.world = white_world()
    return scene


def moving(make: Callable[[], edgegrad.Scene], mesh: str, direction: tuple[float, float, float]) -> Make:
    """A mesh moves."""

    def at(theta: float) -> edgegrad.Scene:
        scene = make()
        scene.meshes[mesh].vertices = scene.meshes[mesh].vertices + theta * np.asarray(direction)
        return scene

    return at


def moving_camera(make: Callable[[], edgegrad.Scene], direction: tuple[float, float, float]) -> Make:
    """The camera moves."""

    def at(theta: float) -> edgegrad.Scene:
        scene = make()
        scene.camera.to_world = scene.camera.to_world.copy()
        scene.camera.to_world[:3, 3] += theta * np.asarray(direction)
        return scene

    return at


@dataclass(frozen=True)
class Case:
    """A scene's motion, the paths that are rendered, and by how much and how often the scene is sampled."""

    make: Make
    path: str = "meshes.box.vertices"
    max_depth: int = 3
    bounces: Bounces = UNLIMITED
    spp: int = 512
    reference_spp: int = 512
    eps: float = 0.02
    seeds: int = 8
    without: str = "indirect"  # the term that is needed
    quick: bool = False


BOX = (1.0, 0.3, 0.5)
CASES: dict[str, Case] = {
    "occluder of bounced light": Case(moving(bounced_light, "box", BOX), quick=True),
    "receiver of bounced light": Case(moving(below, "floor", (0.1, 1.0, 0.0)), "meshes.floor.vertices"),
    "source of bounced light": Case(moving(bounced_light, "ceiling", (0.5, 1.0, 0.3)), "meshes.ceiling.vertices"),
    "camera and bounced light": Case(moving_camera(below, (0.5, 0.4, -1.0)), "camera.to_world"),
    "two bounces": Case(moving(bounced_light, "box", BOX), max_depth=4, quick=True),
    "three bounces": Case(moving(bounced_light, "box", BOX), max_depth=6),
    "one bounce by limit": Case(moving(bounced_light, "box", BOX), max_depth=5, bounces=Bounces(diffuse=1)),
    "shadow seen by way of a wall": Case(
        moving(reflected_shadow, "box", (1.0, 0.3, 0.8)), without="shadow", quick=True
    ),
    "sky's shadow seen by way of a wall": Case(
        moving(lambda: reflected_shadow(sky=True), "box", (1.0, 0.3, 0.8)), without="shadow"
    ),
    "shadow seen by way of a wall that moves": Case(
        moving(reflected_shadow, "wall", (0.0, 0.0, 1.0)), "meshes.wall.vertices", without="shadow"
    ),
    "shadow and bounces": Case(moving(reflected_shadow, "box", (1.0, 0.3, 0.8)), max_depth=5, without="shadow"),
    "shadow and one bounce by limit": Case(
        moving(reflected_shadow, "box", (1.0, 0.3, 0.8)), max_depth=5, bounces=Bounces(diffuse=1), without="shadow"
    ),
    "transparent occluder": Case(moving(veiled, "box", BOX), quick=True),
    "windows": Case(moving(windowed, "box", (1.0, 0.3, -1.0)), quick=True),
    "instances": Case(moving(instanced, "box", BOX)),
    "edge in rougher metal": Case(moving(lambda: mirrored_edge(0.3), "box", (1.0, 0.5, 0.3))),
    "edge in rough metal": Case(moving(lambda: mirrored_edge(0.1), "box", (1.0, 0.5, 0.3)), quick=True),
    "edge in nearly smooth metal": Case(moving(lambda: mirrored_edge(0.03), "box", (1.0, 0.5, 0.3))),
    "metal that moves": Case(moving(lambda: mirrored_edge(0.1), "floor", (0.3, 1.0, 0.2)), "meshes.floor.vertices"),
    "camera and metal": Case(moving_camera(lambda: mirrored_edge(0.2), (0.5, 0.4, -1.0)), "camera.to_world"),
    "bounces in nearly smooth metal": Case(
        moving(mirrored_room, "box", BOX), max_depth=4, spp=1024, reference_spp=2048, eps=0.03
    ),
    "Cornell box": Case(cornell, "meshes.tall.vertices", max_depth=6),
    "edge behind rough glass": Case(moving(behind_rough_glass, "box", (1.0, 0.5, 0.3)), quick=True),
}


def beside_differences(case: Case, terms: tuple[str, ...] = TERMS) -> Agreement:
    """The derivative beside the central difference."""
    return agreement(
        along(case.make, [case.path]), eps=case.eps, seeds=case.seeds, spp=case.spp, reference_spp=case.reference_spp,
        reference_seeds=2 * case.seeds, thetas=case.seeds, terms=terms, max_depth=case.max_depth, bounces=case.bounces,
    )


RUNS = slow_but(CASES, [name for name, case in CASES.items() if case.quick])


@pytest.mark.parametrize("name", RUNS)
def test_it_agrees_with_central_differences_and_is_needed(name: str) -> None:
    need("native")
    case = CASES[name]
    outcome = beside_differences(case)
    without = beside_differences(case, tuple(term for term in TERMS if term != case.without))
    print(outcome, without, sep="\n")
    assert outcome.p_value > ALARM, str(outcome)
    assert without.p_value < ALARM, str(without)


def over_metal() -> edgegrad.Scene:
    """Bounced light on a floor of rough metal."""
    scene = bounced_light()
    scene.materials["floor"] = edgegrad.Material(
        np.array([0.9, 0.8, 0.6]), kind="GLOSSY", roughness=float(np.sqrt(0.3))
    )
    return scene


def glossy_sheet() -> edgegrad.Scene:
    """Bounced light past a veil, on a floor with a diffuse colour, a gloss and a sharper coat; two boxes."""
    scene = veiled()
    scene.materials["floor"] = edgegrad.Material(
        np.array([0.5, 0.4, 0.3]), roughness=0.6, specular_ior_level=0.5, coat_weight=0.8, coat_roughness=0.3
    )
    scene.meshes["box"].instances = instanced().meshes["box"].instances
    return scene


# All that the estimators handle on their own ways, in lobes that either may sample: how alike they are tells more than
# differences do.
BOTH: dict[str, Case] = {
    "edge in rougher metal": CASES["edge in rougher metal"],
    "edge behind rough glass": CASES["edge behind rough glass"],
    "occluder of light on metal": Case(moving(over_metal, "box", BOX)),
    "coated floor, veils and instances": Case(moving(glossy_sheet, "box", BOX), max_depth=4),
    "one bounce by limit": Case(moving(over_metal, "box", BOX), max_depth=5, bounces=Bounces(diffuse=1, glossy=1)),
}
# An alpha up to which all glossy lobes are sampled from the camera, and the weak ones over a diffuse base.
ALL_GLOSSY = 4.0


@pytest.mark.parametrize("name", BOTH)
def test_samples_from_edges_and_from_the_camera_agree(name: str) -> None:
    need("native")
    case = BOTH[name]
    scene, tangent = along(case.make, [case.path])(0.0)
    renderer = Renderer(scene)
    options: dict[str, Any] = {"max_depth": case.max_depth, "bounces": case.bounces, "terms": ("indirect",)}
    found = []
    for alpha, spp in ((0.0, 1024), (ALL_GLOSSY, 256)):
        set_options(renderer, camera_sampled_alpha=alpha)
        found.append(np.stack([renderer.render_forward(tangent, spp=spp, seed=k, **options) for k in range(24)]))
    edges, camera_first = found
    outcome = compare(camera_first, edges.mean(axis=0), edges.std(axis=0, ddof=1) / np.sqrt(len(edges)))
    print(outcome)
    assert outcome.p_value > ALARM and outcome.noise < 0.25, str(outcome)


@pytest.mark.parametrize(
    "name",
    ["two bounces", "edge behind rough glass", "camera and metal", "edge in rough metal",
     "bounces in nearly smooth metal"],
)  # fmt: skip
def test_modes_are_transposes(name: str) -> None:
    need("native")
    case = CASES[name]
    check_transpose(case.make, [case.path], spp=64, seed=3, max_depth=case.max_depth, terms=("indirect",))


def test_a_convex_body_under_an_even_sky_has_none() -> None:
    need("native")
    body = box((0, 0, 0), (0.5, 0.4, 0.3), "clay", 0.3)
    scene = edgegrad.Scene(camera(), {"box": body}, {"clay": matte(0.8, 0.7, 0.6)}, world=white_world())
    tangent = {"meshes.box.vertices": np.random.default_rng(0).normal(size=body.vertices.shape)}
    for term in ("shadow", "indirect"):
        assert not Renderer(scene).render_forward(tangent, spp=64, max_depth=5, terms=(term,)).any()
