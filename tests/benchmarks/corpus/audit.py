"""Derivatives of the scenes of the comparison with Cycles beside differences, by a random parameter of each.

``python -m tests.benchmarks.corpus.audit --seed 1 SCENE…`` exports each scene and draws parameters until it finds one
that changes the picture. Block sums of its derivative picture are compared with those of a central difference. A
comparison that raises an alarm is made again with other numbers and more samples; if it raises another one, the
derivative is wrong. The table says what the plan names there: an alarm where it names nothing is a silent error.

The difference is the derivative's mean over an interval of theta. So derivatives are taken at random places of that
interval, stratified, and blocks overlap (`windowed`).
"""

from __future__ import annotations

import argparse
import copy
import json
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

import edgegrad
from edgegrad import Renderer
from edgegrad.scene import parameters
from tests.benchmarks.corpus.exports import exported
from tests.benchmarks.corpus.random_changes import Change, changes
from tests.benchmarks.cycles_scenes import CASES
from tests.support import block_statistics
from tests.support.block_statistics import block_sums
from tests.support.small_scenes import Floats, Make, along

# Level of an alarm, in each of the two comparisons.
LEVEL = 1e-3
# Least mean change of the picture over the interval, relative to its mean, and the most parameters that are tried.
LEAST_CHANGE, TRIALS = 1e-4, 12
# Side of a block, and width of the borders in which pictures fade, in pixels.
BLOCK, FADE = 8, 4.0


@dataclass(frozen=True)
class Effort:
    """Numbers of samples of a comparison."""

    seeds: int
    derivative: int
    difference: int
    first_seed: int


FIRST, SECOND = Effort(10, 16, 32, 0), Effort(32, 48, 96, 100_000)


@dataclass(frozen=True)
class Comparison:
    """Probability of gaps as large as these if the derivative is right; their size and noise relative to it."""

    p_value: float
    error: float
    noise: float

    def __str__(self) -> str:
        return f"{self.p_value:.1e}: {self.error:.3f} ({self.noise:.3f})"


@dataclass
class Audit:
    """One scene's outcome."""

    scene: str
    path: str = ""
    first: Comparison | None = None
    second: Comparison | None = None
    missing: tuple[str, ...] = ()
    failure: str = ""
    seconds: float = 0.0

    @property
    def wrong(self) -> bool:
        """Whether both comparisons raised an alarm."""
        return self.second is not None and self.second.p_value < LEVEL


def changed(scene: edgegrad.Scene, change: Change, theta: float) -> edgegrad.Scene:
    """A copy of the scene with the parameter at theta."""
    copied = copy.deepcopy(scene)
    parameters.put(copied, change.path, change.value(theta))
    return copied


def visible_change(scene: edgegrad.Scene, seed: Sequence[int], options: dict[str, Any]) -> Change | None:
    """The first random change that is within all limits and that the picture shows."""
    drawn = changes(scene, np.random.default_rng(seed))
    for _, change in zip(range(TRIALS), drawn, strict=False):
        half = 0.5 * change.interval
        try:
            one, other = (Renderer(changed(scene, change, theta)).render(spp=4, seed=1, **options).astype(np.float64)
                          for theta in (-half, half))  # fmt: skip
            edgegrad.plan(scene, [change.path], max_depth=options["max_depth"])
        except ValueError:
            continue
        if np.abs(other - one).mean() > LEAST_CHANGE * np.abs(one).mean():
            return change
    return None


def windowed(pictures: Floats) -> Floats:
    """Pictures whose sums over blocks are sums over overlapping tents, and which fade towards their borders.

    A narrow feature that moves by part of a pixel then moves its weight a little, and never from one block to the next.
    """
    out = pictures
    for axis in (-3, -2):
        size = out.shape[axis]
        shape = [1] * out.ndim
        shape[axis] = size
        place = np.arange(size) + 0.5
        faded = out * np.minimum(np.minimum(place, size - place) / FADE, 1.0).reshape(shape)
        width = min(BLOCK, size)
        sums = np.cumsum(np.insert(faded, 0, 0.0, axis=axis), axis=axis)
        last = np.minimum(np.arange(size) + (width + 1) // 2, size)
        first = np.maximum(np.arange(size) - width // 2, 0)
        out = (np.take(sums, last, axis=axis) - np.take(sums, first, axis=axis)) / width
    return out


def compared(make: Make, change: Change, effort: Effort, options: dict[str, Any]) -> Comparison:
    """The derivative's sums beside those of the central difference, seed by seed."""
    rng = np.random.default_rng(effort.first_seed)
    moving = along(make, [change.path])
    ends = [Renderer(make(theta)) for theta in (0.5 * change.interval, -0.5 * change.interval)]
    derivatives, differences = [], []
    for k in range(effort.seeds):
        seed = effort.first_seed + k
        scene, tangent = moving(change.interval * ((k + rng.random()) / effort.seeds - 0.5))
        derivatives.append(Renderer(scene).render_forward(tangent, spp=effort.derivative, seed=seed, **options))
        ahead, behind = (end.render(spp=effort.difference, seed=seed + 1000, **options).astype(np.float64)
                         for end in ends)  # fmt: skip
        differences.append((ahead - behind) / change.interval)
    gaps = windowed(np.asarray(derivatives, np.float64) - np.asarray(differences))
    agreement = block_statistics.compare(gaps, np.zeros(gaps.shape[1:]))
    scale = float(np.linalg.norm(block_sums(windowed(np.mean(differences, axis=0))))) or 1.0
    return Comparison(agreement.p_value, agreement.error / scale, agreement.noise / scale)


def measure(name: str, seed: int, scale: float) -> Audit:
    """Audit one scene, in a picture of `scale` times its size."""
    export = exported(CASES[name], scale)
    scene, limits = export.scene, export.settings
    options: dict[str, Any] = {"max_depth": limits.max_depth, "bounces": limits.bounces}
    change = visible_change(scene, [seed, *name.encode()], options)
    row = Audit(name)
    if change is None:
        return row
    found = change
    start, row.path = time.process_time(), found.path

    def make(theta: float) -> edgegrad.Scene:
        return changed(scene, found, theta)

    row.first = compared(make, found, FIRST, options)
    if row.first.p_value < LEVEL:
        row.second = compared(make, found, SECOND, options)
        row.missing = edgegrad.plan(make(0.0), [found.path], **options).missing
    row.seconds = time.process_time() - start
    return row


def line(row: Audit) -> str:
    """A row of the table."""
    if row.first is None:
        return f"| {row.scene} | {row.failure or 'nothing that it shows'} | | | |"
    told = "" if not row.wrong else "; ".join(row.missing) or "**nothing**"
    return f"| {row.scene} | {row.path} | {row.first} | {row.second or ''} | {told} |"


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", help=f"some of {', '.join(CASES)} (default: all)")
    parser.add_argument("--seed", type=int, default=1, help="of the parameters that are drawn")
    parser.add_argument("--scale", type=float, default=0.3, help="of the pictures' width and height")
    parser.add_argument("--log", type=Path, help="JSON lines, one a scene; scenes that it has are left out")
    arguments = parser.parse_args()
    if unknown := [name for name in arguments.scenes if name not in CASES]:
        parser.error(f"unknown scene {unknown[0]}; there are {', '.join(CASES)}")
    log: Path | None = arguments.log
    known = {json.loads(one)["scene"] for one in log.read_text().splitlines()} if log and log.exists() else set()
    print("| scene | parameter | p: error (noise) | second comparison | the plan names |\n|---|---|---|---|---|")
    rows = []
    for name in arguments.scenes or list(CASES):
        if name in known:
            continue
        try:
            row = measure(name, arguments.seed, arguments.scale)
        except (ValueError, RuntimeError) as error:
            row = Audit(name, failure=f"{type(error).__name__}: {error}")
        rows.append(row)
        print(line(row), flush=True)
        if log:
            with log.open("a") as file:
                file.write(json.dumps(asdict(row)) + "\n")
    silent = sum(row.wrong and not row.missing for row in rows)
    print(f"\n{len(rows)} scenes, {sum(row.second is not None for row in rows)} first alarms, "
          f"{sum(row.wrong for row in rows)} confirmed, of which the plan names nothing in {silent}.")  # fmt: skip


if __name__ == "__main__":
    main()
