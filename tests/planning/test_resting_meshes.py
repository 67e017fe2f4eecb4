"""Meshes that rest on each other: the plan names those of which one moves, since it may lift off or sink in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from edgegrad import Mesh, PointLight, Renderer, Scene, World, plan
from tests.support.picture_differences import need_every_table
from tests.support.rich_scene import turn
from tests.support.small_scenes import box, camera, matte, rectangle

F64 = NDArray[np.float64]
BOX, FLOOR, POSE = "meshes.box.vertices", "meshes.floor.vertices", "camera.to_world"
DIAGONAL = turn(0.3, 0.2, 0.5)


def placed(mesh: Mesh, turned: F64, shift: Sequence[float] = (0.0, 0.0, 0.0)) -> Mesh:
    return replace(mesh, vertices=mesh.vertices @ turned.T + np.asarray(shift))


def scene_of(meshes: dict[str, Mesh]) -> Scene:
    return Scene(camera((1.2, 1.6, 2.4), (0.0, 0.2, 0.0), 24, 0.9), meshes,
                 {"clay": matte(0.7, 0.3, 0.2), "floor": matte(0.6, 0.6, 0.6)},
                 {"lamp": PointLight(np.array([1.0, 2.5, 1.0]), 100.0, radius=0.3, sphere=True)},
                 World(np.full(3, 0.1)))  # fmt: skip


def floor(height: float = 0.0) -> Mesh:
    return rectangle((0.0, height, 0.0), (0.0, 0.0, 2.0), (2.0, 0.0, 0.0), "floor")


def standing(height: float = 0.0, aside: float = 0.0) -> Mesh:
    return box((aside, 0.3 + height, 0.0), (0.4, 0.3, 0.4), "clay", 0.4)


def blocks(picture: NDArray[np.float32]) -> F64:
    """Sums over blocks of 6 x 6 pixels and colours."""
    return picture.astype(np.float64).reshape(4, 6, 4, 6, 3).sum(axis=(1, 3, 4))


def said(meshes: dict[str, Mesh], *wrt: str) -> str:
    return " ".join(one for one in plan(scene_of(meshes), list(wrt), max_depth=2).missing if "one-sided" in one)


def named(one: Mesh, other: Mesh) -> bool:
    """Whether the two meshes are named, of which the first or the other one moves."""
    meshes = {"box": one, "floor": other}
    words = {said(meshes, BOX), said(meshes, FLOOR)}
    assert words == {""} or all("'box' and 'floor'" in word for word in words)
    return words != {""}


@pytest.mark.parametrize(("height", "rests"), [(0.0, True), (0.1, False)])
def test_the_derivative_by_lifting_a_box_off_its_floor_is_wrong(height: float, rests: bool) -> None:
    """It is neither of the differences on both sides, which the plan says. Above the floor it is both."""
    need_every_table()

    def picture(at: float) -> F64:
        return blocks(Renderer(scene_of({"box": standing(at), "floor": floor()})).render(spp=2048, max_depth=2))

    scene = scene_of({"box": standing(height), "floor": floor()})
    upwards = np.zeros_like(scene.meshes["box"].vertices)
    upwards[:, 1] = 1.0
    found = blocks(Renderer(scene).render_forward({BOX: upwards}, spp=256, max_depth=2))
    step, here = 0.02, picture(height)
    for difference in ((picture(height + step) - here) / step, (here - picture(height - step)) / step):
        error = np.linalg.norm(found - difference) / np.linalg.norm(difference)
        assert error > 2.0 if rests else error < 0.2
    assert bool(said(scene.meshes, BOX)) == rests


def test_a_box_on_a_floor_is_named_if_one_of_them_moves() -> None:
    need_every_table()
    meshes = {"box": standing(), "floor": floor()}
    assert named(*meshes.values())
    assert not said(meshes, BOX, FLOOR) and not said(meshes, POSE) and not said(meshes, BOX, FLOOR, POSE)
    assert not said(meshes, "lights.lamp.position", "materials.clay.base_color")
    assert "'box' and 'floor'" in said(meshes, BOX, POSE)
    # Its faces may look up or down
    assert named(standing(), replace(floor(), faces=floor().faces[:, ::-1].copy()))
    unseen = {**meshes, "floor": replace(floor(), visible_to=frozenset({"camera"}))}
    unseen["box"] = replace(standing(), visible_to=frozenset({"shadow"}))
    assert not said(unseen, BOX)


def test_a_box_that_a_renderer_lifts_is_not_named() -> None:
    need_every_table()
    scene = scene_of({"box": standing(), "floor": floor()})
    renderer = Renderer(scene)
    for height in (0.0, 0.1, 0.0):
        scene.meshes["box"].vertices[:] = standing(height).vertices
        renderer.update([BOX])
        assert any("one-sided" in one for one in plan(renderer, [BOX], max_depth=2).missing) == (height == 0.0)


@pytest.mark.parametrize("turned", [np.eye(3), DIAGONAL])
def test_what_is_apart_or_passes_through_is_not_named(turned: F64) -> None:
    need_every_table()
    for shift in ((0.0, 0.0, 0.0), (30.0, -20.0, 10.0)):
        ground = placed(floor(), turned, shift)
        for height, aside, touches in ((0.0, 0.0, True), (1e-3, 0.0, False), (-1e-3, 0.0, False),
                                       (0.0, 1.9, True), (0.0, 2.6, False)):  # fmt: skip
            assert named(placed(standing(height, aside), turned, shift), ground) == touches


def test_edges_on_faces_are_named_and_corners_are_not() -> None:
    need_every_table()
    for x, z, touches in ((0.5, 0.0, True), (0.5, 0.4, False)):
        about_x = np.array([[1, 0, 0], [0, np.cos(x), -np.sin(x)], [0, np.sin(x), np.cos(x)]])
        about_z = np.array([[np.cos(z), -np.sin(z), 0], [np.sin(z), np.cos(z), 0], [0, 0, 1]])
        mesh = placed(box((0, 0, 0), (0.4, 0.3, 0.4), "clay"), about_z @ about_x)
        mesh.vertices[:, 1] -= mesh.vertices[:, 1].min()
        assert named(mesh, floor()) == touches
    assert not named(standing(-0.3), floor())  # half of it is below
    # A sheet that lies on the floor, with its face down or up, and one above it
    for half_u, half_v in (((0.0, 0.0, 0.3), (0.3, 0.0, 0.0)), ((0.3, 0.0, 0.0), (0.0, 0.0, 0.3))):
        for height, touches in ((0.0, True), (0.01, False)):
            assert named(rectangle((0.2, height, 0.1), half_u, half_v, "clay"), floor()) == touches
    # A sheet that stands on the line between the two triangles of the floor, or reaches below it
    for low, touches in ((0.0, True), (-0.2, False)):
        sheet = rectangle((0.0, 0.5 * (1.0 + low), 0.0), (0.7, 0.0, 0.7), (0.0, 0.5 * (1.0 - low), 0.0), "clay")
        assert named(sheet, floor()) == touches
    # Edges of its own just at the floor's height
    corners = np.array([[x, y, x] for x in (-0.7, 0.0, 0.7) for y in (-0.5, 0.0, 0.5)])
    quads = np.array([[3 * k + j, 3 * k + 3 + j, 3 * k + 4 + j, 3 * k + 1 + j] for k in (0, 1) for j in (0, 1)])
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]).astype(np.int32)
    assert not named(Mesh(corners, faces, ("clay",)), floor())


def instances(*heights: float) -> F64:
    out = np.tile(np.eye(4), (len(heights), 1, 1))
    out[:, 1, 3], out[:, 0, 3] = heights, np.linspace(-0.8, 0.8, len(heights))
    return out


def test_instances_are_named() -> None:
    need_every_table()
    both = "'box' and 'floor'"
    low, high = (replace(standing(), instances=instances(*heights)) for heights in ((0.3, 0.0), (0.3, 0.1)))
    for wrt in (BOX, FLOOR, "meshes.box.instances"):
        assert both in said({"box": low, "floor": floor()}, wrt)
        assert not said({"box": high, "floor": floor()}, wrt)
    assert not said({"box": low, "floor": floor()}, "meshes.box.instances", FLOOR)
    # One mesh's instances on another mesh's, of which one moves
    stack = {
        "box": replace(standing(), instances=instances(0.6)),
        "floor": replace(standing(), instances=instances(0.0)),
    }
    assert both in said(stack, "meshes.box.instances") and both in said(stack, FLOOR)
    assert not said(stack, "meshes.box.instances", "meshes.floor.instances")


# ---------------------------------------------------------------- against all pairs
def cells(low: NDArray[np.int64], high: NDArray[np.int64], parts: bool) -> Mesh:
    """A box, its sides in squares of size 1 if in `parts`."""
    points, faces = [], []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for side in (low, high):
            ends = [[low[k], high[k]] if not parts else list(range(low[k], high[k] + 1)) for k in (u, v)]
            for a0, a1 in zip(ends[0], ends[0][1:], strict=False):
                for b0, b1 in zip(ends[1], ends[1][1:], strict=False):
                    first = len(points)
                    for a, b in ((a0, b0), (a1, b0), (a1, b1), (a0, b1)):
                        point = np.zeros(3)
                        point[[axis, u, v]] = side[axis], a, b
                        points.append(point)
                    faces += [[first, first + 1, first + 2], [first, first + 2, first + 3]]
    return Mesh(np.array(points), np.array(faces, np.int32), ("clay",))


def touch(low: NDArray[np.int64], high: NDArray[np.int64], a: int, b: int) -> bool:
    """Whether sides of two boxes are in one plane and share more than a point."""
    shared = np.minimum(high[a], high[b]) - np.maximum(low[a], low[b])
    planes = [{low[a, k], high[a, k]} & {low[b, k], high[b, k]} for k in range(3)]
    rest = [np.delete(shared, k) for k in range(3)]
    return any(planes[k] and rest[k].min() >= 0 and rest[k].max() > 0 for k in range(3))


@pytest.mark.parametrize("kind", ["boxes", "in parts", "instances"])
def test_pairs_are_those_of_all_boxes(kind: str) -> None:
    """Boxes with whole coordinates, many of which pass through each other."""
    need_every_table()
    rng = np.random.default_rng(3)
    count = 24
    low = rng.integers(0, 9, (count, 3))
    high = low + rng.integers(1, 4, (count, 3))
    to_world = np.eye(4)
    to_world[:3, :3], to_world[:3, 3] = 0.3 * DIAGONAL, (0.4, -0.2, 0.1)
    meshes = {}
    for k in range(count):
        if kind == "instances":
            scaled = np.eye(4)
            scaled[:3, :3], scaled[:3, 3] = np.diag(high[k] - low[k]), low[k]
            one = cells(np.zeros(3, int), np.ones(3, int), False)
            meshes[f"box {k}"] = replace(one, instances=(to_world @ scaled)[None])
        else:
            meshes[f"box {k}"] = placed(cells(low[k], high[k], kind == "in parts"), to_world[:3, :3], to_world[:3, 3])
    moving = rng.permutation(count)[: count // 2]
    paths = [f"meshes.box {k}.{'instances' if kind == 'instances' else 'vertices'}" for k in moving]
    decided = {d.part: d for d in plan(scene_of(meshes), paths, max_depth=2).decisions}["parting meshes"]
    moves = np.isin(np.arange(count), moving)
    pairs = {(a, b) for b in range(count) for a in range(b) if moves[a] != moves[b] and touch(low, high, a, b)}
    assert len(pairs) > 10
    assert set(map(tuple, decided.pairs)) == pairs
