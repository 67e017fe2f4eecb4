"""What a fit reports about its parameters."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import edgegrad
from edgegrad import Target, VertexRules
from tests.support import shapes
from tests.support.fits import COLOR, VERTICES, ball


@pytest.mark.filterwarnings("ignore:fit. no gradient")
def test_limits_and_parameters_without_effect_are_found() -> None:
    """A target brighter than any colour can be; a lamp that is switched off says nothing about its place."""
    scene = ball()
    scene.camera.width, scene.camera.height = 12, 9
    scene.lights["lamp"].power = 0.0
    scene.materials["clay"].base_color = np.array([0.9, 0.5, 0.5])
    seen = edgegrad.render(scene, spp=16)
    result = edgegrad.fit(scene, Target(seen * (9.0, 1.0, 1.0)), [COLOR, "lights.lamp.position"], iterations=20, spp=2)
    found = {(one.path, one.kind): (one.count, one.size) for one in result.findings}
    assert found == {(COLOR, "at the upper limit"): (1, 3), ("lights.lamp.position", "open"): (3, 3)}
    said = [str(one) for one in result.findings]
    assert "the pictures say nothing about 'lights.lamp.position'" in said
    assert f"1 of 3 numbers of '{COLOR}': at the upper limit" in said


def _depth_notes(scene: edgegrad.Scene, cameras: list[edgegrad.Camera], **options: Any) -> list[str]:
    targets = [Target(np.full((8, 8, 3), 0.1), camera) for camera in cameras]
    result = edgegrad.fit(scene, targets, [VERTICES], iterations=1, spp=1, **options)
    return [note for note in result.notes if "depth" in note]


def test_a_lack_of_depth_is_told() -> None:
    """One place, or one direction of parallel projections, tells no depth; two do."""
    scene = shapes.scene(*shapes.ball(1))
    near, beside = (shapes.camera(eye, size=(8, 8)) for eye in ((0.0, -6.0, 1.0), (6.0, 0.0, 1.0)))
    assert len(_depth_notes(scene, [near, replace(near, fov_x=0.5)])) == 1
    assert not _depth_notes(scene, [near, beside])
    flat, turned = (replace(one, kind="ORTHOGRAPHIC", ortho_width=3.0) for one in (near, beside))
    shifted = replace(flat, to_world=flat.to_world.copy())
    shifted.to_world[:3, 3] += (0.3, -1.0, 0.1)
    assert len(_depth_notes(scene, [flat, shifted])) == 1
    assert not _depth_notes(scene, [flat, turned])
    assert not _depth_notes(scene, [flat, near])


def test_symmetry_tells_some_depth() -> None:
    camera = shapes.camera((3.0, -5.0, 1.0), size=(8, 8))
    alone, symmetric = (_depth_notes(shapes.scene(*shapes.ball(1)), [camera],
                                     vertex_rules={VERTICES: VertexRules(symmetry=axis)})
                        for axis in (None, "x"))  # fmt: skip
    assert "mirror image" in symmetric[0] and "mirror image" not in alone[0]
