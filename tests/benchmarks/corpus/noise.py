"""Noise and cost of derivatives on the scenes of the comparison with Cycles, at their own depths.

``python -m tests.benchmarks.corpus.noise`` moves one object of each scene sideways, and writes a table (Markdown and
JSON): the noise of the derivative picture relative to the derivative, by term, and the seconds of a gradient relative
to those of a picture. Nothing is rendered with Cycles. A derivative picture of several seeds gives both numbers: the
seeds' spread is the noise, and their mean, less what the noise adds to its square, is the derivative.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad
from tests.benchmarks.agreement import BLOCK
from tests.benchmarks.corpus.exports import exported
from tests.benchmarks.corpus.objects import candidates, sideways
from tests.benchmarks.cycles_scenes import CASES
from tests.support.block_statistics import block_sums

SEEDS = 4
# Samples per pixel of the gradient and the picture whose seconds are compared.
TIMED_SAMPLES = 16
# The derivative is that by a shift of this part of the diagonal of the object's box.
SHIFT = 1.0


@dataclass
class Noise:
    """Noise of one scene's derivative at a number of samples: root mean squares relative to the derivative."""

    scene: str
    object: str
    depth: int
    pixels: float
    blocks: float
    terms: dict[str, float] = field(default_factory=dict)
    largest_pixel: float = 0.0
    backward: float = 0.0


def root_mean_square(pictures: NDArray[np.float64]) -> float:
    """Root mean square of what the (seeds, …) pictures estimate.

    If one sample is as large as all else, the mean's square less its variance says nothing: then it is that of the
    seeds' medians.
    """
    variance = float(pictures.var(axis=0, ddof=1).mean())
    square = float((pictures.mean(axis=0) ** 2).mean()) - variance / len(pictures)
    if square < variance / len(pictures):
        square = float((np.median(pictures, axis=0) ** 2).mean())
    return float(np.sqrt(max(square, 1e-30)))


def relative_noise(pictures: NDArray[np.float64]) -> float:
    """Noise of one of the (seeds, …) pictures over the root mean square of what they estimate."""
    return float(np.sqrt(pictures.var(axis=0, ddof=1).mean())) / root_mean_square(pictures)


def measure(name: str, samples: int, scale: float, depth: int | None) -> Noise | None:
    """Measure one scene, in a picture of `scale` times its size; None if no object of it is fit for it.

    `depth` is the number of path segments; None: the scene's own.
    """
    export = exported(CASES[name], scale)
    scene, limits = export.scene, export.settings
    found = candidates(scene)
    if not found:
        return None
    one = found[0]
    path = f"meshes.{one.name}.transform"
    tangent = np.zeros((4, 4))
    tangent[:3, 3] = sideways(scene, one, SHIFT)
    renderer = edgegrad.Renderer(scene)
    depth = depth or limits.max_depth
    options: dict[str, Any] = {"max_depth": depth, "bounces": limits.bounces}
    by_term = {term: np.stack([renderer.render_forward({path: tangent}, spp=samples, seed=seed, terms=[term], **options)
                               for seed in range(SEEDS)]).astype(np.float64)
               for term in edgegrad.TERMS}  # fmt: skip
    total = np.sum(list(by_term.values()), axis=0)
    blocks = block_sums(total, BLOCK)
    variance = total.var(axis=0, ddof=1).sum(axis=-1)
    derivative = root_mean_square(total)
    terms = {term: float(np.sqrt(pictures.var(axis=0, ddof=1).mean())) / derivative
             for term, pictures in by_term.items()}  # fmt: skip
    adjoint = np.ones((*scene.camera.size, 3), np.float32)
    seconds = []
    for run in (lambda: renderer.render(spp=TIMED_SAMPLES, **options),
                lambda: renderer.render_backward(adjoint, [path], spp=TIMED_SAMPLES, **options)):  # fmt: skip
        run()
        start = time.process_time()
        run()
        seconds.append(time.process_time() - start)
    return Noise(name, one.name, depth, relative_noise(total), relative_noise(blocks), terms,
                 float(variance.max() / max(variance.sum(), 1e-30)), seconds[1] / seconds[0])  # fmt: skip


def line(row: Noise) -> str:
    """A row of the table."""
    terms = " | ".join(f"{row.terms[term]:.3f}" for term in edgegrad.TERMS)
    return (f"| {row.scene} | {row.object} | {row.depth} | {row.pixels:.3f} | {row.blocks:.3f} | {terms} | "
            f"{row.largest_pixel:.0%} | {row.backward:.1f} |")


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", help=f"some of {', '.join(CASES)} (default: all)")
    parser.add_argument("--output", type=Path, default=Path("build/compare-cycles"), help="folder of the report")
    parser.add_argument("--scale", type=float, default=1.0, help="of the pictures' width and height")
    parser.add_argument("--depth", type=int, help="path segments (default: each scene's own)")
    parser.add_argument("--samples", type=int, default=512, help="samples per pixel of each of the seeds' pictures")
    arguments = parser.parse_args()
    output = arguments.output.resolve()
    output.mkdir(parents=True, exist_ok=True)
    rows: list[Noise] = []
    if unknown := [name for name in arguments.scenes if name not in CASES]:
        parser.error(f"unknown scene {unknown[0]}; there are {', '.join(CASES)}")
    for name in arguments.scenes or list(CASES):
        row = measure(name, arguments.samples, arguments.scale, arguments.depth)
        if row is not None:
            rows.append(row)
            print(line(row), flush=True)
    quiet = sum(row.pixels < 0.25 for row in rows)
    ratios = sorted(row.backward for row in rows)
    head = (f"{arguments.samples} samples per pixel. Noise below a quarter of the derivative in {quiet} of {len(rows)} "
            f"scenes; a gradient takes {np.median(ratios):.1f} pictures in the median, {ratios[-1]:.1f} at most.\n")
    names = " | ".join(edgegrad.TERMS)
    table = [f"| scene | object | depth | noise, pixels | noise, blocks | {names} | largest pixel's variance | "
             "gradient / picture |", "|" + "---|" * (7 + len(edgegrad.TERMS)), *map(line, rows)]
    text = "\n".join(["# Noise of derivatives by an object's shift, relative to the derivative\n", head, *table]) + "\n"
    print(text)
    (output / "corpus_noise.md").write_text(text)
    (output / "corpus_noise.json").write_text(json.dumps([asdict(row) for row in rows], indent=1))


if __name__ == "__main__":
    main()
