"""T-junctions, open or closed by triangles whose corners lie on one line: the faces on both sides meet directly."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from edgegrad import Renderer, Scene
from edgegrad.geometry import topology
from tests.support import block_statistics, shapes
from tests.support.picture_differences import need_every_table
from tests.support.rich_scene import turn
from tests.support.scenes.bodies_apart import cube_above_a_floor, divided, with_junctions

F64 = NDArray[np.float64]
Faces = NDArray[np.int32]


def pieces_of(vertices: F64, faces: Faces) -> dict[tuple[float, ...], list[int]]:
    """The faces of each edge, by the edge's middle and its length."""
    found = topology.edges(faces, topology.weld(vertices), vertices)
    ends = vertices[found.vertices]
    middle, size = ends.mean(axis=1), np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    return {(*np.round(m, 6), round(s, 6)): sorted(found.faces[a:b].tolist())
            for m, s, a, b in zip(middle, size, found.face_first[:-1], found.face_first[1:], strict=True)}


def test_faces_beside_a_junction_meet_along_its_parts() -> None:
    """0 - 4 - 1 is a side of face 0, and its parts are sides of faces 1 and 2; face 3 closes the junction."""
    vertices = np.array([[0.0, 0, 0], [4, 0, 0], [2, -1, 0], [2, 1, 0], [1, 0, 0]])
    faces = np.array([[0, 1, 2], [0, 3, 4], [4, 3, 1], [1, 0, 4]], np.int32)
    found = pieces_of(vertices, faces)
    assert found[(0.5, 0.0, 0.0, 1.0)] == [0, 1] and found[(2.5, 0.0, 0.0, 3.0)] == [0, 2]
    assert len(found) == 7 and not any(3 in beside for beside in found.values())


def test_junctions_on_both_sides_divide_the_line_at_all_of_its_points() -> None:
    """The points at 1 and 2.5 are corners of faces on different sides; three triangles without area lie between."""
    vertices = np.array([[0.0, 0, 0], [4, 0, 0], [2, -1, 0], [2, 1, 0], [1, 0, 0], [2.5, 0, 0]])
    faces = np.array([[0, 5, 2], [5, 1, 2], [3, 4, 0], [1, 4, 3], [0, 4, 5], [5, 4, 1]], np.int32)
    found = pieces_of(vertices, faces)
    assert [found[(*middle, 0.0, 0.0, size)] for middle, size in (((0.5,), 1.0), ((1.75,), 1.5), ((3.25,), 1.5))] == [
        [0, 2], [0, 3], [1, 3]]
    assert not any({4, 5} & set(beside) for beside in found.values())


@pytest.mark.parametrize("closed", [True, False])
@pytest.mark.parametrize("shape", ["cube", "ball"])
def test_a_surface_has_no_borders(shape: str, closed: bool) -> None:
    vertices, faces = shapes.cube() if shape == "cube" else shapes.ball(2)
    vertices = vertices @ turn(0.3, 0.2, 0.5).T
    points, joined = with_junctions(vertices, faces, closed)
    added = len(points) - len(vertices)
    found = topology.edges(joined, topology.weld(points), points)
    assert len(found.collinear if closed else found.junctions) == added > 9
    assert (np.diff(found.face_first.astype(int)) == 2).all()
    assert len(found) == 3 * len(faces) // 2 + 2 * added  # each point divides an edge and a face


def test_thin_triangles_with_an_area_count() -> None:
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0.5, 1e-5, 0]])
    assert len(topology.edges(np.array([[0, 1, 2]], np.int32), topology.weld(vertices), vertices)) == 3


@pytest.mark.parametrize("closed", [True, False])
@pytest.mark.parametrize("light", ["sphere", "point", "sky", "mirror"])
def test_derivatives_are_those_of_the_same_body_without_them(light: str, closed: bool) -> None:
    need_every_table()

    def sums(made: Scene, first: int) -> F64:
        renderer = Renderer(made)
        rates = np.broadcast_to([0.5, 0.2, -0.3], made.meshes["cube"].vertices.shape).copy()
        return np.array([block_statistics.block_sums(renderer.render_forward(
            {"meshes.cube.vertices": rates}, spp=64, max_depth=3, seed=seed), 6).sum(axis=-1).ravel()
            for seed in range(first, first + 16)])  # fmt: skip

    whole, apart = cube_above_a_floor(light), divided(cube_above_a_floor(light), closed)
    block_statistics.check(block_statistics.means_p_value(sums(whole, 0), sums(apart, 100)))


@pytest.mark.parametrize("closed", [True, False])
def test_a_junction_that_opens_gets_its_edges(closed: bool) -> None:
    made = divided(cube_above_a_floor("sky"), closed)
    renderer = Renderer(made)
    path, adjoint = "meshes.cube.vertices", np.ones((24, 24, 3))
    renderer.render_backward(adjoint, [path], spp=1)
    mesh = made.meshes["cube"]
    moved = mesh.vertices.copy()
    moved[8] += [0.0, 0.1, 0.1]  # the first point on a divided side
    made.meshes["cube"] = replace(mesh, vertices=moved)
    renderer.update([path])
    again = renderer.render_backward(adjoint, [path], spp=4)[path]
    fresh = Renderer(made).render_backward(adjoint, [path], spp=4)[path]
    np.testing.assert_array_equal(again, fresh)


def test_a_border_that_goes_on_straight_is_none() -> None:
    """The sides of a sheet of many faces lie on lines, but no face's side is divided."""
    vertices, faces = shapes.sheet(9)
    assert len(topology.edges(faces, topology.weld(vertices), vertices).junctions) == 0
