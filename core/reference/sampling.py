"""Random numbers and sampling distributions of the estimators."""

from __future__ import annotations

import numpy as np

from .surfaces import Bools, Floats, Ints, Surfaces, dot

# Random numbers of one light connection: face, two for the point on it, two for the environment.
LIGHT_DIMENSIONS = 5


def sequence(generator: np.random.Generator, points: int, first: int, count: int, dimensions: int) -> Floats:
    """(points, count, dimensions) numbers in [0, 1): entries first … first + count - 1 of one sequence per point.

    The sequence is the additive recurrence x_k = frac(shift + k alpha) with alpha_j = phi^-(j + 1), where phi is the
    root of phi^(dimensions + 1) = phi + 1 (Roberts 2018, "R_d"). It has a low discrepancy. Each point has its own
    random shift, so each number alone is uniform and estimates are unbiased.
    """
    phi = 2.0
    for _ in range(64):
        phi = (1.0 + phi) ** (1.0 / (dimensions + 1))
    alpha = phi ** -np.arange(1.0, dimensions + 1)
    shift = generator.random((points, 1, dimensions))
    return np.mod(shift + np.arange(first, first + count)[:, None] * alpha, 1.0)


class LightChoice:
    """Sampling of emissive triangles: a face in proportion to area times radiance, then a point on it."""

    def __init__(self, surfaces: Surfaces, possible: Bools) -> None:
        """`possible` (materials,) marks materials to sample even if their emission is zero: its derivative is not."""
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
        """Sample faces (n,), barycentrics (n, 3) and probabilities of the faces (n,) from random numbers (n, 3)."""
        k = np.searchsorted(self._cumulated, xi[:, 0] * self._cumulated[-1], side="right")
        k = np.minimum(k, len(self.faces) - 1)
        root = np.sqrt(xi[:, 1])
        beta = np.stack([1.0 - root, root * (1.0 - xi[:, 2]), root * xi[:, 2]], axis=1)
        return self.faces[k], beta, self._probability[k]


def frame(n: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors that complete unit vectors `n` (rows) to right-handed frames (Duff et al. 2017)."""
    sign = np.where(n[:, 2] >= 0.0, 1.0, -1.0)
    a = -1.0 / (sign + n[:, 2])
    b = n[:, 0] * n[:, 1] * a
    s = np.stack([1.0 + sign * n[:, 0] ** 2 * a, sign * b, -sign * n[:, 0]], axis=1)
    t = np.stack([b, sign + n[:, 1] ** 2 * a, -n[:, 1]], axis=1)
    return s, t


def _around(n: Floats, height: Floats, turn: Floats) -> Floats:
    """Unit directions w with n.w = height and the azimuth 2 pi turn."""
    s, t = frame(n)
    radius = np.sqrt(np.maximum(1.0 - height * height, 0.0))
    phi = 2.0 * np.pi * turn
    return (radius * np.cos(phi))[:, None] * s + (radius * np.sin(phi))[:, None] * t + height[:, None] * n


def cosine_direction(n: Floats, xi: Floats) -> Floats:
    """Directions about `n` with the density cos/pi."""
    return _around(n, np.sqrt(1.0 - xi[:, 0]), xi[:, 1])


def mixed_direction(n: Floats, xi: Floats) -> tuple[Floats, Floats]:
    """Directions about `n` with the density (cos/pi + 1/(2 pi))/2, and the values of this density.

    With the density cos/pi, the estimator of (dn/dt).w would have infinite variance because of directions at the
    horizon.
    """
    cosine = xi[:, 0] < 0.5
    stretched = np.where(cosine, 2.0 * xi[:, 0], 2.0 * xi[:, 0] - 1.0)
    w = _around(n, np.where(cosine, np.sqrt(1.0 - stretched), stretched), xi[:, 1])
    return w, (0.5 * np.maximum(dot(n, w), 0.0) + 0.25) / np.pi
