"""Anisotropy without a UV map turns about the axis of the mesh's bounding box, which may be flat."""

from __future__ import annotations

import numpy as np
import pytest

import edgegrad
from tests.support import small_scenes
from tests.support.picture_differences import check_agreement

OPTIONS = {"spp": 4, "max_depth": 2, "seed": 1}


def upright_sheet(rounding: float) -> edgegrad.Scene:
    """A brushed sheet in the plane y = 1.6, but for a rounding of its vertices, seen at a slant."""
    sheet = small_scenes.rectangle((0.2, 1.6, -0.1), (3.0, 0.0, 0.0), (0.0, 0.0, 3.0), "brushed")
    sheet.vertices[:, 1] += rounding * np.array([0.0, 1.0, -1.0, 1.0])
    return edgegrad.Scene(
        small_scenes.camera((1.0, -3.0, 2.0), (0.0, 1.6, 0.0), 8, up=(0, 0, 1)), {"sheet": sheet},
        {"brushed": edgegrad.Material(kind="GLOSSY", roughness=0.5, anisotropy=0.8)},
        {"lamp": edgegrad.PointLight(np.array([0.0, -2.0, 1.0]), 50.0)},
    )  # fmt: skip


def test_a_mesh_that_is_flat_but_for_rounding_counts_as_flat() -> None:
    small_scenes.need("native")
    path = "meshes.sheet.vertices"
    found = []
    for rounding in (0.0, 1e-15):
        renderer = edgegrad.Renderer(upright_sheet(rounding))
        picture = renderer.render(**OPTIONS)
        gradient = renderer.render_backward(np.ones_like(picture), [path], **OPTIONS)[path]
        found.append((picture, gradient))
    (flat, flat_gradient), (rounded, rounded_gradient) = found
    np.testing.assert_allclose(rounded, flat, rtol=0.05)
    # Samples on the diagonal may be either triangle's, whose vertices differ: all together move the same.
    np.testing.assert_allclose(rounded_gradient.sum(axis=0), flat_gradient.sum(axis=0), rtol=0.02, atol=1e-6)


@pytest.mark.parametrize("distribution", ["GGX", "ASHIKHMIN_SHIRLEY", "BECKMANN"])
@pytest.mark.parametrize(("anisotropy", "rounding"), [(1e-6, 2e-2), (0.3, 2e-7)])
def test_tangents_that_turn_fast_leave_the_modes_equal(anisotropy: float, rounding: float, distribution: str) -> None:
    """On a sheet that is barely flat, a vertex turns the tangents of tilted normals by a million times its way.

    A lobe that is nearly round hardly changes. What it changes by must not be a difference of numbers that are larger
    still, as they are where the view and the light are turned instead of their half vector.
    """
    small_scenes.need("native")
    scene, path = upright_sheet(1e-6), "meshes.sheet.vertices"
    sheet = scene.meshes["sheet"]
    sheet.smoothing, sheet.normals = sheet.faces.copy(), np.tile([0.5, -0.7, 0.5], (len(sheet.vertices), 1))
    scene.materials["brushed"] = edgegrad.Material(kind="GLOSSY", roughness=0.2, anisotropy=anisotropy,
                                                   distribution=distribution)  # fmt: skip
    renderer = edgegrad.Renderer(scene)
    gaps = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        tangent = rng.normal(size=sheet.vertices.shape)
        forward = renderer.render_forward({path: tangent}, **OPTIONS).astype(np.float64)
        adjoint = rng.normal(size=forward.shape).astype(np.float32)
        pushed = forward * adjoint
        pulled = renderer.render_backward(adjoint, [path], **OPTIONS)[path] * tangent
        gaps.append((pushed.sum() - pulled.sum()) / (np.abs(pushed).sum() + np.abs(pulled).sum()))
    assert np.sqrt(np.mean(np.square(gaps))) < rounding


@pytest.mark.parametrize("stretched", [False, True])
def test_the_box_moves_with_the_mesh(stretched: bool) -> None:
    """A sheet and a small one in its corner, of one mesh: the box's centre is in neither."""
    small_scenes.need("native")
    sheet = small_scenes.rectangle((0.0, 0.0, 0.0), (0.7, 0.1, 0.2), (-0.1, 0.6, 0.1), "brushed")
    small = small_scenes.rectangle((1.2, 0.9, -0.2), (0.1, 0.0, 0.0), (0.0, 0.1, 0.0), "brushed")
    vertices = np.concatenate([sheet.vertices, small.vertices])
    faces = np.concatenate([sheet.faces, small.faces + len(sheet.vertices)])
    rate = vertices * [0.3, -0.2, 0.4] if stretched else np.broadcast_to([1.0, 0.5, 0.2], vertices.shape)

    def make(theta: float) -> edgegrad.Scene:
        return edgegrad.Scene(
            small_scenes.camera((0.0, -2.0, 2.5), (0.1, 0.1, 0.0), 16, up=(0, 0, 1)),
            {"sheet": edgegrad.Mesh(vertices + theta * rate, faces, ("brushed",))},
            {"brushed": edgegrad.Material(np.full(3, 0.8), metallic=1.0, roughness=0.4, anisotropy=0.8)},
            {"lamp": edgegrad.PointLight(np.array([0.3, 1.5, 2.0]), 50.0)}, small_scenes.white_world(0.2),
        )  # fmt: skip

    check_agreement(small_scenes.along(make, ["meshes.sheet.vertices"]), max_depth=2)
