"""Pictures of Edgegrad beside Mitsuba 3's in one run: time, noise, first picture and memory.

``python -m tests.benchmarks.versus_mitsuba`` prints a report and writes it as Markdown and JSON. The two renderers
take turns call by call, so that a machine that slows down slows both; each time is the median of warm calls, each
variance the seed-to-seed variance of the same pictures, averaged over pixels and channels. Mitsuba renders with each of
its integrators and samplers that give the same picture, and is judged by its best, for each number by itself.
"""

from __future__ import annotations

import argparse
import json
import platform
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad.rendering.native_engine import instruction_sets
from tests.benchmarks import scenes
from tests.benchmarks.fresh_process import measure as first_picture
from tests.benchmarks.mitsuba_peer import REST, MitsubaPeer
from tests.benchmarks.report import FirstRow, RenderRow, Report, Side, markdown
from tests.support import peer_scenes

SPP = (16, 64)
FIRST_SPP = 16
WARM_UP = 2
BLOCK = 8

Call = Callable[[int], Any]


def take_turns(calls: dict[str, Call], runs: int) -> dict[str, tuple[float, list[Any]]]:
    """Median seconds and results of each call, made in turn with the seeds 0, 1, ... after a warm-up."""
    for call in calls.values():
        for seed in range(WARM_UP):
            call(seed)
    seconds: dict[str, list[float]] = {name: [] for name in calls}
    results: dict[str, list[Any]] = {name: [] for name in calls}
    for seed in range(runs):
        for name, call in calls.items():
            time.sleep(REST)
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


def compare_renders(name: str, renderer: edgegrad.Renderer, peer: MitsubaPeer, depth: int, spp: int, runs: int,
                    deadline: float) -> RenderRow:
    """Time, noise and agreement of one picture; fewer runs than asked where they would take longer than `deadline`."""
    calls: dict[str, Call] = {"edgegrad": lambda seed: renderer.render(spp=spp, seed=seed, max_depth=depth)}
    for integrator, sampler in peer.configurations():
        calls[f"{integrator}, {sampler}"] = lambda seed, i=integrator, s=sampler: peer.render(  # type: ignore[misc]
            spp=spp, seed=seed, integrator=i, sampler=s
        )
    once = sum(seconds for seconds, _ in take_turns(calls, 1).values())
    measured = take_turns(calls, int(np.clip(deadline / once, 5, runs)))
    sides = {
        key: Side(seconds, float(np.var(np.asarray(pictures, np.float64), axis=0, ddof=1).mean()))
        for key, (seconds, pictures) in measured.items()
    }
    ours = sides.pop("edgegrad")
    (a, a_error), (b, b_error) = (
        mean_and_error([block_averages(picture) for picture in measured[key][1]])
        for key in ("edgegrad", "path, independent")
    )
    size = np.linalg.norm(b)
    return RenderRow(
        name, spp, ours, sides,
        time_ratio=ours.seconds / min(side.seconds for side in sides.values()),
        cost_ratio=min(side.cost for side in sides.values()) / ours.cost,
        cost_ratio_default=min(side.cost for key, side in sides.items() if "independent" in key) / ours.cost,
        difference=float(np.linalg.norm(a - b) / size),
        expected=float(np.sqrt(np.sum(a_error**2 + b_error**2)) / size),
    )  # fmt: skip


def compare_first(data: scenes.Neutral, threads: int) -> FirstRow:
    """First pictures in fresh processes."""
    ours = first_picture("edgegrad", data, FIRST_SPP, threads)
    with tempfile.TemporaryDirectory() as home:
        empty, filled = (first_picture("mitsuba", data, FIRST_SPP, threads, Path(home)) for _ in range(2))
    return FirstRow(data["name"], ours, empty, filled)


def measure(names: Sequence[str], threads: int, runs: int, deadline: float) -> Report:
    """Run everything."""
    report = Report({
        "processor": processor(),
        "instructions": instruction_sets()[0],
        "threads": threads,
        "runs": runs,
        "python": platform.python_version(),
        "numpy": np.__version__,
    })
    for name in names:
        data = scenes.neutral(name)
        renderer = edgegrad.Renderer(peer_scenes.to_edgegrad(data), threads=threads, engine="native")
        peer = MitsubaPeer(data, threads)
        report.machine["mitsuba"] = peer.version
        depth = int(data["max_depth"])
        for spp in SPP:
            report.render.append(compare_renders(name, renderer, peer, depth, spp, runs, deadline))
            print(name, spp, f"{report.render[-1].time_ratio:.2f} {report.render[-1].cost_ratio:.2f}", flush=True)
        report.first.append(compare_first(data, threads))
    return report


def processor() -> str:
    """The processor's name, as far as the system tells."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), platform.machine())


def main() -> None:
    """Command line."""
    known = scenes.names()
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", help=f"some of {', '.join(known)} (default: all)")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--runs", type=int, default=9, help="timed calls per number (at least 5)")
    parser.add_argument("--deadline", type=float, default=15.0, help="seconds after which a row's runs end (after 5)")
    parser.add_argument("--output", type=Path, default=Path("build/benchmarks"), help="folder of the report")
    arguments = parser.parse_args()
    if unknown := [name for name in arguments.scenes if name not in known]:
        parser.error(f"unknown scene {unknown[0]}; there are {', '.join(known)}")
    report = measure(arguments.scenes or known, arguments.threads, max(arguments.runs, 5), arguments.deadline)
    text = markdown(report)
    print(text)
    arguments.output.mkdir(parents=True, exist_ok=True)
    (arguments.output / "versus_mitsuba.md").write_text(text)
    (arguments.output / "versus_mitsuba.json").write_text(json.dumps(asdict(report), indent=1))


if __name__ == "__main__":
    main()
