"""Directions sampled towards lights, and whether their histogram is that of their density."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from tests.support.block_statistics import check
from tests.support.distributions import chi_square_tail
from tests.support.light_probes import Probe

Floats = NDArray[np.float64]
ORIGIN, UP = np.zeros(3), np.array([0.0, 0.0, 1.0])


def facing(position: ArrayLike, target: ArrayLike) -> Floats:
    """Transform of an area light at `position` that shines to `target`."""
    p = np.asarray(position, float)
    z = (p - target) / np.linalg.norm(p - target)
    x = np.cross((0.1, 0.9, 0.2), z)
    x /= np.linalg.norm(x)
    out = np.eye(4)
    out[:3] = np.stack([x, np.cross(z, x), z, p], axis=1)
    return out


AT = np.array([0.3, 0.2, 1.0])


def grid(n: int, seed: int = 0) -> Floats:
    """(n^2, 2) stratified numbers in [0, 1)^2."""
    i = np.arange(n)
    cells = np.stack(np.meshgrid(i, i, indexing="ij"), -1).reshape(-1, 2)
    return np.minimum((cells + np.random.default_rng(seed).random(cells.shape)) / n, 0.9999999)


def cone_directions(axis: Floats, rise: Floats, turn: Floats) -> Floats:
    """Unit vectors whose cosine to the axis is 1 - rise, `turn` in [0, 1) around it."""
    a = np.cross(axis, (0.3, 0.5, -0.8))
    a /= np.linalg.norm(a)
    sine = np.sqrt(rise * (2.0 - rise))
    across = np.cos(2 * np.pi * turn)[:, None] * a + np.sin(2 * np.pi * turn)[:, None] * np.cross(axis, a)
    return np.asarray(across * sine[:, None] + axis * (1.0 - rise)[:, None])


def check_density(probe: Probe, samples: int = 30_000, fine: int = 12, rim: float = 0.005) -> None:
    """The histogram of directions sampled from the origin, over a cone around all of them, is that of the density.

    A cell's expected number is a quadrature over fine x fine places, and off by the share `rim` of it.
    """
    position, normal = ORIGIN, UP
    uv = np.random.default_rng(7).random((samples, 2)).clip(0.0, 0.9999999)
    s = probe.sample(position, normal, uv)
    w = s["w"].astype(np.float64)
    axis = w.mean(axis=0) / np.linalg.norm(w.mean(axis=0))
    rise = 0.5 * np.sum((w - axis) ** 2, axis=1)
    top = min(1.05 * rise.max(), 2.0)
    rings, sectors = 10, 16
    a = np.cross(axis, (0.3, 0.5, -0.8))
    a /= np.linalg.norm(a)
    turn = (np.arctan2(w @ np.cross(axis, a), w @ a) / (2 * np.pi)) % 1.0
    ring, sector = (rise / top * rings).astype(int).clip(0, rings - 1), (turn * sectors).astype(int) % sectors
    observed = np.bincount(ring * sectors + sector, minlength=rings * sectors)

    at = (np.arange(rings * fine) + 0.5) / (rings * fine), (np.arange(sectors * fine) + 0.5) / (sectors * fine)
    places = np.stack(np.meshgrid(*at, indexing="ij"), -1).reshape(-1, 2)
    p = probe.density(position, normal, cone_directions(axis, places[:, 0] * top, places[:, 1]))
    solid_angle = 2 * np.pi * top / len(p)
    expected = p.reshape(rings, fine, sectors, fine).sum(axis=(1, 3)).reshape(-1) * solid_angle * samples
    assert expected.sum() / samples == pytest.approx(1.0, abs=0.02)

    order = np.argsort(expected)  # cells with few expected samples are pooled
    few = np.cumsum(expected[order]) < 10.0
    pooled = [np.append(v[order][~few], v[order][few].sum()) for v in (observed, expected)]
    pooled = [v[pooled[1] > 5.0] for v in pooled]
    error = pooled[1] + (rim * pooled[1]) ** 2
    statistic = float(np.sum((pooled[0] - pooled[1]) ** 2 / error))
    assert len(pooled[0]) > 8
    check(chi_square_tail(statistic, len(pooled[0]) - 1))
