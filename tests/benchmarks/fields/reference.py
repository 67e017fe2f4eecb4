"""Derivatives of fields beside the published figures of a warp: ``python -m tests.benchmarks.fields.reference``.

The reference is the implementation of Vicini et al. 2022 on Mitsuba 3.3 (LLVM). Its figures stand below: CPU seconds of
pictures and gradients, relative variances and biases. They were measured once, elsewhere: on a machine of the same kind
with two cores, under load. Here the same kinds of scene are measured with Edgegrad, and its CPU seconds x variance are
divided by the reference's. The scenes' cameras, lights and colours are not those of the reference, which are not
published, so that the quotients are accurate to a small factor.

Seconds are those of a gradient by all coefficients (backward) and of the derivative picture of a shift along x
(forward) at the sizes of the reference, with 16 samples of each pixel. The relative variance is that of single pixels
of that derivative picture at 64 x 64 pixels and 16 samples: the sum of the variances over the sum of squares of the
derivative. Biases are those of sums over 8 x 8 pixels, against central differences, without the noise of both.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from edgegrad import AreaLight, Field, Image, Renderer, Scene, World
from tests.support.block_statistics import block_sums
from tests.support.fields.splines import sampled, torus
from tests.support.small_scenes import camera, matte, rectangle

F64 = NDArray[np.float64]
SPP, SIZE, STEP = 16, 64, 0.01


class Quality(NamedTuple):
    """Figures of the reference at 64 x 64 pixels: bias, its noise, and relative variance."""

    bias: float
    noise: float
    variance: float


class Seconds(NamedTuple):
    """CPU seconds of the reference for a field of grid^3 coefficients and a picture of `picture`^2 pixels."""

    grid: int
    picture: int
    primal: float
    backward: float
    forward: float


class Case(NamedTuple):
    """A scene of the reference's tables, with its figures."""

    name: str
    shape: str
    light: str
    depth: int
    quality: Quality
    seconds: tuple[Seconds, ...]


ENVIRONMENT = (Seconds(64, 128, 0.33, 0.95, 0.82), Seconds(64, 256, 0.78, 2.74, 2.41),
               Seconds(128, 128, 0.32, 1.00, 0.84), Seconds(128, 256, 0.87, 3.09, 2.89))
CASES = (
    Case("sphere, environment", "sphere", "environment", 2, Quality(0.025, 0.016, 0.71), ENVIRONMENT),
    Case("torus, environment", "torus", "environment", 2, Quality(0.054, 0.038, 0.85), ENVIRONMENT),
    Case("torus and floor, area light", "torus", "area", 2, Quality(0.082, 0.024, 0.13),
         (Seconds(128, 256, 0.96, 3.62, 3.08),)),
    Case("the same with indirect light", "torus", "area", 3, Quality(0.287, 0.026, 0.25),
         (Seconds(64, 128, 0.63, 2.59, 2.21), Seconds(128, 256, 2.72, 12.5, 9.6))),
)


def shape(name: str, coefficients: int) -> Field:
    """The reference's shapes: a sphere, or a torus."""
    if name == "sphere":
        return sampled(lambda p: np.linalg.norm(p, axis=-1) - 0.6, coefficients)
    return sampled(torus, coefficients)


def sky() -> Image:
    """A sky that is brighter above, and brightest around a sun."""
    v, u = np.meshgrid((np.arange(32) + 0.5) / 32, (np.arange(64) + 0.5) / 64, indexing="ij")
    sun = np.exp(-((u - 0.3) ** 2 + (v - 0.7) ** 2) / 0.02)
    return Image((0.2 + 0.6 * v + 4.0 * sun)[..., None] * np.array([0.9, 1.0, 1.1]))


def scene(case: Case, coefficients: int, pixels: int, shift: float = 0.0) -> Scene:
    """A case's scene with its shape moved along x."""
    seen_by = camera((0.3, -1.6, 1.8), (0, 0, 0), pixels, 0.8, up=(0, 0, 1))
    materials = {"clay": matte(0.7, 0.6, 0.5), "floor": matte(0.5, 0.5, 0.5)}
    pose = np.eye(4)
    pose[0, 3] = shift
    fields = {"shape": replace(shape(case.shape, coefficients), transform=pose)}
    if case.light == "environment":
        return Scene(seen_by, materials=materials, world=World(np.ones(3), image="sky"), images={"sky": sky()},
                     fields=fields)
    to_world = np.eye(4)
    to_world[:3, 3] = 0.5, 0.5, 3.0
    return Scene(seen_by, {"floor": rectangle((0, 0, -0.3), (3, 0, 0), (0, 3, 0), "floor")}, materials,
                 {"lamp": AreaLight(to_world, power=100.0)}, fields=fields)


def tangent() -> dict[str, Any]:
    """The shift along x."""
    moved = np.zeros((4, 4))
    moved[0, 3] = 1.0
    return {"fields.shape.transform": moved}


def cpu_seconds(call: Callable[[], object], turns: int = 5) -> float:
    """The median CPU seconds of a call, of all threads."""
    call()
    seconds = []
    for _ in range(turns):
        start = time.process_time()
        call()
        seconds.append(time.process_time() - start)
    return float(np.median(seconds))


def quality(case: Case, seeds: int, grid: int = 64) -> Quality:
    """Bias against central differences, its noise, and the relative variance of pixels."""
    renderer = Renderer(scene(case, grid, SIZE))
    found = np.stack([renderer.render_forward(tangent(), spp=SPP, seed=seed, max_depth=case.depth).astype(float)
                      for seed in range(seeds)])
    ends = [Renderer(scene(case, grid, SIZE, by)) for by in (STEP, -STEP)]
    # Both ends have the same numbers: what they see alike has no noise
    differences = np.stack([
        np.subtract(*(end.render(spp=64 * SPP, seed=1000 + seed, max_depth=case.depth).astype(float) for end in ends))
        for seed in range(max(4, seeds // 4))]) / (2.0 * STEP)
    spread = found.var(axis=0, ddof=1)
    # The square of the mean has the mean's variance too much
    size = float(np.sum(found.mean(axis=0) ** 2 - spread / seeds))
    ours, reference = block_sums(found), block_sums(differences)
    noise2 = float(sum(np.sum(each.var(axis=0, ddof=1)) / len(each) for each in (ours, reference)))
    mean = reference.mean(axis=0)
    norm2 = float(np.sum(mean**2))
    square = float(np.sum((ours.mean(axis=0) - mean) ** 2)) - noise2
    return Quality(float(np.sqrt(max(square, 0.0) / norm2)), float(np.sqrt(noise2 / norm2)),
                   float(np.sum(spread)) / size)


def measure(case: Case, seeds: int) -> None:
    """Print a case's rows."""
    ours, theirs = quality(case, seeds), case.quality
    print(f"{case.name}: variance {ours.variance:.4f} (reference {theirs.variance}), bias {ours.bias:.3f} +- "
          f"{ours.noise:.3f} (reference {theirs.bias} +- {theirs.noise})", flush=True)
    for row in case.seconds:
        renderer = Renderer(scene(case, row.grid, row.picture))
        options: dict[str, Any] = {"spp": SPP, "max_depth": case.depth}
        adjoint = np.ones((row.picture, row.picture, 3), np.float32)
        calls: dict[str, Callable[[], object]] = {
            "primal": lambda r=renderer, o=options: r.render(**o),  # type: ignore[misc]
            "backward": lambda r=renderer, o=options, a=adjoint: r.render_backward(  # type: ignore[misc]
                a, ["fields.shape.values"], **o),
            "forward": lambda r=renderer, o=options: r.render_forward(tangent(), **o),  # type: ignore[misc]
        }
        seconds = {name: cpu_seconds(call) for name, call in calls.items()}
        fewer = {name: getattr(row, name) * theirs.variance / (seconds[name] * ours.variance)
                 for name in ("backward", "forward")}
        print(f"  {row.grid}^3 / {row.picture}^2: " + ", ".join(
            f"{name} {seconds[name]:.3f} s ({getattr(row, name)})" for name in seconds)
            + f"; seconds x variance of the reference over ours: backward {fewer['backward']:.0f}, "
              f"forward {fewer['forward']:.0f}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=64, help="derivative pictures of each case")
    parser.add_argument("--case", type=int, nargs="*", default=range(len(CASES)), help="numbers of cases")
    given = parser.parse_args()
    for number in given.case:
        measure(CASES[number], given.seeds)


if __name__ == "__main__":
    main()
