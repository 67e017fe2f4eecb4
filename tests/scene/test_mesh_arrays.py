"""What the export computes natively of large meshes."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from edgegrad import _native


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


@pytest.mark.parametrize("most", [3, 1000, 1 << 63])
def test_equal_keys_have_equal_numbers(most: int) -> None:
    keys = np.random.default_rng(0).integers(0, most, 5000, np.uint64)
    number, first = _native.number_equal_keys(keys)
    assert np.array_equal(keys[first][number], keys)
    assert len(first) == len(np.unique(keys))
    assert (np.diff(first) > 0).all()
    number, first = _native.number_equal_keys(keys[:0])
    assert not len(number) and not len(first)
