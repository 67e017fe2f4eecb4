"""What is computed natively, or in large steps, of large meshes."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from edgegrad import _native
from edgegrad.scene.placement import placed_tangents


@pytest.mark.parametrize("swapped", [False, True])
def test_weights_by_angles_do_not_depend_on_the_triangulation(swapped: bool) -> None:
    """At the corners of a cube, three right angles meet, however each side is divided."""
    vertices = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    turn = 1 if swapped else 0
    faces = np.array([[q[k % 4] for k in corners] for q in quads
                      for corners in ((turn, turn + 1, turn + 2), (turn, turn + 2, turn + 3))], np.int32)  # fmt: skip
    normals = _native.angle_weighted_normals(vertices, faces, faces, 8)
    assert np.allclose(normals, vertices / np.sqrt(3.0), rtol=0.0, atol=1e-12)
    flat = faces.copy()
    flat[:2] = -1
    assert not np.allclose(_native.angle_weighted_normals(vertices, faces, flat, 8), normals)
    with pytest.raises(ValueError, match="'smoothing' names a normal that is not there"):
        _native.angle_weighted_normals(vertices, faces, faces, 7)


def test_tangents_of_a_map_that_closes() -> None:
    """Around a prism, u runs from 0 to 1, and from the last side back to the first one."""
    sides = 6
    angle = 2.0 * np.pi * np.arange(sides) / sides
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    vertices = np.concatenate([np.insert(ring, 2, z, axis=1) for z in (0.0, 1.0)]).astype(np.float32)
    k, after = np.arange(sides), (np.arange(sides) + 1) % sides
    faces = np.concatenate([np.stack([k, after, after + sides], 1), np.stack([k, after + sides, k + sides], 1)])
    uv = np.stack([angle / (2.0 * np.pi), np.zeros(sides)], axis=1)
    uv = np.concatenate([uv, uv + (0.0, 1.0)])[faces].astype(np.float32)
    smoothing = np.full((2 * sides, 3), -1, np.int32)
    flat = np.empty((0, 3), np.float32)
    found = _native.corner_tangents(vertices, faces.astype(np.int32), uv, smoothing, flat, True, 2)
    along = vertices[after] - vertices[k]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    assert np.allclose(found[..., :3], np.tile(along, (2, 1))[:, None], rtol=0.0, atol=1e-6)
    assert (found[..., 3] == 1.0).all()
    with pytest.raises(ValueError, match="'uv' has the wrong shape"):
        _native.corner_tangents(vertices, faces.astype(np.int32), uv[1:], smoothing, flat, True, 2)


def test_tangents_where_a_map_has_no_area() -> None:
    """As MikkTSpace has them: the X axis, and a negative sign; corners that a mapped face shares have its tangent."""
    vertices = np.float32([(0, 0, 0), (0, 1, 0), (0, 0, 1), (0, -1, 0), (3, 0, 0), (3, 1, 0), (3, 0, 1)])
    faces = np.int32([(0, 1, 2), (0, 2, 3), (4, 5, 6)])
    uv = np.float32([[(0, 0), (1, 0), (0, 1)], [(0, 0), (0, 1), (0, 1)], [(0.5, 0.5)] * 3])
    normals = np.float32([(1, 0, 0)])
    found = _native.corner_tangents(vertices, faces, uv, np.zeros_like(faces), normals, False, 1)
    mapped, none = (0.0, 1.0, 0.0, 1.0), (1.0, 0.0, 0.0, -1.0)
    assert np.allclose(found, [[mapped] * 3, [mapped, mapped, none], [none] * 3], rtol=0.0, atol=1e-6)


def test_smooth_corners_share_a_tangent_of_any_number_of_threads() -> None:
    """Corners share one if vertex, normal, UV coordinate and sign agree: many meshes' worth of faces."""
    n = 130  # more faces than a thread takes at once
    x, y = np.meshgrid(np.linspace(0.0, 1.0, n), np.linspace(0.0, 1.0, n), indexing="ij")
    vertices = np.stack([x, y, 0.1 * np.sin(9.0 * x) * np.cos(7.0 * y)], axis=-1).reshape(-1, 3).astype(np.float32)
    quads = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).reshape(-1, 1) + (0, n, n + 1, 1)
    faces = np.ascontiguousarray(np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]), np.int32)
    normals = _native.angle_weighted_normals(vertices.astype(float), faces, faces, len(vertices)).astype(np.float32)
    uv = vertices[faces][..., :2].copy()
    one, two = (_native.corner_tangents(vertices, faces, uv, faces, normals, False, k) for k in (1, 2))
    assert np.array_equal(one, two)
    assert np.abs(np.einsum("fck,fck->fc", one[..., :3], normals[faces])).max() < 1e-6
    of_vertex = np.empty((len(vertices), 3), np.float32)
    of_vertex[faces] = one[..., :3]
    assert np.array_equal(of_vertex[faces], one[..., :3])


@pytest.mark.parametrize("count", [50, 100_000])
def test_vertices_of_many_tangents_are_as_copies_with_one_each(count: int) -> None:
    """Triangles around a pole, where each has a UV coordinate of its own, or one of a few with zeros of both signs."""
    rng = np.random.default_rng(count)
    angle = 2.0 * np.pi * np.arange(count) / count
    ring = np.stack([np.cos(angle), np.sin(angle), 0.3 * np.cos(3.0 * angle)], axis=1)
    vertices = np.concatenate([[[0.0, 0.0, 1.0]], ring]).astype(np.float32)
    k = np.arange(count)
    faces = np.stack([np.zeros_like(k), 1 + k, 1 + (k + 1) % count], axis=1).astype(np.int32)
    uv = np.stack([angle, np.zeros(count)], axis=1)
    uv = np.stack([uv + (0.5, 1.0), uv, np.roll(uv, -1, axis=0)], axis=1).astype(np.float32)
    few = rng.random(count) < 0.3
    uv[few, 0] = rng.choice(np.float32([0.0, -0.0, 0.5]), (np.count_nonzero(few), 2))
    normals = np.float32([(0.0, 0.0, 1.0), (0.0, -0.0, 1.0), (0.0, 0.6, 0.8)])
    smoothing = rng.integers(-1, 3, faces.shape).astype(np.int32)
    found = _native.corner_tangents(vertices, faces, uv, smoothing, normals, False, 2)
    p = vertices[faces].astype(float)
    plane = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    plane /= np.linalg.norm(plane, axis=1, keepdims=True)
    normal = np.where(smoothing[..., None] < 0, plane[:, None].astype(np.float32), normals[smoothing])
    key = np.concatenate([faces[..., None], uv, normal, found[..., 3:]], axis=2).reshape(-1, 7) + 0.0
    _, first, copy = np.unique(key, axis=0, return_index=True, return_inverse=True)
    assert len(first) > 1.5 * count
    copies = _native.corner_tangents(vertices[faces.reshape(-1)[first]], copy.reshape(-1, 3).astype(np.int32), uv,
                                     smoothing, normals, False, 1)  # fmt: skip
    assert np.array_equal(found, copies)


@pytest.mark.parametrize("stretch", [1.0, 3.0])
@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_placed_tangents_are_turned_as_normals_and_keep_their_lengths(stretch: float, mirror: float) -> None:
    rng = np.random.default_rng(3)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    linear = 2.5 * turn * np.sign(np.linalg.det(turn)) @ np.diag([mirror, stretch, 1.0])
    place = np.column_stack([linear, rng.normal(size=3)])
    values = np.concatenate([rng.normal(size=(5, 3, 3)), rng.choice([-1.0, 1.0], (5, 3, 1))], axis=2).astype(np.float32)
    found = placed_tangents(np.stack([np.eye(3, 4), place]), values)
    assert np.array_equal(found[:5], values) and np.array_equal(placed_tangents(np.eye(3, 4)[None], values), values)
    turned = values[..., :3] @ np.linalg.inv(linear)
    turned *= np.linalg.norm(values[..., :3], axis=2, keepdims=True) / np.linalg.norm(turned, axis=2, keepdims=True)
    assert np.allclose(found[5:, :, :3], turned, rtol=0.0, atol=1e-6)
    assert np.array_equal(found[5:, :, 3], mirror * values[..., 3])


@pytest.mark.parametrize("most", [3, 1000, 1 << 63])
def test_equal_keys_have_equal_numbers(most: int) -> None:
    keys = np.random.default_rng(0).integers(0, most, 5000, np.uint64)
    number, first = _native.number_equal_keys(keys)
    assert np.array_equal(keys[first][number], keys)
    assert len(first) == len(np.unique(keys))
    assert (np.diff(first) > 0).all()
    number, first = _native.number_equal_keys(keys[:0])
    assert not len(number) and not len(first)


@pytest.mark.parametrize("most", [3, 1000, 1 << 63])
def test_repeated_keys_are_found(most: int) -> None:
    keys = np.random.default_rng(0).integers(0, most, 5000, np.uint64)
    keys[4000:] = keys[:1000]
    _, number, count = np.unique(keys, return_inverse=True, return_counts=True)
    expected = np.flatnonzero((count[number] > 1) & (keys > 0))
    assert np.array_equal(np.sort(_native.repeated_keys(keys)), expected)
    assert not len(_native.repeated_keys(keys[:0]))
