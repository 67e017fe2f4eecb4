"""Rays per second of the engine's own queries beside Embree's, updates of moving meshes, and memory.

``python -m tests.benchmarks.throughput`` prints a report and writes it as Markdown and JSON. The same rays go
through the kernels' queries (`scene/rays.h`) and through Embree's entry points in bulk, both in chunks of 8192 rays.
Camera rays are coherent; bounce rays leave the camera's hits in cosine-distributed directions; shadow rays go from
there to points of a light above.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad import _native
from edgegrad.rendering import native_engine
from edgegrad.rendering.native_engine import instruction_sets
from tests.benchmarks import scenes
from tests.benchmarks.fresh_process import peak_mib
from tests.benchmarks.versus_mitsuba import processor
from tests.support import peer_scenes

F32 = NDArray[np.float32]

# Cuts of the displaced sphere (20 cuts² triangles); 0: the Cornell box.
SIZES = {"36": 0, "200k": 100, "1M": 224, "10M": 708}
TINY = (8, 12, 36, 64, 128)
EMBREE_WIDTHS = (1, 4, 8, 16)
RAYS = 512
RUNS = 5


@dataclass
class Rays:
    """Rays of one kind."""

    kind: str
    origins: F32
    directions: F32
    far: float = float("inf")

    def __len__(self) -> int:
        return len(self.origins)


@dataclass
class RateRow:
    """Millions of rays per second; `embree` by packet width, `engine` by instruction set."""

    triangles: int
    kind: str
    engine: dict[str, float]
    embree: dict[str, float]


@dataclass
class TinyRow:
    """Millions of rays per second over all triangles, and through the BVH, of the fastest instruction set."""

    triangles: int
    kind: str
    brute_force: float
    bvh: float


@dataclass
class UpdateRow:
    """Seconds of one step: moved vertices (`Renderer.update`) beside Embree's refit alone, and a changed colour."""

    triangles: int
    build: float
    embree_build: float
    update: float
    embree_refit: float
    color: float
    peak_mib: float


@dataclass
class Report:
    """One run."""

    machine: dict[str, Any]
    rates: list[RateRow] = field(default_factory=list)
    tiny: list[TinyRow] = field(default_factory=list)
    updates: list[UpdateRow] = field(default_factory=list)


def ray_scene(vertices: NDArray[Any], faces: NDArray[Any], threads: int) -> _native.RayScene:
    """A mesh with its BVH."""
    library = str(native_engine.embree_library())
    return _native.RayScene(
        np.ascontiguousarray(vertices, np.float32), np.ascontiguousarray(faces, np.int32), threads, library
    )


def joined(scene: scenes.Neutral) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices and faces of all meshes of a scene as one mesh."""
    first = np.cumsum([0] + [len(m["vertices"]) for m in scene["meshes"]])
    faces = [np.asarray(m["faces"]) + k for m, k in zip(scene["meshes"], first, strict=False)]
    return np.concatenate([m["vertices"] for m in scene["meshes"]]), np.concatenate(faces)


def make_rays(traced: _native.RayScene, vertices: NDArray[Any], faces: NDArray[Any], pose: NDArray[Any],
              seed: int = 0) -> list[Rays]:
    """Camera, bounce and shadow rays of a mesh."""
    rng = np.random.default_rng(seed)
    # Neighbouring rays are neighbouring samples of a picture: 4 x 4 in each pixel, row by row.
    pixel = np.repeat(np.arange((RAYS // 4) ** 2), 16)
    pixels = np.stack([pixel % (RAYS // 4), pixel // (RAYS // 4)], axis=1)
    place = (pixels + rng.random((RAYS * RAYS, 2))) / (RAYS // 4) * 2.0 - 1.0
    half = np.tan(np.radians(20.0))
    d = np.stack([place[:, 0] * half, -place[:, 1] * half, -np.ones(len(place))], axis=1) @ pose[:3, :3].T
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    eye = np.broadcast_to(pose[:3, 3], d.shape).astype(np.float32, order="C")
    camera = Rays("camera", eye, d.astype(np.float32))
    _, face, distance = traced.trace(camera.origins, camera.directions, np.inf, False, True, False, "")
    hit = face >= 0
    corners = np.asarray(vertices, np.float64)[np.asarray(faces)[face[hit]]]
    n = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    n *= -np.sign(np.sum(n * d[hit], axis=1, keepdims=True))
    start = pose[:3, 3] + d[hit] * distance[hit, None] + 1e-4 * n
    w = rng.normal(size=n.shape)
    w = n + w / np.linalg.norm(w, axis=1, keepdims=True)
    w /= np.linalg.norm(w, axis=1, keepdims=True)
    light = np.array([0.0, 0.95, 0.5]) + rng.uniform(-0.25, 0.25, n.shape) * [1, 0, 1] if len(faces) < 100 else (
        np.array([3.0, 4.0, 4.0]) + rng.uniform(-0.5, 0.5, n.shape)
    )
    return [
        camera,
        Rays("bounce", start.astype(np.float32), w.astype(np.float32)),
        Rays("shadow", start.astype(np.float32), (light - start).astype(np.float32), 0.999),
    ]


def take_turns(calls: dict[str, Callable[[], float]]) -> dict[str, float]:
    """Least seconds of each call over some runs in turn."""
    seconds = {name: [call() for _ in range(1)] for name, call in calls.items()}
    for _ in range(RUNS):
        for name, call in calls.items():
            seconds[name].append(call())
    return {name: min(values) for name, values in seconds.items()}


def measure_rates(traced: _native.RayScene, triangles: int, rays: Rays) -> RateRow:
    """Engine and Embree over the same rays."""
    shadow, coherent = rays.kind == "shadow", rays.kind == "camera"
    args = (rays.origins, rays.directions, rays.far, shadow, coherent)
    calls: dict[str, Callable[[], float]] = {}
    for name in instruction_sets():
        calls[name] = lambda name=name: traced.trace(*args, False, name)[0]  # type: ignore[misc]
    for width in EMBREE_WIDTHS:
        calls[f"embree{width}"] = lambda width=width: traced.trace_embree(*args, width)[0]  # type: ignore[misc]
    rate = {name: len(rays) / seconds / 1e6 for name, seconds in take_turns(calls).items()}
    return RateRow(
        triangles, rays.kind, {name: rate[name] for name in instruction_sets()},
        {str(width): rate[f"embree{width}"] for width in EMBREE_WIDTHS},
    )  # fmt: skip


def tiny_mesh(triangles: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """The Cornell box with fewer triangles, or with those of further boxes inside."""
    vertices, faces = joined(scenes.neutral("cornell_box"))
    rng = np.random.default_rng(1)
    while len(faces) < triangles:
        block = vertices[-28:-4] * 0.25 + rng.uniform(-0.6, 0.6, 3)
        more = faces[-26:-2] - faces[-26:-2].min()
        vertices, faces = np.concatenate([block, vertices]), np.concatenate([more, faces + len(block)])
    return vertices, faces[len(faces) - triangles :] if triangles > 36 else faces[:triangles]


def measure_tiny(threads: int, triangles: int) -> list[TinyRow]:
    """Compare testing all triangles with the BVH."""
    vertices, faces = tiny_mesh(triangles)
    traced = ray_scene(vertices, faces, threads)
    rows = []
    for rays in make_rays(traced, vertices, faces, scenes.neutral("cornell_box")["camera"]["to_world"]):
        args = (rays.origins, rays.directions, rays.far, rays.kind == "shadow", rays.kind == "camera")
        seconds = take_turns({
            "brute_force": lambda args=args: traced.trace(*args, True, "")[0],  # type: ignore[misc]
            "bvh": lambda args=args: traced.trace(*args, False, "")[0],  # type: ignore[misc]
        })
        rates = {name: len(rays) / s / 1e6 for name, s in seconds.items()}
        rows.append(TinyRow(triangles, rays.kind, rates["brute_force"], rates["bvh"]))
    return rows


def measure_update(threads: int, cuts: int) -> UpdateRow:
    """Building, moving and colouring a displaced sphere."""
    data = scenes.dense_sphere(cuts)
    scene = peer_scenes.to_edgegrad(data)
    mesh = scene.meshes["mesh0"]
    still = mesh.vertices.copy()
    start = time.perf_counter()
    renderer = edgegrad.Renderer(scene, threads=threads, engine="native")
    build = time.perf_counter() - start
    renderer.render(spp=1)
    peak = peak_mib()
    traced = ray_scene(still, mesh.faces, threads)
    step = iter(range(1, 1000))

    def moved() -> NDArray[np.float64]:
        return still + 1e-4 * np.sin(next(step))

    def update() -> float:
        mesh.vertices = moved()
        start = time.perf_counter()
        renderer.update(["meshes.mesh0.vertices"])
        return time.perf_counter() - start

    def color() -> float:
        edgegrad.parameters.put(scene, "materials.mesh0.base_color", np.full(3, 0.3 + 1e-3 * next(step)))
        start = time.perf_counter()
        renderer.update(["materials.mesh0.base_color"])
        return time.perf_counter() - start

    update()
    positions = np.ascontiguousarray(moved(), np.float32)
    traced.refit(positions)
    seconds = take_turns({"update": update, "refit": lambda: traced.refit(positions), "color": color})
    return UpdateRow(
        len(mesh.faces), build, traced.build_seconds, seconds["update"], seconds["refit"], seconds["color"], peak
    )


def markdown(report: Report) -> str:
    """The report as text."""
    about = ", ".join(f"{key} {value}" for key, value in report.machine.items())
    lines = [f"# Ray throughput\n\n{about}. Millions of rays per second; best of {RUNS} runs in turn.\n"]
    if report.rates:
        sets, widths = list(report.rates[0].engine), list(report.rates[0].embree)
        lines += [
            "| triangles | rays | " + " | ".join(sets + [f"Embree {w}" for w in widths]) + " | best / Embree's best |",
            "|---" * (3 + len(sets) + len(widths)) + "|",
        ]
        for r in report.rates:
            ratio = max(r.engine.values()) / max(r.embree.values())
            cells = [f"{rate:.1f}" for rate in (*r.engine.values(), *r.embree.values())]
            lines.append(f"| {r.triangles:,} | {r.kind} | " + " | ".join(cells) + f" | {ratio:.2f} |")
    if report.tiny:
        lines += ["\n## Tiny scenes: every triangle against the BVH\n",
                  "| triangles | rays | all triangles | BVH | ratio |", "|---|---|---|---|---|"]
        lines += [f"| {t.triangles} | {t.kind} | {t.brute_force:.1f} | {t.bvh:.1f} | {t.brute_force / t.bvh:.2f} |"
                  for t in report.tiny]
    if report.updates:
        lines += ["\n## Updates (seconds)\n",
                  "| triangles | Renderer | Embree's build | moved | Embree's refit | ratio | colour | peak MiB |",
                  "|---|---|---|---|---|---|---|---|"]
        lines += [f"| {u.triangles:,} | {u.build:.3f} | {u.embree_build:.3f} | {u.update:.4f} | {u.embree_refit:.4f} | "
                  f"**{u.update / u.embree_refit:.2f}** | {u.color:.5f} | {u.peak_mib:.0f} |" for u in report.updates]
    return "\n".join(lines) + "\n"


def measure(sizes: Sequence[str], threads: int, tiny: bool, updates: bool) -> Report:
    """Run everything."""
    report = Report({"processor": processor(), "threads": threads})
    for count in TINY if tiny else ():
        report.tiny += measure_tiny(threads, count)
    for size in sizes:
        cuts = SIZES[size]
        data = scenes.dense_sphere(cuts) if cuts else scenes.neutral("cornell_box")
        vertices, faces = joined(data)
        traced = ray_scene(vertices, faces, threads)
        for rays in make_rays(traced, vertices, faces, data["camera"]["to_world"]):
            report.rates.append(measure_rates(traced, len(faces), rays))
        del traced
        if updates and cuts:
            report.updates.append(measure_update(threads, cuts))
    return report


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sizes", nargs="*", help=f"some of {', '.join(SIZES)} triangles (default: all)")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--no-tiny", action="store_true", help="leave the tiny scenes out")
    parser.add_argument("--no-updates", action="store_true", help="leave the updates out")
    parser.add_argument("--output", type=Path, default=Path("build/benchmarks"), help="folder of the report")
    arguments = parser.parse_args()
    if unknown := [size for size in arguments.sizes if size not in SIZES]:
        parser.error(f"unknown size {unknown[0]}; there are {', '.join(SIZES)}")
    report = measure(arguments.sizes or list(SIZES), arguments.threads, not arguments.no_tiny, not arguments.no_updates)
    text = markdown(report)
    print(text)
    arguments.output.mkdir(parents=True, exist_ok=True)
    (arguments.output / "throughput.md").write_text(text)
    (arguments.output / "throughput.json").write_text(json.dumps(asdict(report), indent=1))


if __name__ == "__main__":
    main()
