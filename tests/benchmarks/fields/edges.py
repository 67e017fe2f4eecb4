"""Estimators of outlines beside each other, and beside edges of a mesh.

``python -m tests.benchmarks.fields.edges`` prints, for the derivative of the picture of a torus (24 x 24 pixels, 16
samples) by all that moves it along one axis, CPU seconds x (variance + squared bias) of samples of the outlines, of the
warped picture and of relaxed bands; once with the outline alone (paths of one segment before a textured sheet) and once
with shading and shadows.

``--talk FILE`` compares edge sampling on a mesh with reparameterisation on a field: the same torus, camera and light,
at 1, 16, 128 and 1024 samples per pixel. It prints relative errors and CPU seconds, and draws them.

Errors are those of sums over 4 x 4 pixels relative to a reference with many samples of outlines, without its noise.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from edgegrad import AreaLight, Renderer, Scene, World
from edgegrad.rendering.options import FIELD_EDGES
from tests.benchmarks.fields.__main__ import torus_mesh
from tests.support.fields.splines import sampled, torus
from tests.support.small_scenes import camera, matte, rectangle

F64 = NDArray[np.float64]
SIZE, BLOCK, AXIS = 24, 4, np.array([0.6, 0.5, 0.62])


class Case(NamedTuple):
    """A scene with the tangent of the torus's motion."""

    scene: Scene
    tangent: Mapping[str, Any]
    depth: int


def field_case(depth: int, coefficients: int = 64) -> Case:
    """The torus as a field."""
    scene = replace(base(depth), fields={"torus": sampled(torus, coefficients)})
    tangent = np.zeros((4, 4))
    tangent[:3, 3] = AXIS
    return Case(scene, {"fields.torus.transform": tangent}, depth)


def mesh_case(depth: int, triangles: int = 50_000) -> Case:
    """The torus as a smooth mesh."""
    scene = base(depth)
    mesh = torus_mesh(triangles)
    scene = replace(scene, meshes={**scene.meshes, "torus": mesh})
    return Case(scene, {"meshes.torus.vertices": np.broadcast_to(AXIS, mesh.vertices.shape)}, depth)


def base(depth: int) -> Scene:
    """A sky alone, or a floor in the light of a rectangle."""
    seen_by = camera((0.3, -1.6, 1.8), (0, 0, 0), SIZE, 0.8, up=(0, 0, 1))
    materials = {"clay": matte(0.7, 0.6, 0.5), "floor": matte(0.5, 0.5, 0.5)}
    if depth == 1:
        return Scene(seen_by, materials=materials, world=World(np.array([0.3, 0.6, 1.0])))
    to_world = np.eye(4)
    to_world[:3, 3] = 0.5, 0.5, 3.0
    return Scene(seen_by, {"floor": rectangle((0, 0, -0.3), (3, 0, 0), (0, 3, 0), "floor")}, materials,
                 {"lamp": AreaLight(to_world, power=100.0)}, World(np.full(3, 0.1)))


def blocks(picture: F64) -> F64:
    """Sums over blocks of pixels."""
    n = SIZE // BLOCK
    return picture.reshape(n, BLOCK, n, BLOCK, 3).sum(axis=(1, 3))


def pictures(case: Case, spp: int, seeds: int, edges: str, first: int = 0) -> tuple[F64, float]:
    """Derivatives of several seeds as sums over blocks, and CPU seconds of each."""
    renderer = Renderer(case.scene)
    call: Callable[[int], Any] = lambda seed: renderer.render_forward(  # noqa: E731
        case.tangent, spp=spp, seed=seed, max_depth=case.depth, field_edges=edges)
    call(first)
    start = time.process_time()
    found = np.stack([blocks(call(first + k).astype(float)) for k in range(seeds)])
    return found, (time.process_time() - start) / seeds


def error(found: F64, reference: F64, noise: float) -> float:
    """Relative error of single derivatives, without the noise of the reference."""
    square = float(np.mean(np.sum((found - reference) ** 2, axis=(1, 2, 3)))) - noise
    return float(np.sqrt(max(square, 0.0) / np.sum(reference**2)))


def reference_of(case: Case, spp: int, seeds: int) -> tuple[F64, float]:
    """A derivative by samples of outlines, and the variance of its sum."""
    found, _ = pictures(case, spp, seeds, FIELD_EDGES[0], 10_000)
    return found.mean(axis=0), float(np.sum(found.var(axis=0, ddof=1)) / seeds)


def compare(depth: int, spp: int = 16, seeds: int = 24) -> None:
    """Print the three estimators beside each other."""
    case = field_case(depth)
    reference, noise = reference_of(case, 256, 12)
    norm = float(np.sum(reference**2))
    for edges in FIELD_EDGES:
        found, seconds = pictures(case, spp, seeds, edges)
        variance = float(np.sum(found.var(axis=0, ddof=1))) / norm
        square = float(np.sum((found.mean(axis=0) - reference) ** 2)) / norm - variance / seeds - noise / norm
        bias = float(np.sqrt(max(square, 0.0)))
        allowed = float(np.sqrt(variance / seeds + noise / norm))
        print(f"depth {depth}, {edges:16} {seconds:.3f} s, variance {variance:.5f}, bias {bias:.3f} "
              f"(noise {allowed:.3f}), seconds x error {seconds * (variance + bias**2):.6f}", flush=True)


def talk(path: Path, depth: int = 2) -> None:
    """Print and draw errors over seconds of edges of a mesh and of a warp about a field."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(5.5, 3.8), layout="constrained")
    made = {"edges of a mesh": (mesh_case(depth), FIELD_EDGES[0]),
            "warp about a field": (field_case(depth), "reparameterised"),
            "outlines of a field": (field_case(depth), FIELD_EDGES[0])}
    references = {name: reference_of(case, 512, 6) for name, (case, _) in made.items() if not name.startswith("warp")}
    references["warp about a field"] = references["outlines of a field"]
    for name, (case, edges) in made.items():
        reference, noise = references[name]
        rows = []
        for spp, seeds in ((1, 32), (16, 16), (128, 6), (1024, 2)):
            found, seconds = pictures(case, spp, seeds, edges)
            rows.append((seconds, error(found, reference, noise)))
            print(f"{name:20} {spp:5} samples: {seconds:7.3f} s, error {rows[-1][1]:.4f}", flush=True)
        axes.loglog(*zip(*rows, strict=True), "o-", label=name)
    axes.set_xlabel("CPU seconds")
    axes.set_ylabel("relative error of the derivative")
    axes.legend(fontsize=8)
    figure.savefig(path, dpi=110)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--talk", type=Path, help="draw the comparison with a mesh to this file")
    parser.add_argument("--depth", type=int, nargs="*", default=(1, 2), help="path segments of the scenes")
    given = parser.parse_args()
    if given.talk:
        talk(given.talk)
        return
    for depth in given.depth:
        compare(depth)


if __name__ == "__main__":
    main()
