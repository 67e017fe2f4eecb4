"""Ray queries: testing every triangle finds what Embree's BVH finds, and closed bodies let no ray through."""

from __future__ import annotations

import numpy as np
import pytest

_native = pytest.importorskip("edgegrad._native")

from edgegrad.rendering.native_engine import embree_library, instruction_sets  # noqa: E402
from tests.support.shapes import displaced_sphere  # noqa: E402

FAR = float("inf")


def ray_scene(vertices: np.ndarray, faces: np.ndarray) -> _native.RayScene:
    return _native.RayScene(
        np.ascontiguousarray(vertices, np.float32), np.ascontiguousarray(faces, np.int32), 1, str(embree_library())
    )


def trace(scene: _native.RayScene, origins: np.ndarray, directions: np.ndarray, isa: str, *, brute_force: bool,
          shadow: bool = False, far: float = FAR) -> tuple[np.ndarray, np.ndarray]:
    o, d = (np.ascontiguousarray(a, np.float32) for a in (origins, directions))
    return scene.trace(o, d, far, shadow, False, brute_force, isa)[1:]


@pytest.mark.parametrize("isa", instruction_sets())
@pytest.mark.parametrize("brute_force", [True, False])
def test_rays_find_the_nearest_of_random_triangles(isa: str, brute_force: bool) -> None:
    rng = np.random.default_rng(3)
    vertices = rng.uniform(-1, 1, (90, 3))
    faces = np.arange(90).reshape(30, 3)
    scene = ray_scene(vertices, faces)
    o, d = rng.uniform(-1.5, 1.5, (20_001, 3)), rng.normal(size=(20_001, 3))
    face, distance = trace(scene, o, d, isa, brute_force=brute_force)
    # Cramer's rule in double precision
    p = vertices.astype(np.float32).astype(float)[faces]
    e1, e2 = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    o64, d64 = o.astype(np.float32).astype(float)[:, None], d.astype(np.float32).astype(float)[:, None]
    q = np.cross(d64, e2)
    det = np.sum(e1 * q, -1)
    s = o64 - p[:, 0]
    u, r = np.sum(s * q, -1) / det, np.cross(s, e1)
    v, t = np.sum(d64 * r, -1) / det, np.sum(e2 * r, -1) / det
    inside = np.minimum(np.minimum(u, v), 1 - u - v)
    reach = np.where((inside >= 0) & (t > 0), t, np.inf)
    # Within rounding of an edge, or of the origin, either answer is right.
    clear = (np.abs(inside) > 1e-4).all(axis=1) & (np.abs(t) > 1e-4).all(axis=1)
    nearest = np.where(np.isinf(reach.min(axis=1)), -1, reach.argmin(axis=1))
    assert clear.mean() > 0.95
    assert 0.1 < np.mean(nearest >= 0) < 0.95
    assert np.array_equal(face[clear], nearest[clear])
    hit = clear & (nearest >= 0)
    assert distance[hit] == pytest.approx(reach.min(axis=1)[hit], rel=1e-4, abs=1e-5)
    hidden, _ = trace(scene, o, d, isa, brute_force=brute_force, shadow=True, far=1.0)
    assert np.array_equal(hidden[clear] >= 0, (reach.min(axis=1) < 1.0)[clear])


@pytest.mark.parametrize("isa", instruction_sets())
def test_no_ray_slips_between_neighbours(isa: str) -> None:
    """From inside a closed body every ray hits, also those aimed at its edges; of those aimed at a corner, most."""
    body = displaced_sphere(2, 0.3)
    vertices = body["vertices"].astype(np.float32).astype(np.float64)
    faces = body["faces"]
    scene = ray_scene(vertices, faces)
    rng = np.random.default_rng(4)
    origins = rng.uniform(-0.2, 0.2, (40, 3)).astype(np.float32).astype(np.float64)
    share = rng.random((len(faces), 20, 1))
    on_edges = vertices[faces[:, 0], None] * share + vertices[faces[:, 1], None] * (1 - share)
    # Several edges meet in a corner: the roundings of their signs are independent.
    for targets, missed in ((on_edges.reshape(-1, 3), 0.0), (vertices, 0.05)):
        d = (targets[None] - origins[:, None]).reshape(-1, 3)
        o = np.repeat(origins, len(targets), axis=0)
        for shadow in (False, True):
            face, _ = trace(scene, o, d, isa, brute_force=True, shadow=shadow)
            assert np.mean(face < 0) <= missed


def test_embree_itself_agrees() -> None:
    """The bulk queries that benchmarks compare with answer the same rays."""
    rng = np.random.default_rng(5)
    body = displaced_sphere(4, 0.2)
    scene = ray_scene(body["vertices"], body["faces"])
    o = rng.uniform(-2, 2, (5000, 3)).astype(np.float32)
    d = rng.normal(size=(5000, 3)).astype(np.float32)
    face, distance = trace(scene, o, d, "", brute_force=False)
    for width in (1, 4, 8, 16):
        _, other, far = scene.trace_embree(o, d, FAR, False, False, width)
        assert np.mean(other != face) < 1e-3
        assert far[face >= 0] == pytest.approx(distance[face >= 0], rel=1e-4)
        hidden = scene.trace_embree(o, d, FAR, True, False, width)[1]
        assert np.array_equal(hidden >= 0, other >= 0)
