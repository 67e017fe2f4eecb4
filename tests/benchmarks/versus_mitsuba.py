"""Edgegrad beside Mitsuba 3 in one run: time per sample and per gradient, noise, and whether the two agree.

``python -m tests.benchmarks.versus_mitsuba`` prints a report and writes it as Markdown and JSON. The two renderers
take turns call by call, so that a machine that slows down slows both; each number is the median of warm calls.
"""

from __future__ import annotations

import argparse
import json
import platform
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad.native_engine import instruction_sets
from tests.benchmarks.mitsuba_peer import BACKWARD, MitsubaPeer
from tests.benchmarks.scenes import SCENES, save
from tests.peer_scenes import load

RENDER_SPP = (16, 64)
BACKWARD_SPP = 16
BACKWARD_SCENE = "sphere_env"
WARM_UP = 2
AGREEMENT_SEEDS, AGREEMENT_SPP, BLOCK = 8, 64, 8

Call = Callable[[int], Any]


@dataclass
class RenderRow:
    """Median seconds of one render; ratios are Edgegrad's seconds / the faster of Mitsuba's two integrators."""

    scene: str
    spp: int
    edgegrad: float
    mitsuba_path: float
    mitsuba_direct: float
    ratio: float


@dataclass
class BackwardRow:
    """Median seconds of one gradient of all vertices, and its seed-to-seed noise relative to the gradient's norm."""

    renderer: str
    seconds: float
    noise: float
    along_theta: float
    along_theta_error: float
    speed_up: float


@dataclass
class AgreementRow:
    """Relative RMS difference of the two renderers' block averages, and what their noise alone would give."""

    scene: str
    difference: float
    expected: float


@dataclass
class Report:
    """One run."""

    machine: dict[str, Any]
    render: list[RenderRow] = field(default_factory=list)
    backward: list[BackwardRow] = field(default_factory=list)
    agreement: list[AgreementRow] = field(default_factory=list)


def take_turns(calls: dict[str, Call], runs: int) -> dict[str, tuple[float, list[Any]]]:
    """Median seconds and results of each call, made in turn with the seeds 0, 1, ... after a warm-up."""
    for call in calls.values():
        for seed in range(WARM_UP):
            call(seed)
    seconds: dict[str, list[float]] = {name: [] for name in calls}
    results: dict[str, list[Any]] = {name: [] for name in calls}
    for seed in range(runs):
        for name, call in calls.items():
            start = time.perf_counter()
            result = call(seed)
            seconds[name].append(time.perf_counter() - start)
            results[name].append(result)
    return {name: (float(np.median(seconds[name])), results[name]) for name in calls}


def block_averages(image: NDArray[Any]) -> NDArray[np.float64]:
    """Means over squares of BLOCK pixels."""
    height, width = (n // BLOCK * BLOCK for n in image.shape[:2])
    cut = np.asarray(image[:height, :width], np.float64)
    return cut.reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK, -1).mean(axis=(1, 3))


def mean_and_error(samples: Sequence[NDArray[np.float64]]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mean and its standard error over independent samples."""
    stacked = np.stack(samples)
    return stacked.mean(axis=0), stacked.std(axis=0, ddof=1) / np.sqrt(len(stacked))


def _render(renderer: edgegrad.Renderer, spp: int, seed: int) -> NDArray[np.float32]:
    return renderer.render(spp=spp, seed=seed)


def _mitsuba_render(peer: MitsubaPeer, integrator: str, spp: int, seed: int) -> NDArray[np.float32]:
    return peer.render(spp=spp, seed=seed, integrator=integrator)


def compare_renders(name: str, renderer: edgegrad.Renderer, peer: MitsubaPeer, spp: int, runs: int) -> RenderRow:
    """Time of one image."""
    calls: dict[str, Call] = {
        "edgegrad": partial(_render, renderer, spp),
        "path": partial(_mitsuba_render, peer, "path", spp),
        "direct": partial(_mitsuba_render, peer, "direct", spp),
    }
    seconds = {key: median for key, (median, _) in take_turns(calls, runs).items()}
    ratio = seconds["edgegrad"] / min(seconds["path"], seconds["direct"])
    return RenderRow(name, spp, seconds["edgegrad"], seconds["path"], seconds["direct"], ratio)


def compare_images(name: str, ours: Call, theirs: Call) -> AgreementRow:
    """Agreement of two renderers' mean images."""
    (a, a_error), (b, b_error) = (
        mean_and_error([block_averages(render(seed)) for seed in range(AGREEMENT_SEEDS)]) for render in (ours, theirs)
    )
    size = np.linalg.norm(b)
    expected = np.sqrt(np.sum(a_error**2 + b_error**2)) / size
    return AgreementRow(name, float(np.linalg.norm(a - b) / size), float(expected))


def compare_gradients(
    renderer: edgegrad.Renderer, peer: MitsubaPeer, tangent: dict[str, NDArray[np.float64]], runs: int
) -> list[BackwardRow]:
    """Time and noise of the gradient of an image loss with respect to all vertices; Edgegrad's row comes first."""
    image = np.mean([renderer.render(spp=AGREEMENT_SPP, seed=seed) for seed in range(4)], axis=0)
    adjoint = (2.0 * (image - image.mean()) / image.size).astype(np.float32)
    paths = list(tangent)

    def ours(seed: int) -> NDArray[np.float64]:
        # An optimiser's step: as in Mitsuba's timing, the acceleration structure takes the vertices' new values.
        renderer.update()
        gradients = renderer.render_backward(adjoint, paths, spp=BACKWARD_SPP, seed=seed)
        return np.concatenate([gradients[path] for path in paths])

    def theirs(setting: str) -> Call:
        return lambda seed: peer.backward(adjoint, spp=BACKWARD_SPP, seed=seed, setting=setting)

    calls: dict[str, Call] = {"Edgegrad": ours} | {f"Mitsuba, {s}": theirs(s) for s in BACKWARD}
    timed = take_turns(calls, runs)
    direction = np.concatenate([tangent[path] for path in paths])
    rows = []
    for name, (seconds, gradients) in timed.items():
        mean, error = mean_and_error(gradients)
        variance = np.sum(error**2) * runs
        norm = max(np.sum(mean**2) - variance / runs, 1e-300)
        projected = [float(np.sum(g * direction)) for g in gradients]
        rows.append(BackwardRow(
            name, seconds, float(np.sqrt(variance / norm)), float(np.mean(projected)),
            float(np.std(projected, ddof=1) / np.sqrt(runs)), seconds / timed["Edgegrad"][0],
        ))
    return rows


def measure(names: Sequence[str], threads: int, runs: int) -> Report:
    """Run everything."""
    report = Report({
        "processor": processor(),
        "instructions": instruction_sets()[0],
        "threads": threads,
        "runs": runs,
        "python": platform.python_version(),
        "numpy": np.__version__,
    })
    with tempfile.TemporaryDirectory() as folder:
        for name in names:
            neutral = SCENES[name]()
            stored = Path(folder) / f"{name}.npz"
            save(stored, neutral)
            scene, tangent, _ = load(stored)
            renderer = edgegrad.Renderer(scene, threads=threads, engine="native")
            peer = MitsubaPeer(neutral, threads)
            report.machine["mitsuba"] = peer.version
            for spp in RENDER_SPP:
                report.render.append(compare_renders(name, renderer, peer, spp, runs))
            report.agreement.append(compare_images(
                name,
                partial(_render, renderer, AGREEMENT_SPP),
                partial(_mitsuba_render, peer, "path", AGREEMENT_SPP),
            ))
            if name == BACKWARD_SCENE:
                report.backward = compare_gradients(renderer, peer, tangent, runs)
    return report


def processor() -> str:
    """The processor's name, as far as the system tells."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), platform.machine())


def markdown(report: Report) -> str:
    """The report as text."""
    about = ", ".join(f"{key} {value}" for key, value in report.machine.items())
    lines = [f"# Edgegrad beside Mitsuba 3\n\n{about}. Seconds are medians of warm calls; 128 × 128 pixels, depth 2.\n",
             "## render\n",
             "| scene | spp | Edgegrad s | Mitsuba path s | Mitsuba direct s | Edgegrad / faster of the two |",
             "|---|---|---|---|---|---|"]
    lines += [f"| {r.scene} | {r.spp} | {r.edgegrad:.4f} | {r.mitsuba_path:.4f} | {r.mitsuba_direct:.4f} | "
              f"**{r.ratio:.2f}** |" for r in report.render]
    if report.backward:
        lines += [f"\n## render_backward, all vertices, {BACKWARD_SCENE}, {BACKWARD_SPP} spp\n",
                  "Noise: seed-to-seed, relative to the gradient's norm. Along θ: the gradient times the case's "
                  "tangent, a number both must agree on.\n",
                  "| renderer | s | noise | along θ | Edgegrad is faster by |", "|---|---|---|---|---|"]
        for b in report.backward:
            faster = "" if b.renderer == "Edgegrad" else f"**{b.speed_up:.1f}×**"
            lines.append(f"| {b.renderer} | {b.seconds:.4f} | {b.noise:.3f} | {b.along_theta:.5g} ± "
                         f"{b.along_theta_error:.1g} | {faster} |")
        cheapest = min(report.backward[1:], key=lambda b: b.seconds)
        lines.append(f"\nAgainst Mitsuba's cheapest setting ({cheapest.renderer.removeprefix('Mitsuba, ')}): "
                     f"**{cheapest.speed_up:.1f}×** faster.")
    lines += [f"\n## Agreement of the images ({AGREEMENT_SEEDS} × {AGREEMENT_SPP} spp, {BLOCK} × {BLOCK} blocks)\n",
              "| scene | relative difference | expected from noise alone |", "|---|---|---|"]
    lines += [f"| {a.scene} | {a.difference:.2e} | {a.expected:.2e} |" for a in report.agreement]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", help=f"some of {', '.join(SCENES)} (default: all)")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--runs", type=int, default=7, help="timed calls per number (at least 5)")
    parser.add_argument("--output", type=Path, default=Path("build/benchmarks"), help="folder of the report")
    arguments = parser.parse_args()
    if unknown := [name for name in arguments.scenes if name not in SCENES]:
        parser.error(f"unknown scene {unknown[0]}; there are {', '.join(SCENES)}")
    report = measure(arguments.scenes or list(SCENES), arguments.threads, max(arguments.runs, 5))
    text = markdown(report)
    print(text)
    arguments.output.mkdir(parents=True, exist_ok=True)
    (arguments.output / "versus_mitsuba.md").write_text(text)
    (arguments.output / "versus_mitsuba.json").write_text(json.dumps(asdict(report), indent=1))


if __name__ == "__main__":
    main()
