"""The primary boundary term against central differences, for every camera and every kind of edge.

Surfaces that only emit keep their radiance as they or the camera move: all that changes is where they are seen, so that
the primary term is the whole derivative.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

import edgegrad
from edgegrad.rendering.renderer import Renderer
from tests.support import shapes
from tests.support.block_statistics import check, half_width, mean_p_value
from tests.support.picture_differences import check_agreement, check_equal_bits, check_transpose
from tests.support.scenes.glowing_shapes import (
    CASES,
    MESHES,
    PRIMARY,
    VIEW,
    glowing_scene,
    shapes_move,
    turn,
)
from tests.support.scenes.intersecting_surfaces import INTERSECTING
from tests.support.slow_cases import slow_but
from tests.support.small_scenes import Floats, Make, along, box, camera, need, rectangle


def primary(renderer: Renderer, tangent: Mapping[str, Floats], **options: int) -> Floats:
    """The primary term along a tangent."""
    return renderer.render_forward(tangent, terms=("primary",), **options).astype(np.float64)


# One of each kind of camera in every run, the others in the slow ones.
QUICK = (
    "perspective: camera turns", "crop and wide filter: shapes move", "orthographic: camera moves",
    "panorama all around: camera turns",
)


RUNS = slow_but(CASES, QUICK)


@pytest.mark.parametrize("name", RUNS)
def test_cameras_and_shapes_agree_with_central_differences(name: str) -> None:
    need("native")
    # A blurred edge changes few of the samples: a difference needs wide steps and many samples.
    lens = name.startswith(("lens", "blades"))
    wide = {"eps": 0.1, "reference_spp": 4096} if lens else {}
    check_agreement(along(*CASES[name]), **{**PRIMARY, **wide})


# ---------------------------------------------------------------- surfaces that intersect or touch each other


@pytest.mark.parametrize("name", INTERSECTING)
def test_intersecting_surfaces_agree_with_central_differences(name: str) -> None:
    need("native")
    check_agreement(along(*INTERSECTING[name]), **PRIMARY)


@pytest.mark.parametrize("name", [name for name in INTERSECTING if "many faces" in name])
def test_threads_share_the_search_of_many_faces(name: str) -> None:
    need("native")
    make, paths = INTERSECTING[name]

    def lit(theta: float) -> edgegrad.Scene:
        """All edges between facets count."""
        scene = make(theta)
        scene.materials = {name: edgegrad.Material(np.full(3, 0.5)) for name in scene.materials}
        return scene

    check_equal_bits(lit, paths, spp=4, terms=("primary",))


# ---------------------------------------------------------------- behind what lets light pass
def veiled(theta: float) -> edgegrad.Scene:
    """Shapes behind a half-transparent veil and a coloured pane."""
    scene = shapes_move(VIEW)(theta)
    scene.meshes = {
        **scene.meshes,
        "veil": rectangle((-0.3, 0, 1.2), (0.5, 0, 0.1), (0, 0.6, 0), "veil"),
        "pane": rectangle((0.2, 0, 1.4), (0.5, 0, -0.1), (0, 0.5, 0), "pane"),
    }
    scene.materials = {
        **scene.materials,
        "veil": edgegrad.Material(np.zeros(3), np.full(3, 0.3), alpha=0.4),
        "pane": edgegrad.Material(np.array([0.9, 0.5, 0.2]), kind="TRANSPARENT"),
    }
    return scene


def test_edges_behind_transparent_surfaces_agree_with_central_differences() -> None:
    need("native")
    check_agreement(along(veiled, MESHES), **PRIMARY)


# ---------------------------------------------------------------- instances
def instanced(theta: float) -> edgegrad.Scene:
    """Three copies of a box, one mirrored, before and through a card; all are placed by their transforms."""
    scene = glowing_scene(VIEW)
    scene.materials = {**scene.materials, "ink": edgegrad.Material(np.zeros(3))}
    one = box((0.0, 0.0, 0.0), (0.3, 0.2, 0.25), "ink", 0.4)
    places = np.stack([np.eye(4)] * 3)
    places[0, :3, :3] = turn(0.3 + 0.5 * theta, 1) * (1.0 + 0.4 * theta)
    places[1, :3, :3] = turn(-0.6, 0) @ np.diag([-1.0, 1.2, 0.8])
    places[2, :3, :3] = turn(0.9 * theta, 2) * 0.7
    places[:, :3, 3] = [[-0.5, 0.3, 0.2], [0.5, -0.1 + 0.6 * theta, 0.0], [0.0 - 0.5 * theta, -0.6, 0.5]]
    one.instances = places
    scene.meshes = {"boxes": one, "card": rectangle((0, 0, -0.8), (0.9, 0, 0), (0, 0.7, 0), "cold")}
    return scene


def stretched(theta: float) -> edgegrad.Scene:
    """The mesh that is placed changes, and with it all its copies."""
    scene = instanced(0.0)
    mesh = scene.meshes["boxes"]
    mesh.vertices = mesh.vertices * (1.0 + theta * np.array([0.5, -0.8, 0.3])) + theta * np.array([0.2, 0.4, -0.3])
    return scene


@pytest.mark.parametrize(
    ("make", "path"),
    [(instanced, "meshes.boxes.instances"), (stretched, "meshes.boxes.vertices")],
    ids=["place", "mesh"],
)
def test_instances_agree_with_central_differences(make: Make, path: str) -> None:
    need("native")
    check_agreement(along(make, [path]), **PRIMARY)


# ---------------------------------------------------------------- reverse mode
DOT: dict[str, tuple[Make, list[str]]] = {
    **{name: CASES[name] for name in ("perspective: shapes move", "crop and wide filter: camera moves",
                                      "orthographic: camera turns", "panorama all around: camera turns",
                                      "panorama: longitudes", "lens: focus", "blades: aperture's ratio",
                                      "blades: aperture turns", "lens: aperture opens", "perspective: shift")},
    **{name: INTERSECTING[name] for name in ("boxes", "a mesh and itself")},
    "instances": (instanced, ["meshes.boxes.instances", "meshes.boxes.vertices"]),
}


@pytest.mark.parametrize("name", DOT)
def test_reverse_mode_is_the_transpose(name: str) -> None:
    need("native")
    check_transpose(*DOT[name], spp=32, terms=("primary",))


# ---------------------------------------------------------------- radiance beside edges
def furnished(depth_of_card: float = 0.0) -> edgegrad.Scene:
    """A room of many materials with a glossy card in it that nothing hides from the camera."""
    to_world = np.eye(4)
    to_world[:3, :3] = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])  # shines down
    to_world[:3, 3] = (0.2, 1.4, 0.3)
    return edgegrad.Scene(
        camera((0.2, 0.3, 3.4), (0, 0, 0), 32, 0.8),
        {
            "card": rectangle((0.1, 0.05, depth_of_card), (0.5, 0.05, 0.1), (-0.1, 0.45, -0.15), "metal"),
            "floor": rectangle((0, -0.9, 0), (0, 0, 1.6), (1.6, 0, 0), "coat"),
            "wall": rectangle((0, 0.4, -1.2), (1.6, 0, 0), (0, 1.5, 0), "wall"),
            "ball": edgegrad.Mesh(*[v + [-0.6, -0.4, -0.5] if k == 0 else v for k, v in enumerate(shapes.ball(2, 0.4))],
                                  ("glass",)),  # type: ignore[arg-type]
        },
        {
            "metal": edgegrad.Material(np.array([0.9, 0.6, 0.3]), metallic=1.0, roughness=0.4),
            "coat": edgegrad.Material(np.array([0.3, 0.5, 0.7]), roughness=0.6, coat_weight=0.6, coat_roughness=0.3),
            "wall": edgegrad.Material(np.array([0.7, 0.3, 0.2])),
            "glass": edgegrad.Material(np.array([0.9, 0.9, 0.9]), transmission=1.0, roughness=0.3),
        },
        {"lamp": edgegrad.AreaLight(to_world, np.array([0.8, 0.6]), "RECTANGLE", 30.0)},
        edgegrad.World(np.ones(3), 0.3),
    )


def test_radiance_beside_edges_is_that_of_pictures() -> None:
    """The change of the whole picture by a moving card, from radiance at points beside its border."""
    need("native")
    scene, depth, velocity = furnished(), 5, np.array([0.7, 0.4, 0.3])
    view, focal = scene.camera, scene.camera.focal
    card = scene.meshes["card"].vertices
    eye, axes = scene.camera.to_world[:3, 3], scene.camera.to_world[:3, :3]

    def screen(p: Floats) -> Floats:
        x, y, z = (p - eye) @ axes
        return focal * np.array([x, -y]) / -z

    def radiance(p: Floats, seed: int) -> Floats:
        scene.camera = camera(eye, p, 1, 1e-5)
        return np.asarray(Renderer(scene).render(spp=1 << 13, seed=seed, max_depth=depth)[0, 0], np.float64)

    wanted, points = np.zeros(3), 6
    for a, b in zip(card, np.roll(card, -1, axis=0), strict=True):
        for k in range(points):
            e = a + (b - a) * (k + 0.5) / points
            inwards = card.mean(axis=0) - e
            along, rate = screen(e + 1e-4 * (b - a)) - screen(e), screen(e + 1e-4 * velocity) - screen(e)
            inside = screen(e + 1e-4 * inwards) - screen(e)
            swept = np.linalg.det([along, rate]) * np.sign(np.linalg.det([along, inside])) * 1e8
            wanted -= swept / points * (radiance(e + 1e-3 * inwards, k) - radiance(e - 1e-3 * inwards, k + 50))
    scene.camera = view
    tangent = {"meshes.card.vertices": np.broadcast_to(velocity, card.shape)}
    found = np.array([
        primary(Renderer(scene), tangent, spp=128, seed=k, max_depth=depth).sum(axis=(0, 1)) for k in range(16)
    ])
    # The noise of the points' radiance, and the few points along each side, make the expected sum wrong by little.
    check(mean_p_value(found, wanted, rounding=0.03 * np.abs(wanted)))
    assert half_width(found).max() < 0.2 * np.abs(wanted).max()
