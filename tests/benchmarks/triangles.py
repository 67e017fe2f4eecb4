"""How run times grow with the number of triangles, at a fixed picture and number of samples.

``python -m tests.benchmarks.triangles`` prints a table and writes it as Markdown, JSON and a plot: seconds of taking
other vertices (the BVH is refitted), of a picture, of the first gradient (which finds the mesh's edges) and of later
ones, for displaced spheres of a thousand to a million triangles, 128 x 128 pixels: in an even sky, and over a floor
in the soft shadows of a rectangle light.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

import edgegrad
from tests.benchmarks import scenes
from tests.benchmarks.versus_mitsuba import processor
from tests.support import peer_scenes
from tests.support.rich_scene import pose, turn
from tests.support.small_scenes import matte, rectangle

# Cuts of the sphere (20 cuts² triangles).
CUTS = (7, 22, 71, 158, 224)
SPP = 16
RUNS = 5


@dataclass
class Row:
    """Seconds in one light at one size: the least of some runs, but for `build` (Embree's too) and the first."""

    light: str
    triangles: int
    build: float
    update: float
    render: float
    first_gradient: float
    gradient: float


@dataclass
class Report:
    """One run."""

    machine: dict[str, Any]
    rows: list[Row] = field(default_factory=list)


def seconds_of(call: Callable[[], object]) -> float:
    """Seconds of one call."""
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def in_sky(cuts: int) -> edgegrad.Scene:
    """The sphere in an even sky."""
    return peer_scenes.to_edgegrad(scenes.dense_sphere(cuts))


def in_soft_shadow(cuts: int) -> edgegrad.Scene:
    """The sphere over a floor, under a rectangle light."""
    scene = in_sky(cuts)
    floor = rectangle((0.0, -1.25, 0.0), (0.0, 0.0, 3.0), (3.0, 0.0, 0.0), "floor")
    down = pose(turn(-0.5 * np.pi, 0.0, 0.0), 1.0, 3.5, 1.5)
    return replace(
        scene, meshes={**scene.meshes, "floor": floor},
        materials={**scene.materials, "floor": matte(0.8, 0.75, 0.7)},
        lights={"lamp": edgegrad.AreaLight(down, np.array([1.5, 1.0]), "RECTANGLE", 300.0)},
        world=edgegrad.World(np.zeros(3)),
    )


LIGHTS: dict[str, Callable[[int], edgegrad.Scene]] = {"even sky": in_sky, "rectangle": in_soft_shadow}


def measure(light: str, cuts: int, threads: int) -> Row:
    """One sphere: an optimiser's steps on it."""
    scene = LIGHTS[light](cuts)
    mesh, path = scene.meshes["mesh0"], "meshes.mesh0.vertices"
    still = mesh.vertices.copy()
    adjoint = np.full((*scene.camera.size, 3), 1e-4, np.float32)
    step = iter(range(1, 1000))
    start = time.perf_counter()
    renderer = edgegrad.Renderer(scene, threads=threads, engine="native")
    build = time.perf_counter() - start

    def update() -> None:
        mesh.vertices = still + 1e-4 * np.sin(next(step))
        renderer.update([path])

    renderer.render(spp=SPP)
    first = seconds_of(lambda: renderer.render_backward(adjoint, [path], spp=SPP))
    update()
    runs = [(seconds_of(update), seconds_of(lambda: renderer.render(spp=SPP)),
             seconds_of(lambda: renderer.render_backward(adjoint, [path], spp=SPP))) for _ in range(RUNS)]
    moved, rendered, derived = (min(values) for values in zip(*runs, strict=True))
    return Row(light, len(mesh.faces), build, moved, rendered, first, derived)


def markdown(report: Report) -> str:
    """The report as text."""
    about = ", ".join(f"{key} {value}" for key, value in report.machine.items())
    lines = [
        f"# Run time by number of triangles\n\n{about}. 128 × 128 pixels, {SPP} samples per pixel, seconds.\n",
        "| light | triangles | build | update | render | first gradient | later gradients | gradient / render |",
        "|---" * 8 + "|",
    ]
    lines += [f"| {r.light} | {r.triangles:,} | {r.build:.3f} | {r.update:.4f} | {r.render:.4f} | "
              f"{r.first_gradient:.3f} | {r.gradient:.4f} | {r.gradient / r.render:.2f} |" for r in report.rows]
    return "\n".join(lines) + "\n"


def plot(report: Report, path: Path) -> None:
    """Seconds against triangles."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, len(LIGHTS), figsize=(8.4, 3.2), sharey=True)
    for axis, light in zip(axes, LIGHTS, strict=True):
        rows = [r for r in report.rows if r.light == light]
        count = [r.triangles for r in rows]
        for name in ("update", "render", "first_gradient", "gradient"):
            axis.loglog(count, [getattr(r, name) for r in rows], "o-", markersize=3, label=name.replace("_", " "))
        axis.set_title(light, fontsize=8)
        axis.set_xlabel("triangles", fontsize=8)
        axis.tick_params(labelsize=7)
        axis.grid(alpha=0.3, linewidth=0.5)
    axes[0].set_ylabel("seconds", fontsize=8)
    axes[0].legend(fontsize=7)
    figure.tight_layout()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=90)
    pyplot.close(figure)


def run(cuts: Sequence[int], threads: int) -> Report:
    """All sizes."""
    report = Report({"processor": processor(), "threads": threads})
    report.rows += [measure(light, k, threads) for light in LIGHTS for k in cuts]
    return report


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--quick", action="store_true", help="up to 100,000 triangles")
    parser.add_argument("--output", type=Path, default=Path("build/benchmarks"), help="folder of the report")
    parser.add_argument("--plot", type=Path, help="where to write the plot (default: in the folder of the report)")
    arguments = parser.parse_args()
    report = run(CUTS[:3] if arguments.quick else CUTS, arguments.threads)
    arguments.output.mkdir(parents=True, exist_ok=True)
    (arguments.output / "triangles.json").write_text(json.dumps(asdict(report), indent=1))
    (arguments.output / "triangles.md").write_text(text := markdown(report))
    plot(report, arguments.plot or arguments.output / "triangles.png")
    print(text)


if __name__ == "__main__":
    main()
