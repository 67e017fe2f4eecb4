"""Meshes that certainly do not intersect themselves, since one point sees all of their faces from inside."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import edgegrad
from tests.support import shapes
from tests.support.small_scenes import camera


def ball(cuts: int = 3) -> edgegrad.Mesh:
    vertices, faces = shapes.ball(cuts, 0.5)
    return edgegrad.Mesh(vertices + [0.3, -2.0, 1.0], faces, ("warm",))


def bumpy(cuts: int = 3) -> edgegrad.Mesh:
    """Dents that hide parts of it from outside."""
    mesh = ball(cuts)
    middle = mesh.vertices.mean(axis=0)
    way = mesh.vertices - middle
    mesh.vertices = middle + way * (1.0 + 0.3 * np.sin(9.0 * way[:, :1]) * np.cos(7.0 * way[:, 1:2]))
    return mesh


def inside_out(cuts: int = 3) -> edgegrad.Mesh:
    mesh = bumpy(cuts)
    mesh.faces = mesh.faces[:, ::-1]
    return mesh


def split(cuts: int = 3) -> edgegrad.Mesh:
    """Every face has vertices of its own."""
    mesh = bumpy(cuts)
    corners = mesh.vertices[mesh.faces].reshape(-1, 3)
    return edgegrad.Mesh(corners, np.arange(len(corners), dtype=np.int32).reshape(-1, 3), ("warm",))


def opened(cuts: int = 3) -> edgegrad.Mesh:
    """A face is missing, so that the mesh encloses no volume."""
    mesh = bumpy(cuts)
    mesh.faces = mesh.faces[1:]
    return mesh


def pulled_through(cuts: int = 3) -> edgegrad.Mesh:
    """A vertex is on the far side of the body."""
    mesh = ball(cuts)
    middle = mesh.vertices.mean(axis=0)
    mesh.vertices[0] = middle - 1.2 * (mesh.vertices[0] - middle)
    return mesh


def two(cuts: int = 3) -> edgegrad.Mesh:
    """One in the other: all faces are seen from behind, but two in every direction."""
    mesh = ball(cuts)
    middle = mesh.vertices.mean(axis=0)
    stretched = middle + (mesh.vertices - middle) * [1.3, 0.8, 0.8]
    faces = np.concatenate([mesh.faces, mesh.faces + len(mesh.vertices)])
    return edgegrad.Mesh(np.concatenate([mesh.vertices, stretched]), faces, ("warm",))


def hollow(cuts: int = 3) -> edgegrad.Mesh:
    """The same, the second inside out: its faces are seen from the front."""
    mesh = two(cuts)
    half = len(mesh.faces) // 2
    mesh.faces = np.concatenate([mesh.faces[:half], mesh.faces[half:, ::-1]])
    return mesh


def ring(cuts: int = 3) -> edgegrad.Mesh:
    n = 8 * 2**cuts
    u, v = (2.0 * np.pi * x.ravel() / n for x in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    vertices = np.stack([(1.0 + 0.3 * np.cos(v)) * np.cos(u), (1.0 + 0.3 * np.cos(v)) * np.sin(u), 0.3 * np.sin(v)], 1)
    i, j = (x.ravel() for x in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    at = [i * n + j, (i + 1) % n * n + j, (i + 1) % n * n + (j + 1) % n, i * n + (j + 1) % n]
    faces = np.concatenate([np.stack([at[0], at[1], at[2]], 1), np.stack([at[0], at[2], at[3]], 1)])
    return edgegrad.Mesh(vertices, faces.astype(np.int32), ("warm",))


STAR_SHAPED: list[Callable[[int], edgegrad.Mesh]] = [ball, bumpy, inside_out, split]
OTHERS: list[Callable[[int], edgegrad.Mesh]] = [opened, pulled_through, two, hollow, ring]


@pytest.mark.parametrize(("make", "left_out"), [*((make, False) for make in STAR_SHAPED),
                                               *((make, True) for make in OTHERS)])  # fmt: skip
def test_plan_names_large_meshes_that_may_pass_through_themselves(
    make: Callable[[int], edgegrad.Mesh], left_out: bool
) -> None:
    """Bodies that are seen whole from their middle, which need not be convex, don't."""
    body = make(5 if make is ring else 7)
    world = edgegrad.World(np.ones(3))
    scene = edgegrad.Scene(camera(), {"body": body}, {"warm": edgegrad.Material(np.full(3, 0.5))}, world=world)
    assert len(scene.meshes["body"].faces) > 50_000
    made = edgegrad.plan(scene, ["meshes.body.vertices"], max_depth=2)
    assert any("pass through themselves" in words for words in made.missing) == left_out
