"""Meshes with a terminator offset are lit by their smooth normals, from below the planes of their faces, too."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from edgegrad import Mesh, PointLight, Renderer, Scene, SunLight, plan
from tests.support.picture_differences import check_agreement, check_transpose, need_every_table
from tests.support.rich_scene import pose, turn
from tests.support.scenes.horizons import CASES, SIDE, body, body_under, light_changes
from tests.support.small_scenes import Floats, Make, along, camera, matte, rectangle

ALBEDO, IRRADIANCE = 0.6, 3.0


def leaning_face(light: Floats, offset: float) -> Scene:
    """A triangle in the plane z = 0 whose normals all lean towards +x, under a sun without size."""
    lean = np.array([np.sin(0.6), 0.0, np.cos(0.6)])
    mesh = Mesh(np.array([[-3.0, -3, 0], [3, -3, 0], [0, 4, 0]]), np.array([[0, 1, 2]], np.int32), ("clay",),
                smoothing=np.array([[0, 1, 2]], np.int32), normals=np.tile(lean, (3, 1)),
                terminator_offset=offset)  # fmt: skip
    scene = Scene(camera(size=8), {"face": mesh}, {"clay": matte(ALBEDO, ALBEDO, ALBEDO)})
    scene.lights["sun"] = SunLight(-light, IRRADIANCE, 0.0)
    scene.world.color = np.zeros(3)
    return scene


def test_light_from_below_counts_by_the_smooth_normal() -> None:
    """A face of a parallel bundle of normals has the radiance albedo/pi E cos, however its own plane lies."""
    below = np.array([np.cos(0.2), 0.0, -np.sin(0.2)])
    expected = ALBEDO / np.pi * IRRADIANCE * (np.sin(0.6) * np.cos(0.2) - np.cos(0.6) * np.sin(0.2))
    lit = Renderer(leaning_face(below, 0.1)).render(spp=4, seed=1, max_depth=2)
    assert np.asarray(lit[4, 4]) == pytest.approx(expected, rel=1e-4)
    assert not np.any(Renderer(leaning_face(below, 0.0)).render(spp=4, seed=1, max_depth=2))


def test_light_behind_the_smooth_normal_does_not_count() -> None:
    behind = np.array([-np.cos(0.9), 0.0, -np.sin(0.9)])
    assert not np.any(Renderer(leaning_face(behind, 0.1)).render(spp=4, seed=1, max_depth=2))


@pytest.mark.parametrize(("low", "shadowed"), [(0.6, True), (1.5, False)])
def test_rays_start_where_those_of_cycles_do(low: float, shadowed: bool) -> None:
    """A wall above the face meets rays that start at the height sin(0.6) * 3, along the normal, of the middle.

    That is how far the face's last corner lies above the middle along the common normal, as Cycles' pictures show.
    """
    below = np.array([np.cos(0.2), 0.0, -np.sin(0.2)])
    scene = leaning_face(below, 0.1)
    scene.meshes["wall"] = rectangle((1.5, 0.0, low + 0.45), (0.0, 2.0, 0.0), (0.0, 0.0, 0.45), "black")
    scene.materials["black"] = matte(0.0, 0.0, 0.0)
    lit = Renderer(scene).render(spp=4, seed=1, max_depth=2)[4, 4]
    assert np.all(np.asarray(lit) == 0.0) == shadowed


def test_instances_are_lit_like_meshes() -> None:
    """A mesh that instances place and mirror has the picture of one whose vertices are moved."""
    placed, moved = body_under("sun"), body_under("sun")
    for scene in (placed, moved):
        scene.lights["sun"] = SunLight(np.array([-1.0, -0.3, -0.1]), 3.0, 0.0)
        scene.meshes["body"].terminator_offset = 0.3
    where = pose(turn(0.2, 0.5, 0.1) @ np.diag([-0.8, 0.8, 0.8]), 0.2, 0.1, 0.0)
    placed.meshes["body"].instances = where[None]
    mesh = moved.meshes["body"]
    mesh.vertices = mesh.vertices @ where[:3, :3].T + where[:3, 3]
    mesh.faces = mesh.smoothing = np.ascontiguousarray(mesh.faces[:, ::-1])
    ours, theirs = (Renderer(scene).render(spp=64, seed=1, max_depth=2) for scene in (placed, moved))
    lifted = np.abs(ours.astype(np.float64) - theirs).mean()
    assert lifted < 0.002 * theirs.mean()
    placed.meshes["body"].terminator_offset = 0.0
    flat = np.abs(Renderer(placed).render(spp=64, seed=1, max_depth=2).astype(np.float64) - theirs).mean()
    assert flat > 2.0 * lifted


def with_offset(make: Make) -> Make:
    def lifted(theta: float) -> Scene:
        scene = make(theta)
        scene.meshes["body"] = replace(scene.meshes["body"], terminator_offset=0.1)
        return scene

    return lifted


def point_moves(theta: float) -> Scene:
    """A light without size: faces that are lit by their normals alone have no jump as it passes their planes."""
    scene = body_under("disk")
    scene.lights["lamp"] = PointLight(SIDE + theta * np.array([1.0, -0.4, 0.3]), 90.0)
    return scene


MOVING: dict[str, tuple[Callable[[float], Scene], list[str]]] = {
    **{name: CASES[name] for name in ("rectangle: body moves", "disk: light moves", "sun: light turns",
                                      "sky image: light turns", "mesh: body moves")},
    "point: light moves": (point_moves, ["lights.lamp.position"]),
    "sphere: light grows": light_changes("sphere", radius=0.6),
}  # fmt: skip


@pytest.mark.parametrize("name", MOVING)
def test_derivatives_agree_with_central_differences(name: str) -> None:
    need_every_table()
    make, paths = MOVING[name]
    check_agreement(along(with_offset(make), paths))


@pytest.mark.parametrize("name", ["rectangle: body moves", "point: light moves", "sky image: light turns"])
def test_reverse_mode_is_the_transpose(name: str) -> None:
    need_every_table()
    make, paths = MOVING[name]
    check_transpose(with_offset(make), paths, spp=32, max_depth=4)


def test_the_plan_names_shadows_that_are_not_sampled() -> None:
    def words(offset: float) -> str:
        scene = body_under("disk")
        scene.lights["lamp"] = PointLight(SIDE, 90.0)
        scene.meshes["body"] = replace(body(), terminator_offset=offset)
        return "; ".join(plan(scene, ["lights.lamp.position"], max_depth=2).missing)

    assert "shadows on body, where a light lies below" in words(0.1) and "passes the plane" not in words(0.1)
    assert "lies below" not in words(0.0) and "passes the plane" in words(0.0)
