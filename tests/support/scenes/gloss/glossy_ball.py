"""A ball of metal or glass, alone or over a floor, and the noise of its derivative."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad.rendering.renderer import Renderer
from tests.support import shapes
from tests.support.block_statistics import block_sums
from tests.support.small_scenes import camera, glowing, matte, rectangle

SIZE, BLOCK, MAX_DEPTH = 16, 8, 5
TERMS = ("interior", "primary", "shadow", "indirect")
BODIES = ("metal", "glass")


def sky_image() -> NDArray[np.float64]:
    """A smooth sky, bright on one side."""
    v, u = np.meshgrid(np.linspace(0.0, 1.0, 16), np.linspace(0.0, 2.0 * np.pi, 32, endpoint=False), indexing="ij")
    level = 0.6 + 0.4 * np.cos(u) * np.sin(np.pi * v) + 0.3 * np.cos(np.pi * v)
    return np.stack([level, 0.8 * level + 0.1, np.full_like(level, 0.5)], axis=-1)


def body(kind: str, roughness: float) -> edgegrad.Material:
    """The ball's material."""
    if kind == "glass":
        return edgegrad.Material(np.full(3, 0.95), kind="GLASS", roughness=roughness, ior=1.45)
    return edgegrad.Material(np.array([0.9, 0.8, 0.6]), kind="GLOSSY", roughness=roughness)


def scene(kind: str, roughness: float, light: str, floor: str) -> edgegrad.Scene:
    """A ball, alone or over a floor."""
    vertices, faces = shapes.ball(3, 0.5)
    meshes = {"ball": edgegrad.Mesh(vertices, faces, ("ball",), smoothing=faces)}
    materials = {"floor": matte(0.6, 0.4, 0.3) if floor == "matte" else glowing(0.4), "ball": body(kind, roughness)}
    if floor != "none":
        meshes["floor"] = rectangle((0, -0.6, 0), (0, 0, 3), (3, 0, 0), "floor")
    place = np.array([0.8, 1.6, 0.9])
    world = edgegrad.World(np.full(3, 0.2))
    images: dict[str, edgegrad.Image] = {}
    lights: dict[str, edgegrad.PointLight | edgegrad.SunLight] = {}
    if light == "sky":
        world = edgegrad.World(np.ones(3))
    elif light == "image":
        world, images = edgegrad.World(np.ones(3), image="sky"), {"sky": edgegrad.Image(sky_image().astype(np.float32))}
    elif light == "area":
        meshes["lamp"] = rectangle(place, (0, 0, 0.4), (-0.4, 0, 0), "lamp")
        materials["lamp"] = glowing(8.0)
    elif light == "mesh":
        vertices, faces = shapes.ball(3, 0.3)
        meshes["lamp"] = edgegrad.Mesh(vertices + place, faces, ("lamp",))
        materials["lamp"] = glowing(8.0)
    elif light == "sphere":
        lights["lamp"] = edgegrad.PointLight(place, power=40.0, radius=0.3, sphere=True)
    elif light == "point":
        lights["lamp"] = edgegrad.PointLight(place, power=40.0)
    else:
        lights["lamp"] = edgegrad.SunLight(-place / np.linalg.norm(place), strength=2.0, angle=0.05)
    return edgegrad.Scene(
        camera((0, 0.9, 2.6), (0, -0.1, 0), SIZE, 0.5), meshes, materials, lights, world, images
    )


def noise(made: edgegrad.Scene, term: str, spp: int, seeds: int, what: str) -> float:
    """Root mean square over blocks of the standard deviation of their means."""
    path, tangent = f"meshes.{what}.vertices", np.zeros_like(made.meshes[what].vertices)
    tangent[:, 0] = 1.0
    terms = TERMS if term == "all" else (term,)
    renderer = Renderer(made)
    blocks = [
        block_sums(
            renderer.render_forward({path: tangent}, spp=spp, seed=seed, max_depth=MAX_DEPTH, terms=terms), BLOCK
        ) / BLOCK**2
        for seed in range(seeds)
    ]
    return float(np.sqrt(np.mean(np.var(blocks, axis=0, ddof=1))))
