"""Random numbers and the distributions that the estimators draw from."""

from __future__ import annotations

import numpy as np

from .surfaces import Bools, Floats, Ints, Surfaces, dot

# Random numbers of one light connection: face, two for the point on it, two for the environment.
LIGHT_DIMENSIONS = 5


def sequence(generator: np.random.Generator, points: int, first: int, count: int, dimensions: int) -> Floats:
    """(points, count, dimensions) numbers in [0, 1): entries first … first + count - 1 of one sequence per point.

    The additive recurrence x_k = frac(shift + k alpha) with alpha_j = phi^-(j + 1), phi the root of
    phi^(dimensions + 1) = phi + 1: it fills the unit cube evenly; each point has its own random
    shift, so every number by itself is uniform and estimates are unbiased.
    """
    phi = 2.0
    for _ in range(64):
        phi = (1.0 + phi) ** (1.0 / (dimensions + 1))
    alpha = phi ** -np.arange(1.0, dimensions + 1)
    shift = generator.random((points, 1, dimensions))
    return np.mod(shift + np.arange(first, first + count)[:, None] * alpha, 1.0)


class LightChoice:
    """Emissive triangles by area times radiance: face with probability P, then a point uniform on it."""

    def __init__(self, surfaces: Surfaces, possible: Bools) -> None:
        """`possible` (materials,): also to be sampled while their emission is zero, as its derivative isn't."""
        radiance = surfaces.emission.mean(axis=1)
        common = radiance.max(initial=0.0) or 1.0
        radiance = np.where(possible, np.maximum(radiance, 0.1 * common), radiance)
        weight = 0.5 * np.linalg.norm(surfaces.M, axis=1) * radiance[surfaces.material]
        self.faces = np.flatnonzero(weight > 0.0)
        self._probability = weight[self.faces] / max(weight.sum(), 1e-300)
        self._cumulated = np.cumsum(self._probability)

    def __len__(self) -> int:
        return len(self.faces)

    def sample(self, xi: Floats) -> tuple[Ints, Floats, Floats]:
        """Faces (n,), barycentrics (n, 3) and the faces' probabilities (n,) for random numbers (n, 3)."""
        k = np.searchsorted(self._cumulated, xi[:, 0] * self._cumulated[-1], side="right")
        k = np.minimum(k, len(self.faces) - 1)
        root = np.sqrt(xi[:, 1])
        beta = np.stack([1.0 - root, root * (1.0 - xi[:, 2]), root * xi[:, 2]], axis=1)
        return self.faces[k], beta, self._probability[k]


def frame(n: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors that complete unit rows `n` to right-handed frames."""
    sign = np.where(n[:, 2] >= 0.0, 1.0, -1.0)
    a = -1.0 / (sign + n[:, 2])
    b = n[:, 0] * n[:, 1] * a
    s = np.stack([1.0 + sign * n[:, 0] ** 2 * a, sign * b, -sign * n[:, 0]], axis=1)
    t = np.stack([b, sign + n[:, 1] ** 2 * a, -n[:, 1]], axis=1)
    return s, t


def _around(n: Floats, height: Floats, turn: Floats) -> Floats:
    """Unit directions with n.w = height, at the azimuth 2 pi turn."""
    s, t = frame(n)
    radius = np.sqrt(np.maximum(1.0 - height * height, 0.0))
    phi = 2.0 * np.pi * turn
    return (radius * np.cos(phi))[:, None] * s + (radius * np.sin(phi))[:, None] * t + height[:, None] * n


def cosine_direction(n: Floats, xi: Floats) -> Floats:
    """Directions about `n` with density cos/pi."""
    return _around(n, np.sqrt(1.0 - xi[:, 0]), xi[:, 1])


def mixed_direction(n: Floats, xi: Floats) -> tuple[Floats, Floats]:
    """Directions about `n` with density (cos/pi + 1/(2 pi))/2, and that density.

    With cosines alone the estimator of (dn/dt).w has infinite variance at the horizon.
    """
    cosine = xi[:, 0] < 0.5
    stretched = np.where(cosine, 2.0 * xi[:, 0], 2.0 * xi[:, 0] - 1.0)
    w = _around(n, np.where(cosine, np.sqrt(1.0 - stretched), stretched), xi[:, 1])
    return w, (0.5 * np.maximum(dot(n, w), 0.0) + 0.25) / np.pi
