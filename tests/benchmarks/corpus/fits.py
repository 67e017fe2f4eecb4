"""Fits to pictures by Cycles, on the scenes of the comparison with Cycles: is what was changed found again?

``python -m tests.benchmarks.corpus.fits`` opens each scene, exports it, changes the base colour of one object, or moves
the object sideways, and fits colour or transform to Cycles' picture. The target holds all differences between the two
renderers, so this measures fits as users see them. It writes a table (Markdown and JSON).
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad.scene import parameters
from edgegrad_addon.export import RenderSettings
from tests.benchmarks import versus_cycles
from tests.benchmarks.corpus.objects import Candidate, candidates, colored, sideways
from tests.benchmarks.cycles_scenes import CASES

ITERATIONS, SAMPLES = 50, 16
# What counts as found.
COLOR_ERROR, SHIFT_ERROR = 0.05, 0.2
# The start: the distance from the true colour, and the shift as a part of the diagonal of the object's box.
COLOR_CHANGE, SHIFT = 0.3, 0.15


@dataclass
class Outcome:
    """One fit. Errors: largest difference of a channel, or the distance of the centres over the shift."""

    scene: str
    object: str
    share: float
    kind: str
    before: float
    after: float
    seconds: float

    @property
    def found(self) -> bool:
        """Whether the error is below the limit of its kind."""
        return self.after <= (COLOR_ERROR if self.kind == "color" else SHIFT_ERROR)


def fit_color(
    scene: edgegrad.Scene, limits: RenderSettings, target: NDArray[np.float32], path: str
) -> tuple[float, float]:
    """Change a colour and fit it; returns the largest error of a channel before and after."""
    truth = np.array(parameters.get(scene, path), np.float64)
    start = np.where(truth > 0.5, truth - COLOR_CHANGE, truth + COLOR_CHANGE)
    parameters.put(scene, path, start)
    _fit(scene, limits, target, path)
    return float(np.abs(start - truth).max()), float(np.abs(parameters.get(scene, path) - truth).max())


def fit_transform(
    scene: edgegrad.Scene, limits: RenderSettings, target: NDArray[np.float32], one: Candidate
) -> tuple[float, float]:
    """Move an object sideways and fit its transform; returns the distance of its centre, over the shift's length."""
    path = f"meshes.{one.name}.transform"
    truth = np.array(parameters.get(scene, path), np.float64)
    shift = sideways(scene, one, SHIFT)
    start = truth.copy()
    start[:3, 3] += shift
    parameters.put(scene, path, start)
    _fit(scene, limits, target, path)
    # The centre as the true transform places it; it is in world space, where the exported transform starts.
    centre = np.append(0.5 * (one.low + one.high), 1.0)
    moved = parameters.get(scene, path) @ np.linalg.inv(truth) @ centre
    return 1.0, float(np.linalg.norm(moved[:3] - centre[:3]) / np.linalg.norm(shift))


def _fit(scene: edgegrad.Scene, limits: RenderSettings, target: NDArray[np.float32], path: str) -> None:
    edgegrad.fit(scene, target, wrt=[path], iterations=ITERATIONS, spp=SAMPLES, max_depth=limits.max_depth,
                 bounces=limits.bounces)  # fmt: skip


def run(name: str, output: Path) -> list[Outcome]:
    """Fit colour and transform of one object of a scene; empty if no object is fit for it."""
    case = CASES[name]
    theirs, _ = versus_cycles.by_cycles(case, output, case.samples, versus_cycles.SEEDS)
    target = np.asarray(theirs.mean(axis=0, dtype=np.float64), np.float32)
    outcomes = []
    for kind in ("color", "transform"):
        exported = versus_cycles.exported()
        for one in candidates(exported.scene):
            path = colored(exported.scene, one)
            if kind == "color" and path is None:
                continue
            start = time.perf_counter()
            if kind == "color":
                assert path is not None
                errors = fit_color(exported.scene, exported.settings, target, path)
            else:
                errors = fit_transform(exported.scene, exported.settings, target, one)
            outcomes.append(Outcome(name, one.name, one.share, kind, *errors, time.perf_counter() - start))
            break
    return outcomes


def line(outcome: Outcome) -> str:
    """A row of the table."""
    return (f"| {outcome.scene} | {outcome.object} | {outcome.share:.0%} | {outcome.kind} | {outcome.before:.3f} | "
            f"{outcome.after:.3f} | {outcome.seconds:.0f} | {'found' if outcome.found else '**missed**'} |")


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", help=f"some of {', '.join(CASES)} (default: all)")
    parser.add_argument("--output", type=Path, default=Path("build/compare-cycles"), help="folder of the report")
    arguments = parser.parse_args()
    output = arguments.output.resolve()
    output.mkdir(parents=True, exist_ok=True)
    outcomes: list[Outcome] = []
    for name in arguments.scenes or list(CASES):
        for outcome in run(name, output):
            outcomes.append(outcome)
            print(line(outcome), flush=True)
    counts = [f"{sum(o.found for o in outcomes if o.kind == kind)} of {sum(o.kind == kind for o in outcomes)} {what}"
              for kind, what in (("color", f"colours within {COLOR_ERROR}"),
                                 ("transform", f"objects within {SHIFT_ERROR} of their shift"))]  # fmt: skip
    head = f"{', '.join(counts)}; {ITERATIONS} iterations of {SAMPLES} samples per pixel.\n"
    table = ["| scene | object | part of the picture | fitted | error before | after | seconds | outcome |",
             "|---|---|---|---|---|---|---|---|", *map(line, outcomes)]  # fmt: skip
    text = "\n".join(["# Fits to pictures by Cycles\n", head, *table]) + "\n"
    print(text)
    (output / "cycles_fits.md").write_text(text)
    (output / "cycles_fits.json").write_text(json.dumps([asdict(o) | {"found": o.found} for o in outcomes], indent=1))


if __name__ == "__main__":
    main()
