"""Derivatives of rough refraction beside differences of pictures: a table.

A bent sheet of glass, seen aslant under an image of the sky, by index, roughness and what changes. Each cell has sums
over the picture of the derivative and of its central difference with common random numbers, and the root mean square
and the largest of the normal deviates of blocks of 8 x 8 pixels.

    python -m tests.benchmarks.rough_refraction [--seeds 8] [--spp 64] [--kinds REFRACTION GLASS PRINCIPLED]
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass

import numpy as np

from edgegrad import Renderer
from tests.support import block_statistics
from tests.support.scenes.gloss.rough_glass import PARAMETERS, changing, glass, under_sky
from tests.support.small_scenes import Floats, along, central_difference

IORS = (0.7, 1.05, 1.1, 1.4, 2.4)
ROUGHNESSES = (0.05, 0.3, 0.5, 0.8, 1.0)


@dataclass(frozen=True)
class Cell:
    """Sums over the picture, and the blocks' deviates."""

    derivative: float
    difference: float
    z: Floats


def cell(kind: str, what: str, ior: float, roughness: float, *, seeds: int, spp: int) -> Cell:
    """The derivative by one parameter beside its difference over an interval of the parameter."""
    # A roughness stays in its range, and sharp lobes turn fast.
    step = min(0.02, 0.2 * roughness)
    middle = min(roughness, 1.0 - 0.5 * step)
    moving = along(changing(lambda: under_sky(glass(kind, ior, middle)), what), [PARAMETERS[what]])
    difference, stderr = central_difference(moving, step, 8 * spp, seeds, "native", max_depth=2)
    samples = []
    for k in range(seeds):
        scene, tangent = moving(step * ((k + 0.5) / seeds - 0.5))
        samples.append(Renderer(scene).render_forward(tangent, spp=spp, seed=k, max_depth=2))
    outcome = block_statistics.compare(np.stack(samples), difference, stderr)
    return Cell(float(np.mean(samples)), float(np.mean(difference)), outcome.z)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--kinds", nargs="+", default=["REFRACTION", "GLASS", "PRINCIPLED"])
    parser.add_argument("--iors", nargs="+", type=float, default=IORS)
    parser.add_argument("--roughnesses", nargs="+", type=float, default=ROUGHNESSES)
    parser.add_argument("--parameters", nargs="+", choices=PARAMETERS, default=list(PARAMETERS))
    asked = parser.parse_args()
    write = sys.stdout.write
    write("derivative / difference (z of blocks: root mean square, largest)\n")
    scores: list[Floats] = []
    for kind in asked.kinds:
        for what in asked.parameters:
            write(f"\n{kind}, {what}: ior, by roughness {', '.join(map(str, asked.roughnesses))}\n")
            for ior in asked.iors:
                cells = [cell(kind, what, ior, r, seeds=asked.seeds, spp=asked.spp) for r in asked.roughnesses]
                scores += [c.z.reshape(-1) for c in cells]
                texts = [f"{c.derivative:8.4f} /{c.difference:8.4f} ({_rms(c.z):4.1f}, {np.abs(c.z).max():4.1f})"
                         for c in cells]  # fmt: skip
                write(f"  {ior:4.2f} {' '.join(texts)}\n")
                sys.stdout.flush()
    z = np.concatenate(scores)
    write(f"\nall {len(z)} blocks: root mean square {_rms(z):.2f}, largest {np.abs(z).max():.1f}\n")


def _rms(z: Floats) -> float:
    return float(np.sqrt(np.mean(np.square(z))))


if __name__ == "__main__":
    main()
