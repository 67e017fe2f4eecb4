"""Gradients within a fit, beside Mitsuba 3's: seconds x variance of the gradient at iteration 1, 5, 20 and 100.

``python -m tests.benchmarks.within_fit`` takes the reference cases through a fit of 100 iterations: each takes a step
of the case's parameter towards its own value, then the gradient of an image loss. Edgegrad learns from each gradient
for the next ones (`edgegrad.Renderer`, ``learn=True``) and is measured without learning, too; Mitsuba learns within
each call whatever its best setting for the case learns (`derivatives.Case.best_setting`), so that its iterations are
alike. Several fits with other seeds go along the same steps: the variance is that from fit to fit.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad
from tests.benchmarks.derivatives import Case, find_cases, spread
from tests.support import peer_scenes
from tests.support.reference_files import FOLDERS

F64 = NDArray[np.float64]

CASES = (
    "shadow_occluder", "shadow_light", "blob_flat", "dense_200k", "camera_move", "glossy_emitter", "tri_background",
    "two_triangles",
)
ITERATIONS = 100
# Iterations (from 1 on) whose variances and seconds are averaged for the report.
WINDOWS = {1: (1, 1), 5: (4, 6), 20: (17, 23), 100: (85, 100)}
# Those of a renderer that doesn't learn: they are alike.
FORGETTING = 8
# The parameter's way during a fit, in widths of the case's central difference.
WAY = 1.0


class Fits:
    """Fits of one case along the same steps, with other seeds."""

    def __init__(self, path: Path, spp: int, threads: int, learn: bool) -> None:
        self.data, self.arrays = peer_scenes.read(path)
        self.eps = float(self.data["parameter"]["eps"])
        self.depth, self.spp, self.threads, self.learn = int(self.data["max_depth"]), spp, threads, learn
        image = self.arrays["image"].astype(np.float64)
        self.adjoint = (2.0 * (image - image.mean()) / image.size).astype(np.float32)

    def run(self, fit: int, iterations: int) -> tuple[list[float], list[F64]]:
        """Seconds and gradient of each iteration of a fit."""
        scene, tangent = peer_scenes.at_theta(self.data, 0.0)
        start = {path: edgegrad.parameters.get(scene, path) for path in tangent}
        renderer = edgegrad.Renderer(scene, threads=self.threads, engine="native", learn=self.learn)
        renderer.find_edges()
        seconds, gradients = [], []
        for k in range(iterations):
            theta = WAY * self.eps * (1.0 - (k + 1) / ITERATIONS)
            begin = time.process_time()
            for path, value in start.items():
                edgegrad.parameters.put(scene, path, value + theta * tangent[path])
            renderer.update(list(tangent))
            found = renderer.render_backward(
                self.adjoint, list(tangent), spp=self.spp, max_depth=self.depth, seed=1000 * fit + k
            )
            seconds.append(time.process_time() - begin)
            gradients.append(np.concatenate([found[path].ravel() for path in tangent]))
        return seconds, gradients


def windows(
    fits: list[tuple[list[float], list[F64]]], averaged: dict[int, tuple[int, int]]
) -> dict[int, tuple[float, float]]:
    """CPU seconds and relative variance of a gradient, by iteration."""
    out = {}
    for told, (first, last) in averaged.items():
        if last > len(fits[0][0]):
            continue
        seconds, variances = [], []
        for k in range(first - 1, last):
            variance, norm = spread([gradients[k] for _, gradients in fits])
            seconds.append(float(np.min([times[k] for times, _ in fits])))
            variances.append(variance / norm)
        out[told] = float(np.mean(seconds)), float(np.mean(variances))
    return out


def measure(path: Path, spp: int, threads: int, count: int, iterations: int) -> dict[str, Any]:
    """Both ways of one case; {way: {iteration: (seconds, variance)}}."""
    learning, forgetting = (Fits(path, spp, threads, learn) for learn in (True, False))
    turns: dict[str, list[Any]] = {"learning": [], "not": []}
    for fit in range(1, count + 1):
        turns["learning"].append(learning.run(fit, iterations))
        turns["not"].append(forgetting.run(fit, FORGETTING))
    # Gradients of one value have but as many numbers as there are fits: all iterations tell of their variance.
    return {
        "learning": windows(turns["learning"], WINDOWS),
        "not": windows(turns["not"], {FORGETTING: (1, FORGETTING)}),
    }


def peer(path: Path, spp: int, threads: int, every: bool) -> tuple[str, float, float] | None:
    """Mitsuba's best setting, and CPU seconds and variance of its gradient; None where it has none."""
    case = Case(path, threads)
    setting = case.best_setting(spp, every)
    side = case.theirs(spp, setting)
    if side.backward is None:
        return None
    begin, gradients = time.process_time(), []
    for seed in range(8):
        gradients.append(side.backward(seed + 1))
    variance, norm = spread(gradients)
    return setting, (time.process_time() - begin) / 8, variance / norm


def table(results: dict[str, dict[str, Any]]) -> str:
    """The results as Markdown."""
    told = list(WINDOWS)
    lines = ["| case | seconds x variance without learning | " + " | ".join(f"iteration {k}" for k in told)
             + " | Mitsuba's |", "|---" * (len(told) + 3) + "|"]
    gains: dict[int, list[float]] = {k: [] for k in told}
    for name, found in results.items():
        seconds, variance = found["not"][FORGETTING]
        cells = []
        for k in told:
            s, v = found["learning"].get(k, (np.nan, np.nan))
            cells.append(f"{s / seconds:.2f} x {v / variance:.2g} = {s * v / (seconds * variance):.2g}")
            gains[k].append(s * v / (seconds * variance))
        theirs = found["peer"]
        last = found["learning"].get(told[-1])
        right = "" if theirs is None else f"{theirs[1]:.2f} s, {theirs[0]}"
        if theirs is not None and last is not None:
            right += f": {theirs[1] * theirs[2] / (last[0] * last[1]):.2g} x as much as ours at last"
        lines.append(f"| `{name}` | {seconds:.3f} s x {variance:.2g} | " + " | ".join(cells) + f" | {right} |")
    means = [f"{np.exp(np.mean(np.log(gains[k]))):.2g}" for k in told]
    lines.append("| geometric mean | | " + " | ".join(means) + " | |")
    return "\n".join(lines)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="*", help=f"reference cases (default: {', '.join(CASES)})")
    parser.add_argument("--spp", type=int, default=16)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--fits", type=int, default=6, help="with other seeds, at least 2")
    parser.add_argument("--iterations", type=int, default=ITERATIONS)
    parser.add_argument("--alone", action="store_true", help="without Mitsuba")
    parser.add_argument("--all-settings", action="store_true", help="also Mitsuba's default guiding, which is slow")
    parser.add_argument("--output", type=Path, default=Path("build/benchmarks"), help="folder of the report")
    arguments = parser.parse_args()
    known = {path.stem: path for folder in FOLDERS for path in sorted(Path(folder).glob("*.npz"))}
    if unknown := [name for name in arguments.cases if name not in known]:
        parser.error(f"unknown case {unknown[0]}; there are {', '.join(known)}")
    results: dict[str, dict[str, Any]] = {}
    for name in arguments.cases or CASES:
        found = measure(known[name], arguments.spp, arguments.threads, max(2, arguments.fits), arguments.iterations)
        has_peer = not arguments.alone and name in find_cases()
        found["peer"] = (
            peer(known[name], arguments.spp, arguments.threads, arguments.all_settings) if has_peer else None
        )
        results[name] = found
        print(table({name: found}).splitlines()[2], flush=True)
    arguments.output.mkdir(parents=True, exist_ok=True)
    (arguments.output / "within_fit.json").write_text(json.dumps(results, indent=1))
    text = table(results)
    (arguments.output / "within_fit.md").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
