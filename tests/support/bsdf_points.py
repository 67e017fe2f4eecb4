"""BSDFs evaluated and sampled natively at many points, for tests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from edgegrad import _native
from edgegrad.scene.material import KINDS, Material
from edgegrad.tables.materials import COLUMNS, WIDTH, flags

F32 = NDArray[np.float32]
UP = (0.0, 0.0, 1.0)


@dataclass
class Bsdfs:
    """Values at n points: f |cos| and densities of given directions, and samples."""

    value: F32  # (n, 3)
    pdf: F32  # (n,)
    emission: F32  # (n, 3)
    sample_wi: F32  # (n, 3)
    sample_weight: F32  # (n, 3) f |cos| / pdf
    sample_pdf: F32  # (n,)
    sample_active: NDArray[np.bool_]  # (n,)
    sample_specular: NDArray[np.bool_]  # (n,)
    sample_transmitted: NDArray[np.bool_]  # (n,)
    sample_ray_kind: NDArray[np.int32]  # (n,) 1 diffuse, 2 glossy, 3 transmission


def direction(cosine: float, turns: float = 0.0) -> F32:
    """A unit vector at the cosine with z."""
    sine = np.sqrt(max(1.0 - cosine**2, 0.0))
    angle = 2 * np.pi * turns
    return np.array([sine * np.cos(angle), sine * np.sin(angle), cosine], np.float32)


def bsdfs(materials: Material | Sequence[Material], wo: ArrayLike, wi: ArrayLike = UP, random: ArrayLike = 0.5, *,
          which: ArrayLike = 0, inside: ArrayLike = False, normal: ArrayLike = UP, true_normal: ArrayLike = UP,
          tangent: ArrayLike = (1.0, 0.0, 0.0), instruction_set: str | None = None,
          favoured: int = 0) -> Bsdfs:  # fmt: skip
    """All arguments are broadcast to the points: directions as (n, 3), `random` as (3, n): lobe, u and v.

    Of `favoured` lobes (bits of shading/bsdf/lobe.h) samples are as for derivatives by how wide they are.
    """
    leaves = [materials] if isinstance(materials, Material) else list(materials)
    for leaf in leaves:
        leaf.validate("tested")
    params = np.zeros((len(leaves), WIDTH), np.float32)
    for row, leaf in zip(params, leaves, strict=True):
        for field, (place, count) in COLUMNS.items():
            row[place : place + count] = 1.0 if field == "weight" else getattr(leaf, field)
    table = SimpleNamespace(params=params, kind=np.array([KINDS.index(leaf.kind) for leaf in leaves], np.int32),
                            flags=np.array([flags(leaf) for leaf in leaves], np.int32))
    random = np.asarray(random, np.float32)
    n = max(np.size(a) // 3 for a in (wo, wi, normal, true_normal, tangent))
    n = max(n, np.size(which), np.size(inside), random.shape[-1] if random.ndim else 1)

    def vectors(v: ArrayLike) -> F32:
        return np.ascontiguousarray(np.broadcast_to(np.asarray(v, np.float32), (n, 3)))

    def integers(v: ArrayLike) -> NDArray[np.int32]:
        return np.ascontiguousarray(np.broadcast_to(np.asarray(v, np.int32), (n,)))

    points = SimpleNamespace(
        material=integers(which), from_inside=integers(inside), wo=vectors(wo), wi=vectors(wi),
        normal=vectors(normal), true_normal=vectors(true_normal), tangent=vectors(tangent),
        random=np.ascontiguousarray(np.broadcast_to(random, (3, n))))  # fmt: skip
    out: dict[str, Any] = _native.evaluate_bsdfs(
        table, points, instruction_set or _native.instruction_sets()[0], favoured)  # fmt: skip
    for key in ("sample_active", "sample_specular", "sample_transmitted"):
        out[key] = out[key] != 0
    return Bsdfs(**out)


def random_numbers(n: int, seed: int) -> F32:
    """(3, n) in [0, 1): lobes and a low-discrepancy pair (Roberts' R2 sequence, shifted)."""
    rng = np.random.default_rng(seed)
    k = np.arange(n)[:, None] * np.array([0.7548776662466927, 0.5698402909980532]) + rng.random(2)
    return np.concatenate([rng.random((1, n)), (k % 1).T]).astype(np.float32) * np.float32(0.9999999)


def mixed() -> Material:
    """A Principled BSDF with all of its lobes."""
    return Material(np.array([0.8, 0.5, 0.2]), metallic=0.3, roughness=0.4, diffuse_roughness=0.5,
                    specular_ior_level=0.6, specular_tint=np.array([1.0, 0.7, 0.9]), ior=1.4, anisotropy=0.5,
                    anisotropy_rotation=0.15, transmission=0.4, coat_weight=0.5, coat_roughness=0.35, coat_ior=1.6,
                    coat_tint=np.array([0.9, 0.8, 1.0]), sheen_weight=0.4, sheen_roughness=0.5)  # fmt: skip


def rough_materials() -> dict[str, Material]:
    """Surfaces without perfect mirrors, of every kind of lobe."""
    color = np.array([0.8, 0.6, 0.3])
    return {
        "diffuse": Material(color, kind="DIFFUSE"),
        "rough diffuse": Material(color, kind="DIFFUSE", diffuse_roughness=0.8),
        "translucent": Material(color, kind="TRANSLUCENT"),
        "glossy": Material(color, kind="GLOSSY", roughness=0.5),
        "rough glossy": Material(color, kind="GLOSSY", roughness=1.0, multiscatter=False),
        "brushed": Material(color, kind="GLOSSY", roughness=0.6, anisotropy=-0.5, anisotropy_rotation=0.1),
        "glass": Material(color, kind="GLASS", roughness=0.5),
        "thin glass": Material(color, kind="GLASS", roughness=0.7, ior=0.8),
        "refraction": Material(color, kind="REFRACTION", roughness=0.6),
        "sheen": Material(color, kind="SHEEN", roughness=0.4),
        "velvet": Material(color, kind="VELVET", roughness=0.6),
        "beckmann": Material(color, kind="GLOSSY", roughness=0.5, distribution="BECKMANN"),
        "rough beckmann": Material(color, kind="GLOSSY", roughness=1.0, distribution="BECKMANN"),
        "brushed beckmann": Material(color, kind="GLOSSY", roughness=0.6, anisotropy=-0.5, anisotropy_rotation=0.1,
                                     distribution="BECKMANN"),
        "beckmann glass": Material(color, kind="GLASS", roughness=0.5, distribution="BECKMANN"),
        "thin beckmann glass": Material(color, kind="GLASS", roughness=0.7, ior=0.8, distribution="BECKMANN"),
        "beckmann refraction": Material(color, kind="REFRACTION", roughness=0.6, distribution="BECKMANN"),
        "beckmann metal": Material(color, roughness=0.5, metallic=1.0, distribution="BECKMANN"),
        "phong": Material(color, kind="GLOSSY", roughness=0.5, distribution="ASHIKHMIN_SHIRLEY"),
        "rough phong": Material(color, kind="GLOSSY", roughness=1.0, distribution="ASHIKHMIN_SHIRLEY"),
        "brushed phong": Material(color, kind="GLOSSY", roughness=0.6, anisotropy=0.5, anisotropy_rotation=0.1,
                                  distribution="ASHIKHMIN_SHIRLEY"),
        "disney": Material(color, kind="DISNEY", roughness=0.5, metallic=0.4, specular_ior_level=0.5),
        "plastic": Material(color, roughness=0.5, specular_ior_level=0.5),
        "metal": Material(color, roughness=0.5, metallic=1.0, specular_tint=np.array([0.5, 0.8, 1.0])),
        "coated": Material(color, roughness=0.7, specular_ior_level=0.5, coat_weight=1.0, coat_roughness=0.4),
        "mixed": mixed(),
    }
