"""Attributes of fields on other grids, and of meshes on grids of fields."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from edgegrad.distance_fields import linear, resampled, sampled_attributes, to_mesh
from tests.support.fields.splines import exact_sphere

PLACE = np.array([[0.9, -0.3, 0.1, 0.2], [0.4, 0.8, 0.0, -0.1], [0.0, 0.2, 1.1, 0.1], [0.0, 0.0, 0.0, 1.0]])


def places(*size: int) -> np.ndarray:
    return np.stack(np.meshgrid(*[np.linspace(-1, 1, n) for n in size], indexing="ij"), axis=-1)


def test_attributes_keep_their_place_in_another_box() -> None:
    """Linear values stay linear, and a grid of one value stays one."""
    field = exact_sphere(0.3, 19, attributes={"where": places(6, 5, 9), "one": np.full((1, 1, 1, 2), 0.5)})
    part = resampled(field, (12, 10, 8), lower=(-0.55, -0.6, -0.5), upper=(0.5, 0.7, 0.45))
    mesh = to_mesh(part)
    np.testing.assert_allclose(mesh.attributes["where"], mesh.vertices[mesh.faces], atol=1e-6)
    assert part.attributes["where"].shape == (4, 4, 5, 3) and part.attributes["one"].shape == (1, 1, 1, 2)
    whole = resampled(field, (12, 10, 8))
    assert np.array_equal(whole.attributes["where"], places(6, 5, 9).astype(np.float32))


def test_attributes_of_meshes_come_back() -> None:
    """From a field to a mesh and back, in a box that is turned and sheared."""
    field = exact_sphere(0.6, 19, transform=PLACE)
    painted = replace(field, attributes={"where": places(3, 2, 4)})
    again = sampled_attributes(field, to_mesh(painted, finer=1), iter(["where"]))
    assert again.attributes["where"].shape == (9, 9, 9, 3) and not field.attributes
    mesh = to_mesh(again)
    inverse = np.linalg.inv(PLACE)
    own = mesh.vertices @ inverse[:3, :3].T + inverse[:3, 3]
    # Beside the surface, values are those of the nearest place of it: up to half a cell of the grid away.
    assert np.abs(mesh.attributes["where"] - own[mesh.faces]).max() < 0.1
    with pytest.raises(ValueError, match="the mesh has no attribute 'were'; did you mean 'where'"):
        sampled_attributes(field, to_mesh(painted), ["were"])


def test_weights_along_an_axis_are_those_of_the_whole_grid() -> None:
    rng = np.random.default_rng(2)
    grid, at = rng.normal(size=(4, 1, 6, 2)), rng.uniform(0.0, 1.0, (20, 3))
    wanted = linear.sampled(grid, at)
    weights = [linear.axis_weights(n, at[:, k]) for k, n in enumerate(grid.shape[:3])]
    found = np.einsum("na,nb,nc,abcd->nd", *weights, grid)
    np.testing.assert_allclose(found, wanted, atol=1e-6)
