"""Textures that read how long a ray is and how often its path has bounced."""

from __future__ import annotations

import numpy as np
import pytest

import edgegrad
from edgegrad import expression as e
from edgegrad.planning.scene_plan import plan
from tests.support.small_scenes import need, pixel_at, rectangle

need("native")


def glow(value: e.Expression) -> edgegrad.Material:
    return edgegrad.Material(np.zeros(3), kind="DIFFUSE", emission=np.ones(3), textures={"emission": value})


def seen(value: e.Expression, height: float = 3.0, mirrored: bool = False, panes: int = 0) -> edgegrad.Scene:
    """One pixel of a glowing plane, straight below the camera or behind a mirror at 45 degrees, through panes."""
    meshes = {"plane": rectangle((0, 0, 0), (2, 0, 0), (0, 2, 0), "glow")}
    if mirrored:
        meshes["mirror"] = rectangle((0, 0, 2), (0, 1, 0), (1, 0, 1), "mirror")
        eye, target = (height, 0, 2), (0, 0, 2)
    else:
        eye, target = (0, 0, height), (0, 0, 0)
    for k in range(panes):
        meshes[f"pane {k}"] = rectangle((0, 0, 0.5 + 0.5 * k), (2, 0, 0), (0, 2, 0), "pane")
    return edgegrad.Scene(pixel_at(eye, target, (0, 1, 0)), meshes, {
        "glow": glow(value), "mirror": edgegrad.Material(np.ones(3), kind="GLOSSY", roughness=0.0),
        "pane": edgegrad.Material(np.ones(3), kind="TRANSPARENT")})  # fmt: skip


def radiance(scene: edgegrad.Scene) -> float:
    return float(edgegrad.Renderer(scene).render(spp=4, max_depth=4)[0, 0].mean())


@pytest.mark.parametrize(
    ("mirrored", "panes", "wanted"), [(False, 0, 3.0), (False, 2, 3.0), (True, 0, 2.0), (True, 2, 2.0)]
)
def test_rays_are_as_long_as_their_way_from_the_last_bounce(mirrored: bool, panes: int, wanted: float) -> None:
    assert radiance(seen(e.RayLength(), 3.0, mirrored, panes)) == pytest.approx(wanted, rel=1e-4)


@pytest.mark.parametrize(
    ("kind", "mirrored", "panes", "wanted"),
    [("ALL", False, 0, 0), ("ALL", True, 1, 1), ("GLOSSY", True, 1, 1), ("DIFFUSE", True, 0, 0),
     ("TRANSPARENT", False, 2, 2), ("TRANSPARENT", True, 3, 3), ("GLOSSY", False, 3, 0)],
)  # fmt: skip
def test_bounces_are_counted_by_kind(kind: str, mirrored: bool, panes: int, wanted: int) -> None:
    assert radiance(seen(e.RayBounces(kind), 3.0, mirrored, panes)) == pytest.approx(wanted, abs=1e-6)


@pytest.mark.parametrize("mirrored", [False, True])
def test_the_derivative_of_a_length(mirrored: bool) -> None:
    """The plane sinks: the length grows at the same rate."""
    square = e.Math("MULTIPLY", e.RayLength(), e.RayLength())
    renderer = edgegrad.Renderer(seen(square, 3.0, mirrored))
    tangent = np.tile((0.0, 0.0, -1.0), (4, 1))
    forward = renderer.render_forward({"meshes.plane.vertices": tangent}, spp=4, max_depth=4)
    assert forward[0, 0] == pytest.approx(np.full(3, 2.0 * (2.0 if mirrored else 3.0)), rel=1e-3)
    adjoint = np.array([[[1.0, 2.0, -0.5]]], np.float32)
    backward = renderer.render_backward(adjoint, ["meshes.plane.vertices"], spp=4, max_depth=4)
    found = float(np.sum(backward["meshes.plane.vertices"] * tangent))
    assert found == pytest.approx(float(np.sum(adjoint * forward)), rel=1e-4)


def test_the_plan_names_what_boundary_terms_do_not_count() -> None:
    def named(value: e.Expression) -> bool:
        return any("lengths of rays" in words for words in plan(seen(value), ["meshes.plane.vertices"]).missing)

    assert named(e.RayLength())
    assert not named(e.Math("ADD", 1.0, e.Backfacing()))
