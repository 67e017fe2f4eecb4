"""What rays hit: by themselves, and as pictures without noise show it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from edgegrad import Field, Material, Renderer, Scene, World
from edgegrad.expression import Backfacing, Coordinates, Mix, VectorMath
from edgegrad.rendering.native_engine import Engine
from tests.support.small_scenes import matte, pixel_at

Floats = NDArray[np.float64]


def renderer_of(field: Field, threads: int = 1) -> Renderer:
    """A field alone in a white environment."""
    scene = Scene(pixel_at((0, 0, 4), (0, 0, 0)), materials={field.material: matte()}, fields={"field": field},
                  world=World(np.ones(3)))
    return Renderer(scene, threads=threads)


def trace(renderer: Renderer, origins: ArrayLike, directions: ArrayLike, shadow: bool = False) -> Floats:
    """(n,) distances to the nearest hits, inf without one; of shadow rays 0 where there is any hit."""
    engine = renderer._engine
    assert isinstance(engine, Engine)
    engine._hold_to_trace(renderer.tables)
    o, d = (np.reshape(np.asarray(a, np.float32), (-1, 3)) for a in (origins, directions))
    o = (o - renderer.tables.origin).astype(np.float32)
    face, distance = engine._scene.trace(o, d, np.inf, shadow)
    return np.where(face < 0, np.inf, 0.0 if shadow else distance)


def front(kind: str, scale: float) -> Material:
    """A transparent material: fronts multiply light by 0.5 + scale * (position or normal), and backs are clear."""
    value = VectorMath("ADD", VectorMath("SCALE", Coordinates(kind), scale=scale), (0.5, 0.5, 0.5))
    return Material(np.ones(3), kind="TRANSPARENT",
                    textures={"base_color": Mix(Backfacing(), value, (1.0, 1.0, 1.0))})


def probed(field: Field, origins: ArrayLike, directions: ArrayLike, kind: str, scale: float = 0.25) -> Floats:
    """(n, 3) positions or normals of the fronts that rays hit; NaN without a hit.

    A ray may hit one front only, since the values of all fronts along a ray are multiplied.
    """
    starts, ways = (np.reshape(np.asarray(a, float), (-1, 3)) for a in (origins, directions))
    scene = Scene(pixel_at((0, 0, 4), (0, 0, 0)), materials={field.material: front(kind, scale)},
                  fields={"field": field}, world=World(np.ones(3)))
    renderer = Renderer(scene)
    out = []
    for origin, way in zip(starts, ways, strict=True):
        up = (0, 1, 0) if abs(way[1]) < 0.9 * np.linalg.norm(way) else (1, 0, 0)
        value = renderer.render(spp=1, camera=pixel_at(origin, origin + way, up))[0, 0].astype(float)
        out.append(np.full(3, np.nan) if np.all(value == 1.0) else (value - 0.5) / scale)
    return np.array(out)
