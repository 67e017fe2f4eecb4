"""Writes albedo_tables.inc: directional albedos of GGX surfaces, on the grids that Cycles uses.

    python native/shading/bsdf/tables/make_albedo_tables.py

Axes (fastest first): roughness and cosine of the view in [0, 1], and z with ior = (1 + z²) / (1 - z²), so that
most places are at indices between 1 and 2. All entries are means over visible normals (Dupuy and Benyoub 2023)
at a grid of random numbers:

- reflection: of G2/G1 where the reflection leaves the surface; its cosine-weighted mean is `reflection_mean`,
- glass, glass_inside: the same with dielectric Fresnel reflection and refraction, for the relative index ior and
  1 / ior. As in Cycles' tables refraction counts even where it stays on the viewer's side, which happens inside:
  rough glass loses that light.
- fresnel: of (F - F0) / (1 - F0) where the reflection leaves the surface, with F the dielectric Fresnel term.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

REFLECTION_SIZE, INTERFACE_SIZE = 32, 16
SAMPLES = 96  # per random number
LEAST = 1e-4  # of roughness, cosine and z


def visible_normals(mu: Array, alpha: float, samples: int) -> Array:
    """(len(mu), samples², 3) normals seen from the directions (sqrt(1 - mu²), 0, mu), equally likely."""
    u, v = (np.stack(np.meshgrid(*[(np.arange(samples) + 0.5) / samples] * 2), -1).reshape(-1, 2)).T
    view = np.stack([alpha * np.sqrt(1 - mu**2), np.zeros_like(mu), mu], -1)
    view /= np.linalg.norm(view, axis=-1, keepdims=True)
    z = (1 - u) * (1 + view[:, 2:]) - view[:, 2:]
    radius = np.sqrt(np.clip(1 - z**2, 0, None))
    phi = 2 * np.pi * v
    h = np.stack([radius * np.cos(phi), radius * np.sin(phi), z], -1) + view[:, None]
    h[..., :2] *= alpha
    return h / np.linalg.norm(h, axis=-1, keepdims=True)


def smith_lambda(alpha: float, z: Array) -> Array:
    return 0.5 * (np.sqrt(1 + alpha**2 * np.clip(1 / np.maximum(z**2, 1e-30) - 1, 0, None)) - 1)


def dielectric(cosine: Array, eta: float) -> tuple[Array, Array]:
    """Fresnel reflectance, and the cosine of the refracted direction (0: total reflection)."""
    squared = 1 - (1 - cosine**2) / eta**2
    t = np.sqrt(np.clip(squared, 0, None))
    s = (cosine - eta * t) / (cosine + eta * t)
    p = (eta * cosine - t) / (eta * cosine + t)
    return np.where(squared <= 0, 1.0, 0.5 * (s**2 + p**2)), t


def scattered(mu: Array, rough: float, samples: int) -> tuple[Array, Array, Array]:
    """Cosines of the view with the visible normals, share of light that is reflected, and the normals' z."""
    alpha = rough**2
    h = visible_normals(mu, alpha, samples)
    cosine = np.sqrt(1 - mu**2)[:, None] * h[..., 0] + mu[:, None] * h[..., 2]
    z = 2 * cosine * h[..., 2] - mu[:, None]
    one = 1 + smith_lambda(alpha, mu)[:, None]
    return cosine, np.where(z > 0, one / (one + smith_lambda(alpha, z)), 0.0), h[..., 2]


def reflection(mu: Array, rough: float) -> Array:
    return scattered(mu, rough, 4 * SAMPLES)[1].mean(-1)


def interface(mu: Array, rough: float, eta: float) -> Array:
    if abs(eta - 1) < LEAST:
        return np.ones_like(mu)  # nothing is refracted: Cycles lets light pass
    cosine, reflected, hz = scattered(mu, rough, SAMPLES)
    f, t = dielectric(cosine, eta)
    z = (cosine / eta - t) * hz - mu[:, None] / eta
    one = 1 + smith_lambda(rough**2, mu)[:, None]
    refracted = one / (one + smith_lambda(rough**2, z))
    return (f * reflected + (1 - f) * refracted).mean(-1)


def fresnel(mu: Array, rough: float, eta: float) -> Array:
    cosine, reflected, _ = scattered(mu, rough, SAMPLES)
    f0 = ((eta - 1) / (eta + 1)) ** 2
    return (np.clip((dielectric(cosine, eta)[0] - f0) / (1 - f0), 0, 1) * (reflected > 0)).mean(-1)


def grid(size: int) -> Array:
    return np.clip(np.arange(size) / (size - 1), LEAST, 1)


def tables() -> dict[str, Array]:
    nodes, weights = np.polynomial.legendre.leggauss(48)
    mean_mu, mean_weight = 0.5 * (nodes + 1), 0.5 * weights * (nodes + 1)
    fine, coarse = grid(REFLECTION_SIZE), grid(INTERFACE_SIZE)
    z = np.clip(coarse, LEAST, 0.99)
    root = np.sqrt(np.minimum(z**4, 0.99))
    iors = (1 + root) / (1 - root)
    return {
        "kReflectionAlbedo": np.stack([reflection(fine, r) for r in fine], -1),
        "kReflectionMeanAlbedo": np.array([reflection(mean_mu, r) @ mean_weight for r in fine]),
        "kGlassAlbedo": np.stack([np.stack([interface(coarse, r, i) for r in coarse], -1) for i in iors]),
        "kGlassMeanAlbedo": np.array([[interface(mean_mu, r, i) @ mean_weight for r in coarse] for i in iors]),
        "kGlassInsideAlbedo": np.stack([np.stack([interface(coarse, r, 1 / i) for r in coarse], -1) for i in iors]),
        "kGlassInsideMeanAlbedo": np.array(
            [[interface(mean_mu, r, 1 / i) @ mean_weight for r in coarse] for i in iors]),
        "kReflectionFresnel": np.stack([np.stack([fresnel(coarse, r, i) for r in coarse], -1) for i in iors]),
    }


def main() -> None:
    out = ["// Written by make_albedo_tables.py.\n"]
    for name, table in tables().items():
        numbers = [f"{v:.5f}f" for v in np.clip(table, 0, 1).ravel()]
        rows = ["    " + ", ".join(numbers[k : k + 12]) + ",\n" for k in range(0, len(numbers), 12)]
        out += [f"extern const float {name}[{table.size}] = {{\n", *rows, "};\n"]
    Path(__file__).with_name("albedo_tables.inc").write_text("".join(out))


if __name__ == "__main__":
    main()
