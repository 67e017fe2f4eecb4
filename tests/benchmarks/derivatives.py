"""Derivatives of Edgegrad beside Mitsuba 3's in one run: run time against error.

``python -m tests.benchmarks.derivatives`` measures every reference case that has central differences, prints a report
and writes it as Markdown, JSON and pictures. Per case, renderer and number of samples:

- the derivative picture along the case's parameter (forward mode), pixel by pixel and summed over 8 x 8 blocks;
- the gradient of an image loss with respect to all vertices of the moving meshes, or all values of the parameter
  (reverse mode).

Each has seconds (median of warm calls that the renderers make in turn, a step of an optimiser each: the scene takes
the parameter's values, then its derivative is computed; so are our pictures, beside which gradients are set), the
relative variance from seed to seed, and the pictures have the relative error against the differences. What counts is
seconds x variance: the time for a given noise. Whatever a renderer learns for its samples it learns within the call.
Mitsuba computes with the integrator that is made for the case, in each of its settings; of those that aren't wrong, the
one of the least seconds x variance at the middle number of samples goes on.
"""

from __future__ import annotations

import argparse
import json
import platform
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad.rendering.native_engine import instruction_sets
from tests.benchmarks.derivative_report import Report, Row, Timed, markdown, plot
from tests.benchmarks.mitsuba_peer import REST, MitsubaPeer
from tests.benchmarks.versus_mitsuba import processor
from tests.support import peer_scenes
from tests.support.block_statistics import block_sums
from tests.support.reference_files import FOLDERS

F64 = NDArray[np.float64]

SPP = (4, 16, 64)
QUICK = ("tri_background", "sphere_env", "shadow_occluder", "glossy_emitter")
# Scenes in which Mitsuba's derivative does not converge to the central differences: its estimators lack a part.
PEER_WRONG = ("crease", "blob_flat", "camera_move", "point_shadow", "glass_sphere", "dense_200k")
# Mitsuba's default guiding costs up to 100 s a gradient: it is measured on demand.
SLOW_SETTINGS = ("default guiding",)
# Block sums of the mean further than this from the differences, noise taken out, aren't called right.
RIGHT = 0.1

Call = Callable[[int], NDArray[Any]]


@dataclass
class Side:
    """A renderer's calls for one case and number of samples, by seed."""

    forward: Call
    backward: Call | None
    render: Call | None = None
    direct: Call | None = None


def find_cases() -> dict[str, Path]:
    """Files of the cases that have central differences."""
    found: dict[str, Path] = {}
    for folder in FOLDERS:
        for path in sorted(Path(folder).glob("*.npz")):
            with np.load(path) as file:
                if "grad_fd" in file.files:
                    found.setdefault(path.stem, path)
    return dict(sorted(found.items()))


def spread(values: Sequence[F64]) -> tuple[float, float]:
    """Variance from seed to seed, summed, and the squared norm of the mean without the noise in it."""
    stacked = np.stack(values)
    variance = float(stacked.var(axis=0, ddof=1).sum())
    return variance, max(float(np.sum(stacked.mean(axis=0) ** 2)) - variance / len(stacked), 1e-300)


def against(values: Sequence[F64], seconds: float, wanted: F64, noise: F64) -> tuple[Timed, float]:
    """Time and error of pictures whose differences and these' variance are known; the bias of their mean."""
    norm = float(np.sum(wanted**2) - np.sum(noise))
    variance, _ = spread(values)
    error = float(np.mean([np.sum((v - wanted) ** 2) for v in values]) - np.sum(noise))
    bias = float(np.sum((np.mean(values, axis=0) - wanted) ** 2) - np.sum(noise) - variance / len(values))
    relative = float(np.sqrt(max(error, 0.0) / norm))
    return Timed(seconds, variance / norm, relative), float(np.sqrt(max(bias, 0.0) / norm))


def take_turns(sides: Mapping[str, Side], runs: int, deadline: float) -> dict[str, dict[str, tuple[float, list[F64]]]]:
    """Median seconds and results of each renderer's calls; at least 4 runs, then until the deadline (seconds).

    What one renderer leaves running doesn't slow the other.
    """
    calls = {(name, part): call for name, side in sides.items()
             for part, call in vars(side).items() if call is not None}
    for call in calls.values():
        call(0)
    seconds: dict[tuple[str, str], list[float]] = {key: [] for key in calls}
    results: dict[tuple[str, str], list[F64]] = {key: [] for key in calls}
    begin = time.perf_counter()
    last = ""
    for seed in range(1, runs + 1):
        if seed > 4 and time.perf_counter() - begin > deadline:
            break
        for key, call in calls.items():
            if key[0] != last:
                time.sleep(REST)
                last = key[0]
            start = time.perf_counter()
            result = call(seed)
            seconds[key].append(time.perf_counter() - start)
            results[key].append(np.asarray(result, np.float64))
    out: dict[str, dict[str, tuple[float, list[F64]]]] = {name: {} for name in sides}
    for (name, part), times in seconds.items():
        out[name][part] = float(np.median(times)), results[name, part]
    return out


class Case:
    """A reference case in both renderers."""

    def __init__(self, path: Path, threads: int) -> None:
        self.name = path.stem
        data, arrays = peer_scenes.read(path)
        scene, self.tangent = peer_scenes.at_theta(data, 0.0)
        self.depth = int(data["max_depth"])
        self.wanted = arrays["grad_fd"].astype(np.float64)
        self.noise = arrays["grad_fd_stderr"].astype(np.float64) ** 2
        image = arrays["image"].astype(np.float64)
        self.adjoint = (2.0 * (image - image.mean()) / image.size).astype(np.float32)
        self.renderer = edgegrad.Renderer(scene, threads=threads, engine="native")
        self.peer = MitsubaPeer(data, threads, self.tangent)
        self.missing = list(edgegrad.plan(scene, list(self.tangent), max_depth=self.depth).missing)

    def ours(self, spp: int) -> Side:
        """Edgegrad's calls."""
        paths = list(self.tangent)
        options: dict[str, Any] = {"spp": spp, "max_depth": self.depth}

        def forward(seed: int) -> F64:
            self.renderer.update(paths)
            return self.renderer.render_forward(self.tangent, seed=seed, **options).astype(np.float64)

        def backward(seed: int, **terms: Any) -> F64:
            self.renderer.update(paths)
            found = self.renderer.render_backward(self.adjoint, paths, seed=seed, **options, **terms)
            return np.concatenate([found[path].ravel() for path in paths])

        def render(seed: int) -> F64:
            self.renderer.update(paths)
            return self.renderer.render(seed=seed, **options).astype(np.float64)

        return Side(forward, backward, render, lambda seed: backward(seed, terms=("interior", "primary")))

    def theirs(self, spp: int, setting: str) -> Side:
        """Mitsuba's calls."""
        backward = None
        if "camera.to_world" not in self.tangent:
            def backward(seed: int) -> F64:
                return self.peer.backward(self.adjoint, spp=spp, seed=seed, setting=setting)

        return Side(lambda seed: self.peer.forward(spp=spp, seed=seed, setting=setting), backward)

    def best_setting(self, spp: int, every: bool) -> str:
        """The setting of Mitsuba whose derivative picture takes the least time for its noise, of those not seen wrong.

        A setting that leaves a boundary out is quick and quiet: what its mean is off by beyond its own noise and
        `RIGHT` rules it out, as long as another one stays.
        """
        costs, wrong = {}, {}
        for setting in self.peer.derivative_settings():
            if setting in SLOW_SETTINGS and not every:
                continue
            side = Side(self.theirs(spp, setting).forward, None)
            seconds, pictures = take_turns({"": side}, 4, 4.0)[""]["forward"]
            timed, bias = against([block_sums(p) for p in pictures], seconds, block_sums(self.wanted),
                                  block_sums(self.noise))
            costs[setting] = timed.cost
            wrong[setting] = bias if bias > RIGHT and bias**2 > timed.variance / len(pictures) else 0.0
        return min(costs, key=lambda key: (wrong[key], costs[key]))

    def rows(self, spp: int, setting: str, runs: int, deadline: float) -> list[Row]:
        """Both renderers' rows."""
        sides = {"Edgegrad": self.ours(spp), "Mitsuba": self.theirs(spp, setting)}
        out = []
        for name, parts in take_turns(sides, runs, deadline).items():
            seconds, pictures = parts["forward"]
            pixels, _ = against(pictures, seconds, self.wanted, self.noise)
            blocks, bias = against([block_sums(p) for p in pictures], seconds, block_sums(self.wanted),
                                   block_sums(self.noise))
            gradient = None
            if "backward" in parts:
                seconds, found = parts["backward"]
                variance, norm = spread(found)
                gradient = Timed(seconds, variance / norm)
            out.append(Row(self.name, name, setting if name == "Mitsuba" else "", spp, pixels, blocks, gradient, bias,
                           *(parts[part][0] if part in parts else None for part in ("render", "direct"))))
        return out


def measure(cases: Mapping[str, Path], spps: Sequence[int], threads: int, runs: int, deadline: float,
            every: bool) -> Report:
    """Run everything."""
    report = Report({
        "processor": processor(), "instructions": instruction_sets()[0], "threads": threads,
        "python": platform.python_version(), "numpy": np.__version__,
    })
    for name, path in cases.items():
        case = Case(path, threads)
        report.machine["mitsuba"] = case.peer.version
        report.missing[name] = case.missing
        setting = case.best_setting(sorted(spps)[len(spps) // 2], every)
        for spp in spps:
            report.rows += case.rows(spp, setting, runs, deadline)
            ours, theirs = report.rows[-2:]
            print(f"{name} {spp} spp, {setting}: {ours.blocks.seconds:.3f} s and {theirs.blocks.seconds:.3f} s, "
                  f"seconds x variance {theirs.blocks.cost / ours.blocks.cost:.2f} x lower", flush=True)
    return report


def main() -> None:
    """Command line."""
    known = find_cases()
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="*", help=f"some of {', '.join(known)} (default: all)")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--runs", type=int, default=60, help="timed calls per number (at least 4; the variance of a "
                        "gradient of one value is known to a factor of 1.4 by 60, of 4 by 5)")
    parser.add_argument("--deadline", type=float, default=10.0, help="seconds after which a row's runs end (after 4)")
    parser.add_argument("--quick", action="store_true", help=f"only {', '.join(QUICK)}, at 4 and 16 spp")
    parser.add_argument("--all-settings", action="store_true", help="also Mitsuba's default guiding, which is slow")
    parser.add_argument("--output", type=Path, default=Path("build/benchmarks"), help="folder of the report")
    parser.add_argument("--plot", type=Path, help="where to write the plot (default: in the folder of the report)")
    arguments = parser.parse_args()
    if unknown := [name for name in arguments.cases if name not in known]:
        parser.error(f"unknown case {unknown[0]}; there are {', '.join(known)}")
    names = arguments.cases or (QUICK if arguments.quick else list(known))
    report = measure({name: known[name] for name in names}, SPP[:2] if arguments.quick else SPP, arguments.threads,
                     max(arguments.runs, 4), 2.0 if arguments.quick else arguments.deadline, arguments.all_settings)
    arguments.output.mkdir(parents=True, exist_ok=True)
    (arguments.output / "derivatives.json").write_text(json.dumps(asdict(report), indent=1))
    text = markdown(report, PEER_WRONG, RIGHT)
    (arguments.output / "derivatives.md").write_text(text)
    plot(report, arguments.plot or arguments.output / "derivatives.png")
    print(text)


if __name__ == "__main__":
    main()
