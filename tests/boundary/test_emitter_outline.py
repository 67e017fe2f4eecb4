"""Light of emissive meshes of many faces, whose direction is held: their outlines, against central differences."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import edgegrad
from edgegrad.scene.mesh import Mesh
from tests.support import shapes
from tests.support.picture_differences import check_agreement, check_transpose, need_every_table
from tests.support.rich_scene import turn
from tests.support.slow_cases import slow
from tests.support.small_scenes import Make, along, box, camera, glowing, matte, rectangle

VIEW = camera((0, 2.2, 3.0), (0, 0.2, 0.1), 24, 0.7)
GLOSS = edgegrad.Material(np.array([0.9, 0.8, 0.6]), kind="GLOSSY", roughness=0.4)
MIRROR = edgegrad.Material(np.array([0.9, 0.8, 0.6]), kind="GLOSSY", roughness=0.0)


def lamp_ball() -> Mesh:
    """192 faces."""
    vertices, faces = shapes.ball(2, 0.4)
    return Mesh(vertices + [0.2, 1.0, -0.2], faces, ("lamp",))


def lamp_sheet() -> Mesh:
    """An open sheet of 50 faces, bent, in bands of two colours and black, over the floor."""
    vertices, faces = shapes.sheet(6, 1.4)
    x, y, _ = vertices.T
    bent = np.stack([x, 1.0 + 0.3 * np.abs(y) + 0.1 * x, y], axis=1)
    band = np.clip(((vertices[faces].mean(axis=1)[:, 0] + 0.7) / 0.47).astype(np.int32), 0, 2)
    return Mesh(bent, faces, ("lamp", "other", "black"), band)


def floor_under(lamp: Mesh, floor: edgegrad.Material) -> edgegrad.Scene:
    return edgegrad.Scene(
        VIEW,
        {"floor": rectangle((0, 0, 0), (0, 0, 3), (3, 0, 0), "floor"), "lamp": lamp},
        {"floor": floor, "lamp": glowing(6.0, True),
         "other": edgegrad.Material(np.zeros(3), np.array([1.0, 5.0, 9.0]), True), "black": matte(0.0, 0.0, 0.0)},
    )


def over(floor: edgegrad.Material, lamp: Callable[[], Mesh] = lamp_ball) -> Callable[[], edgegrad.Scene]:
    return lambda: floor_under(lamp(), floor)


def occluded() -> edgegrad.Scene:
    scene = floor_under(lamp_ball(), GLOSS)
    scene.meshes["box"] = box((0.3, 0.35, 0.0), (0.25, 0.1, 0.2), "clay", 0.4)
    scene.materials["clay"] = matte(0.5, 0.4, 0.3)
    return scene


def pierced() -> edgegrad.Scene:
    """A sheet through the lamp."""
    scene = floor_under(lamp_ball(), GLOSS)
    scene.meshes["sheet"] = rectangle((0.25, 1.0, -0.2), (0.1, 0.9, 0.05), (0.0, 0.0, 1.5), "black")
    return scene


def pair() -> edgegrad.Scene:
    """A mesh of two balls, one of which hides a part of the other."""
    ball = lamp_ball()
    both = np.concatenate([ball.vertices, 0.7 * ball.vertices + [0.5, 0.1, 0.5]])
    lamp = Mesh(both, np.concatenate([ball.faces, ball.faces + len(ball.vertices)]), ("lamp",))
    return floor_under(lamp, GLOSS)


def reflecting() -> edgegrad.Scene:
    """A lamp that reflects as well, and a wall."""
    scene = floor_under(lamp_ball(), GLOSS)
    scene.materials["lamp"] = edgegrad.Material(np.full(3, 0.7), np.full(3, 6.0), True)
    scene.meshes["wall"] = rectangle((0, 0.8, -1.0), (1.5, 0, 0), (0, 0.8, 0.2), "wall")
    scene.materials["wall"] = matte(0.8, 0.5, 0.3)
    return scene


def smooth() -> edgegrad.Scene:
    """A smooth body of few faces, whose horizons cut off light."""
    scene = floor_under(lamp_ball(), matte(0.3, 0.3, 0.3))
    vertices, faces = shapes.ball(1, 0.6)
    scene.meshes["body"] = Mesh(vertices + [-0.3, 0.3, 0.4], faces, ("body",), smoothing=faces)
    scene.materials["body"] = replace(GLOSS, roughness=0.5)
    return scene


def mirrored() -> edgegrad.Scene:
    """A glossy wall that the camera sees in a mirror, which itself shows the wall nothing of the lamp."""
    scene = floor_under(lamp_ball(), MIRROR)
    scene.meshes["floor"] = rectangle((0, 0, 1.0), (0, 0, 0.4), (1.0, 0, 0), "floor")
    scene.meshes["wall"] = rectangle((0, 2.4, -1.2), (2.5, 0, 0), (0, 0.8, 0.0), "wall")
    scene.materials["wall"] = GLOSS
    return scene


def moves(make: Callable[[], edgegrad.Scene], *names: str, camera_too: bool = False) -> tuple[Make, list[str]]:
    """Each mesh moves, turns and is bent in its own way."""
    def moved(theta: float) -> edgegrad.Scene:
        scene = make()
        for k, name in enumerate(names):
            mesh = scene.meshes[name]
            middle = mesh.vertices.mean(axis=0)
            around = mesh.vertices - middle
            rate = np.array([(0.8, 0.2, 0.3), (-0.4, 0.3, 0.2)][k]) + 0.4 * around[:, [1, 2, 0]] + around**2
            mesh.vertices = mesh.vertices + theta * rate
        if camera_too:
            to_world = np.array(scene.camera.to_world)
            to_world[:3, :3] = turn(0.1 * theta, 0.2 * theta, 0.1 * theta) @ to_world[:3, :3]
            to_world[:3, 3] += theta * np.array([0.5, 0.2, -0.3])
            scene.camera = replace(scene.camera, to_world=to_world)
        return scene

    return moved, [*(f"meshes.{name}.vertices" for name in names), *(["camera.to_world"] if camera_too else [])]


CASES: dict[str, tuple[Make, list[str]]] = {
    "ball over metal": moves(over(GLOSS), "lamp"),
    "ball over a matte floor": moves(over(matte(0.6, 0.7, 0.5)), "lamp"),
    "sheet over metal": moves(over(GLOSS, lamp_sheet), "lamp"),
    "floor moves": moves(over(GLOSS), "floor", "lamp"),
    "camera moves": moves(over(GLOSS), "lamp", camera_too=True),
    "box before the lamp": moves(occluded, "box", "lamp"),
    "sheet through the lamp": moves(pierced, "sheet", "lamp"),
    "two balls": moves(pair, "lamp"),
    "horizons": moves(smooth, "body", "lamp"),
}
DEEP: dict[str, tuple[Make, list[str]]] = {
    "lamp that reflects": moves(reflecting, "lamp"),
    "seen in a mirror": moves(mirrored, "lamp"),
}
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
    """Where a flat emissive sheet has its vertices is its own affair: only its border counts."""
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
