"""Noise of a body's shift where it is concave: ``python -m tests.benchmarks.contact_noise [name ...]``.

What is printed for each scene and depth: the noise of the derivative picture (the norm of its standard deviation over
seeds, relative to the norm of its mean) of the interior term and of all terms by samples per pixel, of central
differences with common random numbers, and the part of the interior term's variance that its noisiest pixel carries.
The norms are of 8 x 8 blocks. With a variance, noise falls to a half from one number of samples to the next.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad
from tests.support.block_statistics import block_sums
from tests.support.scenes.concave_bodies import RATE, SCENES

Floats = NDArray[np.float64]
EPS = 0.004


def relative_noise(pictures: Floats) -> float:
    """Noise of one picture's block sums by the norm of their mean, without its noise."""
    sums = np.array([block_sums(p) for p in pictures])
    variance = float(np.sum(np.var(sums, axis=0, ddof=1)))
    mean = float(np.sum(np.mean(sums, axis=0) ** 2)) - variance / len(sums)
    return float(np.sqrt(variance / max(mean, 1e-30)))


def sum_noise(pictures: Floats) -> float:
    """Root mean square of the noise of block sums."""
    return float(np.sqrt(np.mean(np.var(np.array([block_sums(p) for p in pictures]), axis=0, ddof=1))))


def noisiest(pictures: Floats) -> float:
    """The part of the variance that is one pixel's."""
    variance = np.sum(np.var(pictures, axis=0, ddof=1), axis=-1)
    return float(variance.max() / max(variance.sum(), 1e-30))


def forward(renderer: edgegrad.Renderer, rate: dict[str, Floats], seeds: int, **options: Any) -> Floats:
    """Derivative pictures of several seeds."""
    return np.array([renderer.render_forward(rate, seed=k, **options) for k in range(seeds)], np.float64)


def differences(name: str, seeds: int, **options: Any) -> Floats:
    """Central differences whose two pictures share their random numbers."""
    ends = []
    for theta in (-0.5 * EPS, 0.5 * EPS):
        scene = SCENES[name]()
        body = scene.meshes["body"]
        body.vertices = body.vertices + theta * RATE
        renderer = edgegrad.Renderer(scene)
        ends.append(np.array([renderer.render(seed=k, **options) for k in range(seeds)], np.float64))
    return np.asarray((ends[1] - ends[0]) / EPS)


def measure(name: str, depth: int, samples: list[int], seeds: int) -> str:
    """A row of the table."""
    scene = SCENES[name]()
    renderer = edgegrad.Renderer(scene)
    rate = {"meshes.body.vertices": np.broadcast_to(RATE, scene.meshes["body"].vertices.shape).copy()}
    whole = forward(renderer, rate, seeds, spp=samples[-1], max_depth=depth)
    mean = np.mean(np.array([block_sums(p) for p in whole]), axis=0)
    size = float(np.sqrt(max(np.mean(mean**2) - sum_noise(whole) ** 2 / seeds, 1e-30)))
    columns = []
    for spp in samples:
        inner = forward(renderer, rate, seeds, spp=spp, max_depth=depth, terms=("interior",))
        columns.append(f"{sum_noise(inner) / size:7.3f}")
    columns.append(f"| all {relative_noise(whole):7.3f} pixel {noisiest(inner):5.2f}")
    columns.append(f"| differences {relative_noise(differences(name, seeds, spp=samples[-1], max_depth=depth)):7.3f}")
    start = time.process_time()
    renderer.render(spp=64, max_depth=depth)
    picture = time.process_time() - start
    start = time.process_time()
    renderer.render_backward(np.ones((*scene.camera.size, 3), np.float32), list(rate), spp=64, max_depth=depth)
    columns.append(f"| backward/picture {(time.process_time() - start) / picture:5.1f}")
    return f"{name:>22} {depth} " + " ".join(columns)


def main() -> None:
    """Measure the scenes that are named, or all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--spp", type=int, nargs="+", default=[16, 64, 256])
    parser.add_argument("--depths", type=int, nargs="+", default=[2, 3, 5])
    parser.add_argument("--seeds", type=int, default=12)
    args = parser.parse_args()
    print("noise of blocks, interior term at", *args.spp, "samples")
    for name in args.names or SCENES:
        for depth in args.depths:
            print(measure(name, depth, args.spp, args.seeds), flush=True)


if __name__ == "__main__":
    main()
