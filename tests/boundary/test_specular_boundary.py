"""Edges seen in mirrors and through smooth glass against central differences, whatever moves.

Surfaces that only emit, seen in perfect mirrors: all that changes is where they are seen, and how much of it the glass
lets through.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import edgegrad
from edgegrad.rendering.renderer import Renderer
from tests.support.block_statistics import check, check_noticed, compare
from tests.support.picture_differences import agreement, check_agreement, check_equal_bits, check_transpose
from tests.support.scenes.mirrors_and_glass import (
    CASES,
    DEPTH,
    GLASS,
    MATERIALS,
    MIRROR,
    OPTIONS,
    ball,
    before_mirror,
    behind_glass,
    scene,
)
from tests.support.shapes import displaced_sphere
from tests.support.small_scenes import along, box, camera, need


@pytest.mark.parametrize("case", list(CASES))
def test_agrees_with_differences(case: str) -> None:
    need("native")
    # By its index a ball's rim sends few rays far aside: most of the noise is theirs.
    seeds = 16 if case.endswith("before a sky") else OPTIONS["seeds"]
    # Glass that fills the picture takes half of the interior term's samples.
    spp = 128 if case.startswith("glass") else 64
    options = {**OPTIONS, "seeds": seeds, "spp": spp}
    check_agreement(along(*CASES[case]), terms=("interior", "primary"), **options)


def few_faces(theta: float) -> edgegrad.Scene:
    """A ball of glass of 80 faces, whose normals send many rays into the faces that stand for them."""
    shape = displaced_sphere(2, 0.0)
    turned = shape["vertices"] + theta * (np.array([0.6, -0.4, 0.3]) + 0.5 * shape["vertices"][:, [1, 2, 0]])
    body = edgegrad.Mesh(turned, shape["faces"].astype(np.int32), ("glass",), smoothing=shape["faces"].astype(np.int32))
    return scene(camera((0, 0, 4.5), (0, 0, 0), 32, 0.6), {"body": body})


def test_horizons_of_smooth_glass_agree_with_differences() -> None:
    need("native")
    check_agreement(along(few_faces, ["meshes.body.vertices"]), **{**OPTIONS, "max_depth": 3, "seeds": 16})


def test_horizons_of_smooth_glass_are_transposed() -> None:
    need("native")
    check_transpose(few_faces, ["meshes.body.vertices"], spp=16, seed=3, max_depth=3, terms=("primary",))


@pytest.mark.parametrize("case", ["flat mirror: mirror moves", "round mirror: box moves", "glass: glass moves"])
def test_differences_notice_a_missing_term(case: str) -> None:
    need("native")
    check_noticed(agreement(along(*CASES[case]), **OPTIONS, terms=("interior",)))


@pytest.mark.parametrize("pane", [box((0, 0, 0), (2.5, 2.5, 0.3), "glass"), ball((0, 0, 0), 1.0, "glass")])
def test_glass_of_index_one_changes_nothing(pane: edgegrad.Mesh) -> None:
    """A box seen through glass that hardly refracts has the same derivative as without the glass.

    Every intersection counts once, also where rounding lets rays slip past the edge.
    """
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
    check(outcome)


@pytest.mark.parametrize("case", list(CASES))
def test_modes_are_transposes(case: str) -> None:
    need("native")
    make, paths = CASES[case]
    check_transpose(make, paths, spp=16, seed=3, max_depth=DEPTH, terms=("interior", "primary"))


def test_same_bits_for_any_number_of_threads() -> None:
    need("native")
    make, paths = CASES["glass: glass moves"]
    check_equal_bits(make, paths, spp=8, max_depth=DEPTH)


# Corners of flat figures, in pixels: of a square, of a slender triangle, of a rod thinner than a quarter of a pixel.
FIGURES = {
    "square": [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]],
    "triangle": [[0.0, 0.45], [-0.15, -0.25], [0.15, -0.25]],
    "rod": [[-1.5, -0.05], [1.5, -0.05], [1.5, 0.05], [-1.5, 0.05]],
}


@pytest.mark.parametrize("figure", list(FIGURES))
def test_mirrored_figures_of_few_pixels_have_the_derivative_of_their_area(figure: str) -> None:
    """A glowing figure, parallel to the mirror and to the picture: the picture's sum is the figure's area there.

    Near its corners the figure is narrower than the places of scan lines are apart.
    """
    need("native")
    width, distance, fov = 6, 5.0, 0.5
    pixel = distance * 2.0 * np.tan(fov / 2.0) / width
    corners = pixel * np.array(FIGURES[figure]) @ [[0.94, 0.34], [-0.34, 0.94]]
    lamp = np.c_[corners + [0.05, 0.03], np.full(len(corners), 3.0)]
    faces = np.array([[0, 2, 1], [0, 3, 2]][: len(corners) - 2])
    floor = edgegrad.Mesh(5.0 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]),
                          np.array([[0, 1, 2], [0, 2, 3]]), ("mirror",))  # fmt: skip
    place = np.eye(4)
    place[2, 3] = 2.0
    made = edgegrad.Scene(
        edgegrad.Camera(place, fov, width, width),
        {"floor": floor, "lamp": edgegrad.Mesh(lamp, faces, ("glow",))},
        {"mirror": replace(MIRROR, base_color=np.ones(3)), "glow": edgegrad.Material(np.zeros(3), np.ones(3))},
    )
    grows = {"meshes.lamp.vertices": np.c_[corners, np.zeros(len(corners))]}
    x, y = corners.T / pixel
    exact = abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))  # twice the area
    renderer = Renderer(made)
    sums = np.array([
        renderer.render_forward(grows, spp=128, max_depth=2, seed=seed)[..., 0].sum(dtype=np.float64)
        for seed in range(96)
    ])  # fmt: skip
    error = sums.std(ddof=1) / np.sqrt(len(sums))
    assert error < 0.07 * exact
    assert abs(sums.mean() - exact) < 4.0 * error


def test_plan_tells_of_it() -> None:
    need("native")
    words = str(edgegrad.plan(before_mirror("box")(0.0), ["meshes.box.vertices"], max_depth=DEPTH))
    assert "all edges that the camera sees by mirrors and smooth glass (mirror)" in words
    assert "within a quarter of a pixel" in words
    assert "mirrors" not in str(edgegrad.plan(before_mirror("box")(0.0), ["materials.warm.emission"], max_depth=DEPTH))
    index = edgegrad.plan(behind_glass("ior")(0.0), ["materials.glass.ior"], max_depth=DEPTH)
    assert "smooth glass (glass)" in str(index)


def test_rough_mirrors_show_no_edges() -> None:
    """The primary term has the edges that a mirror shows, and none that a rough mirror shows."""
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
