"""Pictures of a distance field beside those of a mesh of the same shape, and how fields grow.

``python -m tests.benchmarks.fields`` prints CPU seconds of pictures (256 x 256 pixels, 16 samples) of a torus, as a
field of 128^3 coefficients and as a smooth mesh of 200,000 triangles, in turns: in an even environment, and over a
floor in the light of a rectangle, with the gradient by all coefficients beside the picture.
Then it prints seconds of preparing a field, of an update of one corner and of all coefficients, of a picture and of its
gradient by all coefficients, for fields of 64^3 to 512^3 coefficients, and the memory that they take beside the
coefficients. ``--plot FILE`` draws these, ``--only grow`` leaves out the comparison with meshes.
"""

from __future__ import annotations

import argparse
import resource
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from edgegrad import AreaLight, Mesh, Renderer, Scene, World
from tests.support.fields.splines import sampled, torus
from tests.support.small_scenes import camera, matte, rectangle


class Grown(NamedTuple):
    """Figures of a field of size^3 coefficients: CPU seconds, and MB."""

    size: int
    prepared: float
    memory: float
    corner: float
    everything: float
    picture: float
    gradient: float


SIZE, SPP, TURNS = 256, 16, 5
TRIANGLES = 200_000


def torus_mesh(triangles: int, major: float = 0.55, minor: float = 0.25) -> Mesh:
    """A smooth-shaded torus."""
    around = int(np.sqrt(triangles / 2 * major / minor))
    across = triangles // (2 * around)
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, around, endpoint=False),
                       np.linspace(0, 2 * np.pi, across, endpoint=False), indexing="ij")
    r = major + minor * np.cos(v)
    vertices = np.stack([r * np.cos(u), r * np.sin(u), minor * np.sin(v)], axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    corner = [((i + a) % around) * across + (j + b) % across for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
    quads = np.stack([corner[k] for k in (0, 1, 2, 0, 2, 3)], axis=-1).reshape(-1, 3).astype(np.int32)
    return Mesh(vertices, quads, ("clay",), smoothing=quads)


def scenes(light: str, size: int) -> dict[str, Scene]:
    """The same scene with a field and with a mesh."""
    seen_by = camera((0.3, -1.6, 1.8), (0, 0, 0), size, 0.8, up=(0, 0, 1))
    materials = {"clay": matte(0.7, 0.6, 0.5), "floor": matte(0.5, 0.5, 0.5)}
    if light == "environment":
        base = Scene(seen_by, materials=materials, world=World(np.ones(3)))
    else:
        to_world = np.eye(4)
        to_world[:3, 3] = 0.5, 0.5, 3.0
        base = Scene(seen_by, {"floor": rectangle((0, 0, -0.3), (3, 0, 0), (0, 3, 0), "floor")}, materials,
                     {"lamp": AreaLight(to_world, power=100.0)})
    return {"field": replace(base, fields={"torus": sampled(torus, 128)}),
            "mesh": replace(base, meshes={**base.meshes, "torus": torus_mesh(TRIANGLES)})}


def cpu_seconds(call: Callable[[], object]) -> float:
    """CPU seconds of one call, of all threads."""
    start = time.process_time()
    call()
    return time.process_time() - start


def resident() -> float:
    """Megabytes of memory in use (Linux)."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 2**20


def compare(light: str, depth: int, size: int) -> None:
    """Print the seconds of both pictures and their ratio."""
    renderers = {name: Renderer(scene) for name, scene in scenes(light, size).items()}
    seconds: dict[str, list[float]] = {name: [] for name in renderers}
    for renderer in renderers.values():
        renderer.render(spp=1, max_depth=depth)
    for _ in range(TURNS):
        for name, renderer in renderers.items():
            seconds[name].append(cpu_seconds(lambda r=renderer: r.render(spp=SPP, max_depth=depth)))  # type: ignore[misc]
    field, mesh = (float(np.median(seconds[name])) for name in ("field", "mesh"))
    print(f"{light:12} depth {depth}: field {field:.3f} s, mesh {mesh:.3f} s, ratio {field / mesh:.2f}", flush=True)


def differentiate(light: str, depth: int, size: int) -> None:
    """Print the seconds of the gradient by all coefficients, in turns with the picture, and their ratio."""
    renderer = Renderer(scenes(light, size)["field"])
    adjoint = np.ones((size, size, 3), np.float32)
    path = "fields.torus.values"
    calls: list[Callable[[], object]] = [
        lambda: renderer.render(spp=SPP, max_depth=depth),
        lambda: renderer.render_backward(adjoint, [path], spp=SPP, max_depth=depth),
    ]
    renderer.render_backward(adjoint, [path], spp=1, max_depth=depth)
    picture, gradient = np.median([[cpu_seconds(call) for call in calls] for _ in range(TURNS)], axis=0)
    print(f"{light:12} depth {depth}: gradient {gradient:.3f} s, picture {picture:.3f} s, ratio "
          f"{gradient / picture:.2f}", flush=True)


def grow(size: int) -> Grown:
    """Measure how one field is prepared, updated, rendered and differentiated, and print it."""
    scene = scenes("environment", 128)["field"]
    field = sampled(torus, size)
    scene.fields = {"torus": field}
    before = resident()
    renderer = Renderer(scene, watched=False)
    build = cpu_seconds(lambda: renderer.render(spp=1))
    memory = resident() - before - field.values.nbytes / 2**20
    field.values[-size // 4 :, size // 2 :, size // 2 :] += np.float32(1e-3)
    corner = cpu_seconds(renderer.update)
    field.values += np.float32(1e-3)
    everything = cpu_seconds(renderer.update)
    picture = cpu_seconds(lambda: renderer.render(spp=SPP))
    adjoint = np.ones((128, 128, 3), np.float32)
    gradient = cpu_seconds(lambda: renderer.render_backward(adjoint, ["fields.torus.values"], spp=SPP))
    print(f"{size}^3: prepared in {build:.2f} s with {memory:.0f} MB beside the engine's coefficients, update of a "
          f"corner {corner:.3f} s, of all {everything:.3f} s, picture {picture:.3f} s, gradient {gradient:.3f} s",
          flush=True)
    return Grown(size, build, memory, corner, everything, picture, gradient)


def draw(rows: list[Grown], path: Path) -> None:
    """Draw seconds over the size, beside a line that grows with the surface and one with the volume."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(5.5, 3.8), layout="constrained")
    sizes = np.array([row.size for row in rows], float)
    for name, label in (("picture", "picture"), ("gradient", "gradient by all coefficients"),
                        ("prepared", "preparation"), ("everything", "update of all coefficients")):
        axes.loglog(sizes, [getattr(row, name) for row in rows], "o-", label=label)
    for power, style, label in ((2, "--", "as the surface"), (3, ":", "as the volume")):
        axes.loglog(sizes, rows[0].prepared * (sizes / sizes[0]) ** power, style, color="0.6", label=label)
    axes.set_xticks(sizes, [f"{size:.0f}³" for size in sizes], minor=False)
    axes.set_xticks([], minor=True)
    axes.set_xlabel("coefficients")
    axes.set_ylabel("CPU seconds")
    axes.legend(fontsize=7)
    figure.savefig(path, dpi=110)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", type=int, default=SIZE, help="pixels of a row")
    parser.add_argument("--largest", type=int, default=512, help="coefficients of the largest field along an axis")
    parser.add_argument("--only", choices=("compare", "grow"), help="one half of the measurements")
    parser.add_argument("--plot", type=Path, help="draw how fields grow to this file")
    given = parser.parse_args()
    if given.only != "grow":
        for light in ("environment", "rectangle"):
            for depth in (1, 2, 4):
                compare(light, depth, given.size)
                differentiate(light, depth, given.size)
    if given.only == "compare":
        return
    rows = [grow(64 << k) for k in range(int(np.log2(given.largest / 64)) + 1)]
    if given.plot:
        draw(rows, given.plot)


if __name__ == "__main__":
    main()
