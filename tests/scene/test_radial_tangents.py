"""Anisotropy without a UV map turns about the axis of the mesh's bounding box, which may be flat."""

from __future__ import annotations

import numpy as np

import edgegrad
from tests.support import small_scenes

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
