"""Fits to pictures by Cycles, on the scenes of the comparison with Cycles: is what was changed found again?

``python -m tests.benchmarks.corpus.fits`` opens each scene, exports it, changes the base colour of one object, or moves
the object sideways, and fits colour or transform to Cycles' picture. The target holds all differences between the two
renderers, so this measures fits as users see them. Objects that the picture determines too poorly are passed over. It
writes a table (Markdown and JSON).
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad.scene import parameters
from edgegrad_addon.export import Export, export_scene
from tests.benchmarks import versus_cycles
from tests.benchmarks.corpus.determined import expected_error
from tests.benchmarks.corpus.objects import Candidate, candidates, clear_of_others, colored
from tests.benchmarks.cycles_scenes import CASES

ITERATIONS, SAMPLES = 50, 16
# What counts as found.
COLOR_ERROR, SHIFT_ERROR = 0.05, 0.2
# The start: the distance from the true colour, and the shift as a part of the diagonal of the object's box.
COLOR_CHANGE, SHIFT = 0.3, 0.15
# Objects of a scene of which the picture may determine none.
TRIED = 4


@dataclass
class Outcome:
    """One fit. Errors: largest difference of a channel, or the distance of the centres over the shift.
    `expected` is the standard deviation that the noise of Cycles' picture alone leaves."""

    scene: str
    object: str
    share: float
    kind: str
    before: float
    after: float
    expected: float
    seconds: float

    @property
    def found(self) -> bool:
        """Whether the error is below the limit of its kind."""
        return self.after <= (COLOR_ERROR if self.kind == "color" else SHIFT_ERROR)


@dataclass
class Problem:
    """A parameter to fit: its path, where it starts, what the picture's noise leaves open, and the error of a value."""

    path: str
    start: NDArray[np.float64]
    expected: float
    error: Callable[[NDArray[np.float64]], float]


def color_problem(exported: Export, theirs: NDArray[np.float32], one: Candidate) -> Problem | None:
    """The base colour of an object, changed in each channel; None if it has none of its own."""
    path = colored(exported.scene, one)
    if path is None:
        return None
    truth = np.array(parameters.get(exported.scene, path), np.float64)
    start = np.where(truth > 0.5, truth - COLOR_CHANGE, truth + COLOR_CHANGE)
    # Colours stay within [0, 1], so the move lies beside the truth where this is at the end.
    low = np.clip(truth - COLOR_ERROR, 0.0, 1.0 - 2.0 * COLOR_ERROR)
    move = (low, low + 2.0 * COLOR_ERROR)
    part = expected_error(exported.scene, theirs, path, [move], max_depth=exported.settings.max_depth,
                          bounces=exported.settings.bounces, by_channel=True)  # fmt: skip
    return Problem(path, start, 2.0 * COLOR_ERROR * part, lambda value: float(np.abs(value - truth).max()))


def transform_problem(exported: Export, theirs: NDArray[np.float32], one: Candidate) -> Problem:
    """The transform of an object, moved sideways; errors are distances of its centre over the length of the shift."""
    scene, path = exported.scene, f"meshes.{one.name}.transform"
    truth = np.array(parameters.get(scene, path), np.float64)
    shift = clear_of_others(scene, one, SHIFT)
    length = float(np.linalg.norm(shift))

    def moved(by: NDArray[np.float64]) -> NDArray[np.float64]:
        value = truth.copy()
        value[:3, 3] += by
        return value

    # The centre as the true transform places it; it is in world space, where the exported transform starts.
    centre = np.append(0.5 * (one.low + one.high), 1.0)

    def error(value: NDArray[np.float64]) -> float:
        return float(np.linalg.norm((value @ np.linalg.inv(truth) @ centre)[:3] - centre[:3]) / length)

    moves = [(moved(-SHIFT_ERROR * length * axis), moved(SHIFT_ERROR * length * axis)) for axis in np.eye(3)]
    part = expected_error(scene, theirs, path, moves, max_depth=exported.settings.max_depth,
                          bounces=exported.settings.bounces)  # fmt: skip
    return Problem(path, moved(shift), 2.0 * SHIFT_ERROR * part, error)


def run(name: str, output: Path) -> list[Outcome]:
    """Fit colour and transform of one object of a scene: the largest one whose parameter the picture determines."""
    case = CASES[name]
    theirs, _ = versus_cycles.by_cycles(case, output, case.samples, versus_cycles.SEEDS)
    target = np.asarray(theirs.mean(axis=0, dtype=np.float64), np.float32)
    outcomes = []
    for kind, problem_of, limit in (("color", color_problem, COLOR_ERROR),
                                    ("transform", transform_problem, SHIFT_ERROR)):  # fmt: skip
        exported = export_scene(bpy.context.scene)
        for one in candidates(exported.scene)[:TRIED]:
            problem = problem_of(exported, theirs, one)
            if problem is None:
                continue
            if problem.expected > 0.5 * limit:
                print(f"{name}: the picture leaves {kind} of {one.name} open to {problem.expected:.2g}", flush=True)
                continue
            parameters.put(exported.scene, problem.path, problem.start)
            start = time.perf_counter()
            result = edgegrad.fit(exported.scene, target, wrt=[problem.path], iterations=ITERATIONS, spp=SAMPLES,
                                  max_depth=exported.settings.max_depth, bounces=exported.settings.bounces)  # fmt: skip
            outcomes.append(Outcome(name, one.name, one.share, kind, problem.error(problem.start),
                                    problem.error(result.values[problem.path]), problem.expected,
                                    time.perf_counter() - start))  # fmt: skip
            break
    return outcomes


def line(outcome: Outcome) -> str:
    """A row of the table."""
    verdict = "found" if outcome.found else "**missed**"
    return (f"| {outcome.scene} | {outcome.object} | {outcome.share:.0%} | {outcome.kind} | {outcome.before:.3f} | "
            f"{outcome.after:.3f} | {outcome.expected:.3f} | {outcome.seconds:.0f} | {verdict} |")


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*",
                        help=f"some of {', '.join(CASES)} (default: all without a known difference)")  # fmt: skip
    parser.add_argument("--output", type=Path, default=Path("build/compare-cycles"), help="folder of the report")
    arguments = parser.parse_args()
    output = arguments.output.resolve()
    output.mkdir(parents=True, exist_ok=True)
    outcomes: list[Outcome] = []
    for name in arguments.scenes or [key for key, case in CASES.items() if not case.differs]:
        for outcome in run(name, output):
            outcomes.append(outcome)
            print(line(outcome), flush=True)
    counts = [f"{sum(o.found for o in outcomes if o.kind == kind)} of {sum(o.kind == kind for o in outcomes)} {what}"
              for kind, what in (("color", f"colours within {COLOR_ERROR}"),
                                 ("transform", f"objects within {SHIFT_ERROR} of their shift"))]  # fmt: skip
    head = f"{', '.join(counts)}; {ITERATIONS} iterations of {SAMPLES} samples per pixel.\n"
    table = ["| scene | object | part of the picture | fitted | error before | after | expected by noise | seconds | "
             "outcome |", "|---|---|---|---|---|---|---|---|---|", *map(line, outcomes)]  # fmt: skip
    text = "\n".join(["# Fits to pictures by Cycles\n", head, *table]) + "\n"
    print(text)
    (output / "cycles_fits.md").write_text(text)
    (output / "cycles_fits.json").write_text(json.dumps([asdict(o) | {"found": o.found} for o in outcomes], indent=1))


if __name__ == "__main__":
    main()
