"""Outlines of finely divided emissive meshes, whose light is sampled in fixed directions, and central differences."""

from __future__ import annotations

import numpy as np
import pytest

import edgegrad
from edgegrad.scene.mesh import Mesh
from tests.support import shapes
from tests.support.picture_differences import check_agreement, check_transpose, need_every_table
from tests.support.scenes.outlines_of_emitters import CASES, DEEP, GLOSS, floor_under
from tests.support.slow_cases import slow
from tests.support.small_scenes import along

BLACK_MOVES_OVER_METAL = ("ball over metal", "sheet over metal", "two balls", "sheet through the lamp")
SLOW = ("ball over a matte floor", "camera moves", "floor moves", "sheet over metal", "two balls", "lamp that reflects")


@pytest.mark.parametrize("name", slow(CASES, SLOW))
def test_outlines_agree_with_central_differences(name: str) -> None:
    need_every_table()
    check_agreement(along(*CASES[name]))


@pytest.mark.parametrize("name", slow(DEEP, SLOW))
def test_outlines_agree_at_later_surfaces(name: str) -> None:
    need_every_table()
    check_agreement(along(*DEEP[name]), max_depth=3)


@pytest.mark.parametrize("name", [*CASES, *DEEP])
def test_reverse_mode_is_the_transpose(name: str) -> None:
    need_every_table()
    make, paths = (CASES | DEEP)[name]
    check_transpose(make, paths, spp=16, max_depth=3 if name in DEEP else 2, seed=4)


@pytest.mark.parametrize("name", CASES)
def test_plan_says_whose_light_is_held_and_whether_it_is_alone(name: str) -> None:
    need_every_table()
    make, paths = CASES[name]
    scene = make(0.0)
    plan = edgegrad.plan(scene, paths, max_depth=2)
    interior, shadow = (next(term for term in plan.terms if term.name == key) for key in ("interior", "shadow"))
    assert any("the outlines of lamp" in words for words in shadow.why) == (name != "ball over a matte floor")
    assert interior.computed == (name not in BLACK_MOVES_OVER_METAL)
    adjoint = np.random.default_rng(0).normal(size=(24, 24, 3)).astype(np.float32)
    gradient = edgegrad.Renderer(scene).render_backward(adjoint, paths, spp=4, max_depth=2, terms=("interior",))
    assert any(g.any() for g in gradient.values()) == interior.computed


def test_vertices_within_an_outline_change_nothing() -> None:
    """The gradient by vertices inside of a flat emissive sheet is zero; only the border changes the light."""
    need_every_table()
    vertices, faces = shapes.sheet(6, 1.4)
    lamp = Mesh(vertices[:, [0, 2, 1]] + [0.0, 1.0, 0.0], faces, ("lamp",))
    renderer = edgegrad.Renderer(floor_under(lamp, GLOSS))
    adjoint = np.random.default_rng(0).normal(size=(24, 24, 3)).astype(np.float32)
    path = "meshes.lamp.vertices"
    terms = ("interior", "shadow")  # the camera sees the border, too
    gradient = renderer.render_backward(adjoint, [path], spp=16, max_depth=2, terms=terms)[path]
    inside = np.max(np.abs(vertices[:, :2]), axis=1) < 0.69
    assert inside.sum() == 16
    assert not gradient[inside].any()
    assert np.all(np.abs(gradient[~inside]).max(axis=1) > 0.0)
