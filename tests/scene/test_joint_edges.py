"""Edges of several meshes in one place: derivatives are those of the same bodies in one mesh."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import edgegrad
from edgegrad import Mesh, Renderer, Scene, _native
from edgegrad.geometry import joint_edges, points_on_edges, topology
from edgegrad.rendering.scene_edges import SceneEdges
from edgegrad.scene import parameters
from edgegrad.tables import tables as flat
from tests.support import block_statistics
from tests.support.picture_differences import check_agreement, need_every_table
from tests.support.rich_scene import turn
from tests.support.scenes.bodies_apart import (
    brick_wall,
    bricks,
    cube_above_a_floor,
    divided,
    in_pieces,
    joined_meshes,
    room,
)
from tests.support.small_scenes import box

F64 = NDArray[np.float64]
SHIFT = np.array([0.5, 0.2, -0.3])


def shifts(scene: Scene, *still: str) -> dict[str, F64]:
    """The motion of all meshes but some."""
    return {f"meshes.{name}.vertices": np.broadcast_to(SHIFT, mesh.vertices.shape).copy()
            for name, mesh in scene.meshes.items() if name not in still}


def shifted_camera(scene: Scene) -> dict[str, F64]:
    tangent = np.zeros((4, 4))
    tangent[:3, 3] = SHIFT
    return {"camera.to_world": tangent}


def sums(scene: Scene, rates: Mapping[str, F64], first: int) -> F64:
    renderer = Renderer(scene)
    return np.array([block_statistics.block_sums(renderer.render_forward(
        rates, spp=64, max_depth=3, seed=seed), 6).sum(axis=-1).ravel() for seed in range(first, first + 16)])


@pytest.mark.parametrize("junctions", [False, True])
@pytest.mark.parametrize("moving", ["all pieces", "camera"])
@pytest.mark.parametrize("light", ["sphere", "point", "sky", "mirror"])
def test_a_cube_of_six_meshes(light: str, moving: str, junctions: bool) -> None:
    """With junctions, borders of some pieces are divided where those of others are not."""
    need_every_table()
    whole, apart = cube_above_a_floor(light), cube_above_a_floor(light)
    apart = in_pieces(divided(apart, closed=False) if junctions else apart, "cube")
    rates = [shifted_camera(one) if moving == "camera" else shifts(one, "floor") for one in (whole, apart)]
    block_statistics.check(block_statistics.means_p_value(sums(whole, rates[0], 0), sums(apart, rates[1], 100)))


@pytest.mark.parametrize("moving", ["all pieces", "camera"])
def test_a_room_of_five_walls(moving: str) -> None:
    need_every_table()
    whole, apart = room(False), room(True)
    rates = [shifted_camera(one) if moving == "camera" else shifts(one) for one in (whole, apart)]
    block_statistics.check(block_statistics.means_p_value(sums(whole, rates[0], 0), sums(apart, rates[1], 100)))


@pytest.mark.parametrize("apart", [True, False])
@pytest.mark.parametrize(("light", "moving"), [("sphere", "bricks"), ("sky", "camera")])
def test_a_wall_of_bricks_agrees_with_differences(light: str, moving: str, apart: bool) -> None:
    """The edges of bricks end in the middle of those above and below."""
    need_every_table()

    def at(theta: float) -> tuple[Scene, Mapping[str, F64]]:
        scene = brick_wall(apart, light)
        rates = shifted_camera(scene) if moving == "camera" else shifts(scene, "floor")
        for path, rate in rates.items():
            parameters.put(scene, path, parameters.get(scene, path) + theta * rate)
        return scene, rates

    check_agreement(at, max_depth=3, reference_spp=256)


@pytest.mark.parametrize("apart", [True, False])
def test_edges_are_divided_where_others_end(apart: bool) -> None:
    """Of a box and one above it: shifted along its edges, with one side in a plane, and smaller."""
    turned = turn(0.3, 0.2, 0.5)
    for low, high, places, more in (((0.4, 1.4), (0.3, 0.3), 2, 4), ((0.2, 0.8), (0.3, 0.1), 1, 2),
                                    ((0.2, 0.8), (0.2, 0.2), 0, 0)):  # fmt: skip
        parts = []
        for x, y, z in (((0.0, 1.0), (0.0, 0.4), (-0.3, 0.3)), (low, (0.4, 0.8), (-high[1], high[0]))):
            ends = np.array([x, y, z])
            one = box(ends.mean(axis=1), 0.5 * (ends[:, 1] - ends[:, 0]), "a")
            parts.append(Mesh(one.vertices @ turned.T, one.faces, one.materials))
        meshes = {"low": parts[0], "high": parts[1]} if apart else {"both": joined_meshes(parts)}
        scene = replace(brick_wall(True, "sky"), meshes=meshes)
        edges = SceneEdges(flat.flatten(scene)).for_moving([])
        faces = np.diff(edges.face_first.astype(int))
        # Where edges lie on each other, they have the faces of both; in one mesh they are one edge
        assert (faces == 4).sum() == places * (2 if apart else 1)
        assert len(edges) == 36 + more - (0 if apart else places)


def test_the_plan_names_meshes_that_part() -> None:
    """Those whose edges lie on each other, where one moves against the other."""
    need_every_table()
    scene = brick_wall(True, "sphere")
    names = [name for name in scene.meshes if name != "floor"]

    def named(*paths: str) -> str:
        return " ".join(one for one in edgegrad.plan(scene, list(paths), max_depth=2).missing if "one-sided" in one)

    corner = named("meshes.brick 0.vertices")
    assert "'brick 0' and 'brick 1'" in corner and "'brick 0' and 'brick 3'" in corner
    assert "'brick 2'" not in corner and "floor" not in corner
    assert not named(*(f"meshes.{name}.vertices" for name in names))
    assert not named("camera.to_world") and not named("meshes.floor.vertices")


def test_points_in_cells_are_those_of_all_pairs(monkeypatch: pytest.MonkeyPatch) -> None:
    wall = joined_meshes(bricks(12, 9, turn(0.3, 0.2, 0.5)))
    ends = wall.vertices.reshape(-1, 8, 3)[:, [[0, 1], [0, 2], [0, 4], [1, 3], [1, 5], [2, 3], [2, 6], [4, 5], [4, 6]]]
    assert ends.shape[1:] == (9, 2, 3)
    vertices = ends.reshape(-1, 3)
    pairs, number = np.arange(len(vertices)).reshape(-1, 2), np.arange(len(vertices))
    body = number[: len(pairs)] // 9
    found = []
    for most in (0, 1 << 40):
        monkeypatch.setattr(points_on_edges, "ALL_PAIRS", most)
        found.append(points_on_edges.points_on_edges(vertices, pairs, number, body, np.zeros_like(body), 1e-6))
    one, other = (set(zip(*map(np.ndarray.tolist, some), strict=True)) for some in found)
    assert one == other and len(one) > 100


def test_edges_are_joined_where_meshes_move_alike() -> None:
    scene = in_pieces(cube_above_a_floor("sky"), "cube")
    found = SceneEdges(flat.flatten(scene))
    own = found.for_moving([1])  # one piece; the floor is number 0
    alike = found.for_moving(range(1, 7))
    assert len(alike) == len(own) == 35  # of 6 pieces, 5 each, and of the floor
    assert sorted(np.diff(alike.face_first.astype(int)).tolist()) == 4 * [1] + 31 * [2]
    assert sorted(alike.sharing.tolist()) == 11 * [1] + 24 * [2]
    # The four borders of the piece that moves by itself, and those of the others beside it, stay borders
    assert (np.diff(own.face_first.astype(int)) == 1).sum() == 4 + 8
    # The faces of their own mesh come first
    starts = alike.face_first[:-1]
    np.testing.assert_array_equal(alike.faces[starts], found.for_moving([1]).faces[own.face_first[:-1]])


@pytest.mark.parametrize("how", ["linked lights", "visibility"])
def test_meshes_that_differ_in_light_are_not_joined(how: str) -> None:
    scene = in_pieces(cube_above_a_floor("point"), "cube")
    if how == "visibility":
        scene.meshes["0"] = replace(scene.meshes["0"], visible_to=frozenset({"camera", "diffuse", "glossy"}))
    else:
        scene.lights["lamp"] = replace(scene.lights["lamp"], receivers=("0", "floor"))
    found = SceneEdges(flat.flatten(scene)).for_moving([])
    assert sorted(found.sharing.tolist()) == (11 + 8) * [1] + 16 * [2]


def test_divided_borders_are_joined() -> None:
    scene = in_pieces(divided(cube_above_a_floor("sky"), closed=False), "cube")
    alike = SceneEdges(flat.flatten(scene)).for_moving(range(1, 7))
    assert (np.diff(alike.face_first.astype(int)) == 1).sum() == 4  # of the floor
    assert set(alike.sharing.tolist()) == {1, 2}


@pytest.mark.parametrize("first", ["meshes.0.vertices", "camera.to_world"])
def test_the_edges_are_those_of_the_request_whatever_came_before(first: str) -> None:
    """Also after vertices have moved."""
    scene = in_pieces(cube_above_a_floor("sky"), "cube")
    adjoint, path = np.ones((24, 24, 3)), "meshes.0.vertices"
    renderer = Renderer(scene)
    renderer.render_backward(adjoint, [first], spp=1)
    scene.meshes["0"] = replace(scene.meshes["0"], vertices=scene.meshes["0"].vertices + [0.0, 0.3, 0.0])
    renderer.update([path])
    for wrt in ([path], ["camera.to_world"], [f"meshes.{k}.vertices" for k in range(6)]):
        found = renderer.render_backward(adjoint, wrt, spp=4)
        fresh = Renderer(scene).render_backward(adjoint, wrt, spp=4)
        for one in wrt:
            np.testing.assert_array_equal(found[one], fresh[one])


def test_pieces_that_move_apart_have_borders_again() -> None:
    scene = in_pieces(cube_above_a_floor("sky"), "cube")
    path, adjoint = "meshes.0.vertices", np.ones((24, 24, 3))
    paths = [f"meshes.{k}.vertices" for k in range(6)]
    renderer = Renderer(scene)
    joined = renderer.render_backward(adjoint, paths, spp=4)
    scene.meshes["0"] = replace(scene.meshes["0"], vertices=scene.meshes["0"].vertices + [0.0, 0.3, 0.0])
    renderer.update([path])
    apart = renderer.render_backward(adjoint, paths, spp=4)
    fresh = Renderer(scene).render_backward(adjoint, paths, spp=4)
    for one in paths:
        np.testing.assert_array_equal(apart[one], fresh[one])
    assert not np.array_equal(apart[path], joined[path])


def test_modes_are_transposes() -> None:
    need_every_table()
    scene = in_pieces(cube_above_a_floor("sphere"), "cube")
    rates = shifts(scene, "floor")
    renderer = Renderer(scene)
    weights = np.random.default_rng(0).normal(size=(24, 24, 3))
    forward = renderer.render_forward(rates, spp=8, max_depth=3, seed=1).astype(np.float64)
    reverse = renderer.render_backward(weights, list(rates), spp=8, max_depth=3, seed=1)
    by_reverse = sum(float(np.sum(reverse[path] * rate)) for path, rate in rates.items())
    assert float(np.sum(forward * weights)) == pytest.approx(by_reverse, rel=1e-4)


@pytest.mark.parametrize("most", [0, 3, 1000])
def test_boxes_that_overlap_few_others_are_those_of_a_comparison_of_all(most: int) -> None:
    rng = np.random.default_rng(5)
    low = rng.random((300, 3)).astype(np.float32)
    high = low + (0.3 * rng.random((300, 3)) ** 3).astype(np.float32)
    high[:5] = low[:5]  # points
    meets = ((low[:, None] <= high) & (high[:, None] >= low)).all(axis=-1) & ~np.eye(300, dtype=bool)
    count, pairs = _native.overlapping_boxes(low, high, most)
    np.testing.assert_array_equal(count, np.minimum(meets.sum(axis=1), most + 1))
    np.testing.assert_array_equal(pairs, np.argwhere(meets & (count <= most)[:, None]))


def test_points_at_the_ends_of_edges_do_not_divide_them() -> None:
    """Points are on two edges, but by rounding just beyond their ends."""
    vertices = np.array([[0, 0, 0], [0, 1, 0], [1, 0, 0], [0, -1e-9, 0], [-1e-9, 0, 0]], np.float32)
    triangle = topology.edges(np.array([[0, 1, 2]], np.int32), np.arange(5), vertices)
    rows = np.flatnonzero((triangle.vertices == 0).any(axis=1))
    label = np.array([-1, 3, 4, 1, 2])
    edges, row, on_line = joint_edges._divided(triangle, vertices, label, np.array([3, 4]), rows)
    assert row.tolist() == [0, 1, 2] and len(on_line) == 0
    assert {tuple(sorted(pair)) for pair in edges.vertices.tolist()} == {(0, 1), (0, 2), (1, 2)}
