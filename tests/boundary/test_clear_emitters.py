"""Emissive sheets and convex bodies do not hide the light of their own faces: their edges get no samples."""

from __future__ import annotations

import numpy as np
import pytest

import edgegrad
from tests.support import shapes
from tests.support.block_statistics import half_width
from tests.support.picture_differences import need_every_table
from tests.support.small_scenes import FLOOR, box, camera, glowing, matte, rectangle


def lit_box(subdivisions: int) -> edgegrad.Scene:
    """A box over a floor, lit by a small glowing ball that the camera doesn't see."""
    vertices, faces = shapes.octahedral_ball(subdivisions)
    ball = edgegrad.Mesh(0.1 * vertices + np.array([0.3, 1.0, 0.2]), faces, ("lamp",))
    ball.visible_to = frozenset(ball.visible_to) - {"camera"}
    return edgegrad.Scene(
        camera((0, 3.2, 2.4), (0, 0, 0.1), 16, 0.7),
        {"floor": rectangle(**FLOOR, material="floor"), "box": box((0.2, 0.4, 0.0), (0.2, 0.15, 0.2), "floor", 0.5),
         "ball": ball},
        {"floor": matte(), "lamp": glowing(10.0)},
    )


def shadow_noise(scene: edgegrad.Scene, seeds: int = 24) -> tuple[float, float]:
    """Root mean squares of the shadow term's block sums, by the box's shift, and of their standard deviations."""
    renderer = edgegrad.Renderer(scene)
    tangent = {"meshes.box.vertices": np.broadcast_to([1.0, 0.0, 0.0], scene.meshes["box"].vertices.shape)}
    pictures = np.array([renderer.render_forward(tangent, spp=16, seed=k, terms=("shadow",)) for k in range(seeds)])
    blocks = pictures[..., 1].reshape(seeds, 2, 8, 2, 8).sum((2, 4), dtype=np.float64)
    return float(np.sqrt(np.mean(blocks.mean(0) ** 2))), float(np.sqrt(np.mean(blocks.var(0, ddof=1))))


@pytest.mark.parametrize("many", [4, 5])
def test_a_finely_divided_lamp_casts_shadows_without_more_noise(many: int) -> None:
    """Of 24 seeds a standard deviation is known to 15 %; with samples on the lamp's own edges the ratio is above 20."""
    need_every_table()
    coarse, fine = lit_box(2), lit_box(many)
    assert len(fine.meshes["ball"].faces) >= 12 * len(coarse.meshes["ball"].faces)
    (mean, noise), (fine_mean, fine_noise) = shadow_noise(coarse), shadow_noise(fine)
    assert mean > 4.0 * noise  # the noise is that of a derivative which is resolved
    assert fine_noise < 3.0 * noise * (fine_mean / mean)


def test_lamps_that_hide_their_own_light_keep_their_edges() -> None:
    """Two crossed boxes as one lamp: the step between them hides light from the floor."""
    need_every_table()
    low, high = box((0.0, 1.0, 0.0), (0.4, 0.05, 0.4), "lamp"), box((0.0, 1.3, 0.0), (0.05, 0.3, 0.4), "lamp")
    lamp = edgegrad.Mesh(np.concatenate([low.vertices, high.vertices]),
                         np.concatenate([low.faces, high.faces + len(low.vertices)]), ("lamp",))
    scene = edgegrad.Scene(
        camera((0, 1.5, 6.0), (0, 1.0, 0), 16, 0.9),
        {"wall": rectangle((2.0, 1.0, 0), (0, 1.0, 0), (0, 0, 1.0), "wall"), "lamp": lamp},
        {"wall": matte(), "lamp": glowing(3.0)},
    )
    step = np.array([0.0, 1.0, 0.0]) * (np.arange(len(lamp.vertices)) < len(low.vertices))[:, None]
    tangent = {"meshes.lamp.vertices": step}
    found = np.array([edgegrad.Renderer(scene).render_forward(tangent, spp=64, seed=k, terms=("shadow",)).sum()
                      for k in range(16)])  # fmt: skip
    assert abs(found.mean()) > half_width(found)
