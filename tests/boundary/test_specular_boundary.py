"""Edges seen in mirrors and through smooth glass against central differences, whatever moves.

Surfaces that only emit, seen in perfect mirrors: all that changes is where they are seen, and how much of it the glass
lets through.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import edgegrad
from edgegrad.rendering.renderer import Renderer
from tests.benchmarks.scenes import displaced_sphere
from tests.support import shapes
from tests.support.block_statistics import ALARM, compare
from tests.support.picture_differences import agreement, check_agreement, check_equal_bits, check_transpose
from tests.support.small_scenes import Floats, Make, along, box, camera, glowing, need, rectangle

DEPTH = 7
OPTIONS: dict[str, Any] = {"eps": 0.01, "seeds": 8, "thetas": 4, "reference_spp": 256, "max_depth": DEPTH}
MIRROR = edgegrad.Material(np.array([0.9, 0.8, 0.7]), kind="GLOSSY", roughness=0.0, multiscatter=False)
GLASS = edgegrad.Material(np.ones(3), kind="GLASS", roughness=0.0, ior=1.5, multiscatter=False)
WARM = edgegrad.Material(np.zeros(3), np.array([2.0, 1.2, 0.5]), True)
MATERIALS = {"mirror": MIRROR, "glass": GLASS, "warm": WARM, "cold": glowing(0.8, True)}


def ball(center: tuple[float, float, float], radius: float, material: str, divisions: int = 3) -> edgegrad.Mesh:
    """A smooth-shaded ball."""
    vertices, faces = shapes.ball(divisions, radius)
    return edgegrad.Mesh(vertices + np.asarray(center), faces, (material,), smoothing=faces.copy())


def scene(view: edgegrad.Camera, meshes: dict[str, edgegrad.Mesh]) -> edgegrad.Scene:
    return edgegrad.Scene(view, meshes, dict(MATERIALS), world=edgegrad.World(np.ones(3), 0.3))


def shifted(mesh: edgegrad.Mesh, by: Floats) -> edgegrad.Mesh:
    return replace(mesh, vertices=mesh.vertices + by)


def before_mirror(moving: str) -> Make:
    """A box, out of sight, before a flat mirror; the box, the mirror or the camera moves."""

    def make(theta: float) -> edgegrad.Scene:
        mirror = rectangle((0, 0, -1), (1.6, 0, 0), (0, 1.6, 0), "mirror")
        shown = box((0.2, 0.1, 1.0), (0.35, 0.3, 0.25), "warm", 0.5)
        origin, target = np.array([0.6, 1.6, 2.2]), np.array([0.1, 0.0, -1.2])
        match moving:
            case "box":
                shown = shifted(shown, theta * np.array([1.0, 0.4, -0.3]))
            case "mirror":
                mirror = shifted(mirror, theta * np.array([[0, 0, 1.3], [0, 0, 0.7], [0, 0, 0.7], [0, 0, 1.3]]))
            case "camera":
                origin = origin + theta * np.array([1.0, -0.5, 0.2])
        return scene(camera(origin, target, 32, 0.9), {"mirror": mirror, "box": shown})

    return make


def thin_rods(theta: float) -> edgegrad.Scene:
    """Rods before a mirror, in which each is half a pixel wide: most places beside them show what is behind them."""
    made = before_mirror("nothing")(0.0)
    del made.meshes["box"]
    for k, turned in enumerate((0.1, 0.9, 1.7)):
        rod = box((0.5 * k - 0.3, 0.1, 0.8), (0.03, 0.03, 0.8), "warm", turned)
        made.meshes[f"rod {k}"] = shifted(rod, theta * np.array([1.0, 0.5, 0.0])) if k != 1 else rod
    return made


def round_mirror(moving: str) -> Make:
    """A box beside a mirroring ball."""

    def make(theta: float) -> edgegrad.Scene:
        step = theta * np.array([0.7, 0.5, 0.4])
        meshes = {
            "ball": ball((0, 0, 0), 1.0, "mirror"),
            "box": box((1.0, 1.2, 1.6), (0.6, 0.4, 0.5), "warm", 0.4),
        }
        meshes[moving] = shifted(meshes[moving], step)
        return scene(camera((0, 0, 4.5), (0, 0, 0), 32, 0.6), meshes)

    return make


def behind_glass(moving: str) -> Make:
    """A box and a card behind a ball of glass."""

    def make(theta: float) -> edgegrad.Scene:
        glass = ball((0, 0, 0), 1.0, "glass")
        shown = box((0.3, 0.2, -3.0), (0.7, 0.5, 0.4), "warm", 0.4)
        card = rectangle((-0.9, -0.6, -2.2), (0.6, 0.1, 0), (-0.1, 0.5, 0.2), "cold")
        view = camera((0, 0, 4.5), (0, 0, 0), 32, 0.6)
        materials = dict(MATERIALS)
        match moving:
            case "box":
                shown = shifted(shown, theta * np.array([1.0, 0.4, -0.3]))
            case "glass":
                glass = shifted(glass, theta * np.array([0.6, -0.4, 0.3]))
            case "camera":
                view = camera((theta, -0.5 * theta, 4.5), (0, 0, 0), 32, 0.6)
            case "ior":
                materials["glass"] = replace(GLASS, ior=1.5 + theta)
        made = scene(view, {"glass": glass, "box": shown, "card": card})
        return replace(made, materials=materials)

    return make


def before_sky(theta: float) -> edgegrad.Scene:
    """A ball of glass alone under a smooth sky: no edge moves, but where its rays go does."""
    made = scene(camera((0, 0, 4.5), (0, 0, 0), 32, 0.6), {"glass": ball((0, 0, 0), 1.0, "glass")})
    height, width = 32, 64
    y, x = np.mgrid[:height, :width]
    sky = 1.0 + 0.8 * np.stack([np.sin(2.0 * np.pi * (k + 1) * x / width + k) * np.sin(np.pi * (y + 0.5) / height)
                                for k in range(3)], axis=-1)
    return replace(made, materials={**MATERIALS, "glass": replace(GLASS, ior=1.5 + theta)},
                   world=edgegrad.World(np.ones(3), image="sky"), images={"sky": edgegrad.Image(sky)})


def two_mirrors(theta: float) -> edgegrad.Scene:
    """A box seen by two mirrors, one of which turns, with a lens and a wide filter."""
    first = rectangle((0, 0, -1), (1.2, 0, 0), (0, 1.2, 0), "mirror")
    second = rectangle((0, 0, 4.0), (-2.5, 0, 0), (0, 2.5, 0.3), "mirror")
    second = shifted(second, theta * np.array([[0.0, 0, 0.8], [0, 0, -0.8], [0, 0, -0.8], [0, 0, 0.8]]))
    shown = box((0.5, 1.1, 0.6), (0.3, 0.2, 0.25), "warm", 0.5)
    view = replace(camera((0.5, 0.3, 2.2), (0, 0, -1), 32, 0.8), aperture_radius=0.02, focus_distance=5.0,
                   filter="BLACKMAN_HARRIS", filter_width=2.0)
    return scene(view, {"first": first, "second": second, "box": shown})


def block_of_glass(theta: float) -> edgegrad.Scene:
    """A card seen through a block with flat faces, whose edges are seen through each other, and which turns."""
    block = box((0, 0, 0), (0.8, 0.6, 0.5), "glass", 0.5 + theta)
    card = rectangle((0.2, 0.1, -1.5), (0.9, 0.1, 0), (-0.1, 0.6, 0.2), "warm")
    return scene(camera((0.4, 1.0, 3.5), (0, 0, 0), 32, 0.6), {"block": block, "card": card})


def ball_in_mirror(theta: float) -> edgegrad.Scene:
    """A smooth ball that comes before another one in a mirror, under a sun."""
    meshes = {
        "mirror": rectangle((0, 0, -1), (1.6, 0, 0), (0, 1.6, 0), "mirror"),
        "near": ball((0.3 + theta, 0.1, 0.8), 0.45, "clay", 2),
        "far": ball((0.0, -0.1, 1.9), 0.6, "clay", 2),
    }
    made = scene(camera((0.4, 2.2, 1.8), (0.1, 0.0, -1.2), 32, 0.7), meshes)
    return replace(made, materials={**MATERIALS, "clay": edgegrad.Material(np.array([0.8, 0.6, 0.5]))},
                   lights={"sun": edgegrad.SunLight(np.array([0.3, -0.5, 1.0]), 2.0, casts_shadow=False)},
                   world=edgegrad.World(np.zeros(3)))


def copies(theta: float) -> edgegrad.Scene:
    """Two instances of a box, one of them mirrored, move before a flat mirror."""
    made = before_mirror("nothing")(0.0)
    places = np.tile(np.eye(4), (2, 1, 1))
    places[0, :3, 3] = [-0.4 + theta, -0.1, 0.5 * theta]
    places[1, :3] = [[-1.0, 0.2 + theta, 0, 0.9], [0, 0.8, 0, 0.2], [theta, 0, 0.9, 0.1]]
    made.meshes["box"].instances = places
    return made


def small_mirror(kind: str) -> Make:
    """A box before a mirror in a part of the picture, blurred by a lens; the mirror is an instance."""

    def make(theta: float) -> edgegrad.Scene:
        made = before_mirror("box")(theta)
        place = np.diag([0.4, 0.35, 1.0, 1.0])
        place[:3, 3] = [0.05, 0.1, 0.02]
        made.meshes["mirror"].instances = place[None]
        view = replace(made.camera, kind=kind, ortho_width=2.4, aperture_radius=0.05, focus_distance=2.2)
        return replace(made, camera=view)

    return make


CASES: dict[str, tuple[Make, list[str]]] = {
    "small mirror: box moves": (small_mirror("PERSPECTIVE"), ["meshes.box.vertices"]),
    "small mirror: box moves, orthographic": (small_mirror("ORTHOGRAPHIC"), ["meshes.box.vertices"]),
    "flat mirror: box moves": (before_mirror("box"), ["meshes.box.vertices"]),
    "flat mirror: thin rods move": (thin_rods, ["meshes.rod 0.vertices", "meshes.rod 2.vertices"]),
    "flat mirror: mirror moves": (before_mirror("mirror"), ["meshes.mirror.vertices"]),
    "flat mirror: camera moves": (before_mirror("camera"), ["camera.to_world"]),
    "round mirror: box moves": (round_mirror("box"), ["meshes.box.vertices"]),
    "round mirror: mirror moves": (round_mirror("ball"), ["meshes.ball.vertices"]),
    "glass: box moves": (behind_glass("box"), ["meshes.box.vertices"]),
    "glass: glass moves": (behind_glass("glass"), ["meshes.glass.vertices"]),
    "glass: camera moves": (behind_glass("camera"), ["camera.to_world"]),
    "glass: its index grows": (behind_glass("ior"), ["materials.glass.ior"]),
    "glass: its index grows before a sky": (before_sky, ["materials.glass.ior"]),
    "glass: a block turns": (block_of_glass, ["meshes.block.vertices"]),
    "flat mirror: ball before ball": (ball_in_mirror, ["meshes.near.vertices"]),
    "flat mirror: instances move": (copies, ["meshes.box.instances"]),
    "two mirrors: one turns": (two_mirrors, ["meshes.second.vertices"]),
}


@pytest.mark.parametrize("case", list(CASES))
def test_agrees_with_differences(case: str) -> None:
    need("native")
    # Between two mirrors the derivative itself changes much within the interval.
    noise = 0.6 if case.startswith("two mirrors") else 0.15
    # By its index a ball's rim sends few rays far aside: most of the noise is theirs.
    seeds = 16 if case.endswith("before a sky") else OPTIONS["seeds"]
    # Glass that fills the picture takes half of the interior term's samples.
    spp = 128 if case.startswith("glass") else 64
    options = {**OPTIONS, "seeds": seeds, "spp": spp}
    check_agreement(along(*CASES[case]), noise=noise, terms=("interior", "primary"), **options)


def few_faces(theta: float) -> edgegrad.Scene:
    """A ball of glass of 80 faces, whose normals send many rays into the faces that stand for them."""
    shape = displaced_sphere(2, 0.0)
    turned = shape["vertices"] + theta * (np.array([0.6, -0.4, 0.3]) + 0.5 * shape["vertices"][:, [1, 2, 0]])
    body = edgegrad.Mesh(turned, shape["faces"].astype(np.int32), ("glass",), smoothing=shape["faces"].astype(np.int32))
    return scene(camera((0, 0, 4.5), (0, 0, 0), 32, 0.6), {"body": body})


def test_horizons_of_smooth_glass_agree_with_differences() -> None:
    need("native")
    check_agreement(along(few_faces, ["meshes.body.vertices"]), noise=0.15, **{**OPTIONS, "max_depth": 3, "seeds": 16})


def test_horizons_of_smooth_glass_are_transposed() -> None:
    need("native")
    check_transpose(few_faces, ["meshes.body.vertices"], spp=16, seed=3, max_depth=3, terms=("primary",))


@pytest.mark.parametrize("case", ["flat mirror: mirror moves", "round mirror: box moves", "glass: glass moves"])
def test_differences_notice_a_missing_term(case: str) -> None:
    need("native")
    assert agreement(along(*CASES[case]), **OPTIONS, terms=("interior",)).p_value < 1e-6


@pytest.mark.parametrize("pane", [box((0, 0, 0), (2.5, 2.5, 0.3), "glass"), ball((0, 0, 0), 1.0, "glass")])
def test_glass_of_index_one_changes_nothing(pane: edgegrad.Mesh) -> None:
    """What is seen through glass that hardly refracts has the derivative that it has by itself: every crossing counts
    once, also where rounding lets rays slip past the edge."""
    need("native")
    clear = replace(GLASS, kind="REFRACTION", ior=1.00005)
    meshes = {"box": behind_glass("box")(0.0).meshes["box"]}
    view = camera((0, 0, 4.5), (0, 0, 0), 32, 0.6)
    through, alone = (Renderer(replace(scene(view, m), materials={**MATERIALS, "glass": clear}))
                      for m in ({**meshes, "glass": pane}, meshes))
    tangent = {"meshes.box.vertices": np.broadcast_to([1.0, 0.4, -0.3], (8, 3)).astype(float)}
    options = {"max_depth": 3, "terms": ["primary"]}
    wanted = [alone.render_forward(tangent, spp=256, seed=s, **options) for s in range(4)]
    found = [through.render_forward(tangent, spp=64, seed=s, **options) for s in range(16)]
    outcome = compare(found, np.mean(wanted, axis=0), np.std(wanted, axis=0, ddof=1) / 2.0)
    assert outcome.p_value > ALARM, str(outcome)


@pytest.mark.parametrize("case", list(CASES))
def test_modes_are_transposes(case: str) -> None:
    need("native")
    make, paths = CASES[case]
    check_transpose(make, paths, spp=16, seed=3, max_depth=DEPTH, terms=("interior", "primary"))


def test_same_bits_for_any_number_of_threads() -> None:
    need("native")
    make, paths = CASES["glass: glass moves"]
    check_equal_bits(make, paths, spp=8, max_depth=DEPTH)


def test_plan_tells_of_it() -> None:
    need("native")
    words = str(edgegrad.plan(before_mirror("box")(0.0), ["meshes.box.vertices"], max_depth=DEPTH))
    assert "all edges that the camera sees by mirrors and smooth glass (mirror)" in words
    assert "thinner than a quarter of a pixel" in words
    assert "mirrors" not in str(edgegrad.plan(before_mirror("box")(0.0), ["materials.warm.emission"], max_depth=DEPTH))
    index = edgegrad.plan(behind_glass("ior")(0.0), ["materials.glass.ior"], max_depth=DEPTH)
    assert "smooth glass (glass)" in str(index)


def test_rough_mirrors_show_no_edges() -> None:
    """Where the box is seen in the mirror alone, it has an edge; where the mirror is rough, none that is computed."""
    need("native")
    made = before_mirror("box")(0.0)
    tangent = {"meshes.box.vertices": np.ones((8, 3))}
    reflected = slice(6, 16), slice(12, 24)
    sizes = []
    for roughness in (0.0, 0.3):
        mirror = replace(MIRROR, roughness=roughness)
        renderer = Renderer(replace(made, materials={**MATERIALS, "mirror": mirror}))
        image = renderer.render_forward(tangent, spp=8, max_depth=2, terms=["primary"])
        sizes.append(np.abs(image[reflected]).max())
    assert sizes[0] > 1.0
    assert sizes[1] == 0.0
