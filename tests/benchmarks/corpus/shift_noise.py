"""Noise of one object's shift in the scenes of the comparison with Cycles.

``python -m tests.benchmarks.corpus.shift_noise`` exports each scene and shifts the mesh whose shift changes the
picture most, at the scene's own depth. It prints the noise of block sums (8 x 8 pixels) relative to the derivative, of
all terms and of each, and of differences with common random numbers; the fraction of the interior term's variance that
one pixel carries; and the seconds of a gradient relative to those of a picture.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Mapping
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad_addon.export import export_scene
from tests.benchmarks import cycles_peer
from tests.benchmarks.contact_noise import forward, noisiest, sum_noise
from tests.benchmarks.cycles_scenes import CASES, Case, stage
from tests.support.block_statistics import block_sums

Floats = NDArray[np.float64]
MOST_MESHES = 6
DIRECTION = np.array([1.0, 0.4, 0.25])


def exported(case: Case, scale: float) -> Any:
    """The case's scene and settings, in a smaller picture."""
    scene = stage.empty()
    case.build()
    cycles_peer.prepare(scene, case.samples, case.bounces, case.limits)
    scene.render.resolution_percentage = round(100 * scale)
    return export_scene(bpy.context.scene, bpy.context.evaluated_depsgraph_get())


def shift(scene: edgegrad.Scene, name: str) -> dict[str, Floats]:
    """A tangent of all vertices of a mesh, by a hundredth of the scene's size per unit."""
    vertices = np.asarray(scene.meshes[name].vertices)
    return {f"meshes.{name}.vertices": np.broadcast_to(DIRECTION, vertices.shape).copy()}


def most_visible(renderer: edgegrad.Renderer, scene: edgegrad.Scene, options: Mapping[str, Any]) -> str:
    """The mesh whose shift changes the picture most, of the first few without the largest, which is the ground."""
    extent = {name: float(np.ptp(np.asarray(m.vertices), axis=0).max()) for name, m in scene.meshes.items()}
    ground = max(extent, key=lambda name: extent[name])
    sizes = {}
    for name in [n for n in scene.meshes if n != ground or len(extent) == 1][:MOST_MESHES]:
        pictures = forward(renderer, shift(scene, name), 3, spp=8, **options)
        sizes[name] = float(np.sum(np.abs(np.median(pictures, axis=0))))
    return max(sizes, key=lambda name: sizes[name])


def differences(export: Any, name: str, seeds: int, eps: float, **options: Any) -> Floats:
    """Central differences with common random numbers."""
    mesh = export.scene.meshes[name]
    start, ends = mesh.vertices, []
    for step in (-0.5 * eps, 0.5 * eps):
        mesh.vertices = start + step * DIRECTION
        renderer = edgegrad.Renderer(export.scene)
        ends.append(np.array([renderer.render(seed=k, **options) for k in range(seeds)], np.float64))
    mesh.vertices = start
    return np.asarray((ends[1] - ends[0]) / eps)


def measure(case: Case, spp: int, seeds: int, scale: float) -> str:
    """A row of the table."""
    export = exported(case, scale)
    scene, limits = export.scene, export.settings
    options = {"max_depth": limits.max_depth, "bounces": limits.bounces}
    renderer = edgegrad.Renderer(scene)
    name = most_visible(renderer, scene, options)
    rate = shift(scene, name)
    by_term = {t: forward(renderer, rate, seeds, spp=spp, terms=(t,), **options) for t in edgegrad.TERMS}
    whole = np.sum(list(by_term.values()), axis=0)
    noise = sum_noise(whole)
    mean = np.mean(np.array([block_sums(p) for p in whole]), axis=0)
    size = float(np.sqrt(max(np.mean(mean**2) - noise**2 / seeds, 1e-30)))
    terms = " ".join(f"{t} {sum_noise(p) / size:6.3f}" for t, p in by_term.items())
    eps = 0.002 * float(np.ptp(np.asarray(scene.meshes[name].vertices), axis=0).max())
    found = sum_noise(differences(export, name, seeds, eps, spp=spp, **options)) / size
    start = time.process_time()
    renderer.render(spp=spp, **options)
    picture = time.process_time() - start
    start = time.process_time()
    height, width = scene.camera.size
    renderer.render_backward(np.ones((height, width, 3), np.float32), list(rate), spp=spp, **options)
    return (f"{case.name:>24} {limits.max_depth:2} {name[:16]:>16} all {noise / size:7.3f} {terms} "
            f"pixel {noisiest(by_term['interior']):4.2f} differences {found:6.3f} "
            f"backward/picture {(time.process_time() - start) / picture:5.1f}")


def main() -> None:
    """Measure the scenes that are named, or all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--spp", type=int, default=512)
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--scale", type=float, default=0.5, help="of the pictures' sides")
    args = parser.parse_args()
    for name in args.names or CASES:
        try:
            print(measure(CASES[name], args.spp, args.seeds, args.scale), flush=True)
        except (ValueError, RuntimeError) as error:  # a scene that fails is a row of the report
            print(f"{name:>24} {type(error).__name__}: {error}", flush=True)


if __name__ == "__main__":
    main()
