"""Seconds and memory over the size of a scene: ``python -m tests.benchmarks.scaling [--only KIND] [--most SIZE]``.

Each line is measured in a process of its own. Seconds are of the processor (user and system, all threads), so that
other work on the machine does not count; memory is the largest that the process has had.
"""

from __future__ import annotations

import argparse
import multiprocessing
import resource
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from edgegrad import Camera, Image, Material, Mesh, Renderer, Scene, SunLight, World, plan
from edgegrad.expression import Attribute, Expression, ImageTexture, Math
from edgegrad.rendering.taken_over import TakenOver
from edgegrad.tables.tables import flatten
from edgegrad.tables.textures.program import compile_textures
from tests.support.shapes import ball, cube, sheet

SIZES = {
    "meshes": (1, 100, 10_000, 100_000),
    "touching meshes": (1_000, 10_000, 100_000),
    "boxes on a floor": (100, 1_000),
    "moving meshes": (1_000, 10_000),
    "crossing balls": (768, 12_288, 196_608),
    "touching sheets": (1_000, 10_000, 100_000),
    "materials": (100, 1_000, 10_000),
    "nodes": (500, 2_000, 10_000),
    "texels": (1024**2, 2048**2, 4096**2, 8192**2, 16384**2),
    "instances": (1_000, 10_000, 100_000),
}
SPP, PIXELS, DEPTH = 16, 128, 3


def places(count: int, gap: float) -> np.ndarray:
    """(count, 3) a cubic grid."""
    side = int(np.ceil(count ** (1.0 / 3.0)))
    k = np.arange(count)
    return gap * np.stack([k % side, k // side % side, k // side**2], axis=1)


def scene(meshes: dict[str, Mesh], extent: float, materials: dict[str, Material] | None = None) -> Scene:
    pose = np.eye(4)
    pose[:3, 3] = [0.5 * extent, 0.5 * extent, 3.0 * extent + 5.0]
    return Scene(Camera(to_world=pose, width=PIXELS, height=PIXELS), meshes,
                 materials or {"clay": Material(np.full(3, 0.8))}, {"sun": SunLight(np.array([0.3, 0.2, -1.0]))},
                 World(np.full(3, 0.3)))


def of_meshes(count: int, gap: float = 3.0) -> tuple[Scene, list[str]]:
    vertices, faces = cube()
    at = places(count, gap)
    return (scene({f"box{k}": Mesh(vertices + at[k], faces, ("clay",)) for k in range(count)}, float(at.max())),
            ["meshes.box0.vertices"])


def all_moving(count: int) -> tuple[Scene, list[str]]:
    made, _ = of_meshes(count)
    return made, [f"meshes.{name}.vertices" for name in made.meshes]


def on_floor(count: int) -> tuple[Scene, list[str]]:
    """Boxes that all move, on a floor of 100,000 faces."""
    made, _ = of_meshes(count)
    extent = max(float(np.asarray(mesh.vertices).max()) for mesh in made.meshes.values())
    vertices, faces = sheet(224, 2.0 * extent)
    for mesh in made.meshes.values():
        mesh.vertices[:, 2] -= mesh.vertices[:, 2].min()
    wrt = [f"meshes.{name}.vertices" for name in made.meshes]
    made.meshes = {**made.meshes, "floor": Mesh(vertices + [extent, extent, 0.0], faces, ("clay",))}
    return made, wrt


def of_balls(count: int) -> tuple[Scene, list[str]]:
    """Two balls of `count` faces that pass through each other, of which one moves."""
    vertices, faces = ball(round(np.log(count / 12.0) / np.log(4.0)))
    balls = {name: Mesh(vertices + [x, 0.0, 0.0], faces, ("clay",)) for name, x in (("one", 0.0), ("other", 0.9))}
    return scene(balls, 2.0), ["meshes.one.vertices"]


def of_sheets(count: int) -> tuple[Scene, list[str]]:
    """Two sheets of `count` faces in one plane, turned against each other, of which one moves."""
    vertices, faces = sheet(round(np.sqrt(count / 2.0)))
    turn = np.array([[np.cos(0.3), -np.sin(0.3), 0.0], [np.sin(0.3), np.cos(0.3), 0.0], [0.0, 0.0, 1.0]])
    return (scene({"one": Mesh(vertices @ turn.T, faces, ("clay",)), "other": Mesh(vertices, faces, ("clay",))}, 2.0),
            ["meshes.one.vertices"])


def of_materials(count: int) -> tuple[Scene, list[str]]:
    vertices, faces = cube()
    materials = {f"m{k}": Material(np.full(3, 0.5)) for k in range(count)}
    slots = (np.arange(len(faces)) % count).astype(np.int32)
    mesh = Mesh(vertices, faces, tuple(materials), slots)
    return scene({"box": mesh}, 2.0, materials), [f"materials.m{k}.base_color" for k in range(count)]


def of_nodes(count: int) -> tuple[Scene, list[str]]:
    vertices, faces = cube()
    node: Expression = Attribute("values")
    for k in range(count):
        node = Math("ADD", node, 1e-4 * k)
    box = Mesh(vertices, faces, ("clay",), attributes={"values": np.full((*faces.shape, 1), 0.3, np.float32)})
    return scene({"box": box}, 2.0, {"clay": Material(textures={"roughness": node})}), ["materials.clay.base_color"]


def of_texels(count: int) -> tuple[Scene, list[str]]:
    vertices, faces = cube()
    rng = np.random.default_rng(0)
    side = round(count**0.5)
    uv = {"UVMap": rng.random((len(faces), 3, 2)).astype(np.float32)}
    materials = {"clay": Material(textures={"base_color": ImageTexture("image", Attribute("UVMap"))})}
    out = scene({"box": Mesh(vertices, faces, ("clay",), attributes=uv)}, 2.0, materials)
    out.images = {"image": Image(rng.random((side, side, 3), dtype=np.float32))}
    return out, ["images.image.pixels"]


def of_instances(count: int) -> tuple[Scene, list[str]]:
    vertices, faces = ball(2)
    at = places(count, 3.0)
    matrices = np.tile(np.eye(4), (count, 1, 1))
    matrices[:, :3, 3] = at
    return scene({"ball": Mesh(vertices, faces, ("clay",), instances=matrices)}, float(at.max())), [
        "meshes.ball.instances"]


MAKE: dict[str, Callable[[int], tuple[Scene, list[str]]]] = {
    "meshes": of_meshes, "touching meshes": lambda count: of_meshes(count, 2.0),
    "boxes on a floor": on_floor, "moving meshes": all_moving, "crossing balls": of_balls,
    "touching sheets": of_sheets, "materials": of_materials, "nodes": of_nodes, "texels": of_texels,
    "instances": of_instances,
}  # fmt: skip
STEPS = ("validate", "flatten", "compile", "renderer", "render", "decide", "gradient", "again", "check",
         "plan", "replan", "alone", "plan/gradient", "replan/gradient")


def measure(kind: str, count: int) -> dict[str, float]:
    """Seconds by step, and gigabytes before the first and after the last."""
    made, wrt = MAKE[kind](count)
    found = {"before": gigabytes()}

    def timed(name: str, function: Callable[[], Any]) -> Any:
        start = time.process_time()
        out = function()
        found[name] = time.process_time() - start
        return out

    timed("validate", made.validate)
    timed("flatten", lambda: flatten(made))
    timed("compile", lambda: compile_textures(made) if kind == "nodes" else None)
    renderer = timed("renderer", lambda: Renderer(made))
    depth = 2 if kind == "nodes" else DEPTH
    timed("render", lambda: renderer.render(spp=SPP, max_depth=depth))
    adjoint = np.ones((PIXELS, PIXELS, 3), np.float32)
    timed("decide", lambda: renderer.decide(wrt, max_depth=depth))

    def least(name: str, function: Callable[[], Any]) -> None:
        seconds = []
        for _ in range(3):
            timed(name, function)
            seconds.append(found[name])
        found[name] = min(seconds)

    def gradient() -> None:
        renderer.render_backward(adjoint, wrt, spp=SPP, max_depth=depth)

    timed("gradient", gradient)
    least("again", gradient)
    watch = TakenOver(made)
    timed("check", lambda: watch.check(made))  # a part of each of these calls
    # Of the renderer, which knows the scene's edges by now, and of the scene by itself.
    timed("plan", lambda: plan(renderer, wrt, max_depth=depth))
    least("replan", lambda: plan(renderer, wrt, max_depth=depth))
    timed("alone", lambda: plan(made, wrt, max_depth=depth))
    found["plan/gradient"], found["replan/gradient"] = (found[step] / found["again"] for step in ("plan", "replan"))
    found["after"] = gigabytes()
    return found


def gigabytes() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=SIZES)
    parser.add_argument("--most", type=int, default=10**9)
    options = parser.parse_args()
    widths = {step: max(10, len(step) + 2) for step in STEPS}
    heads = "".join(f"{step:>{width}}" for step, width in widths.items())
    print(f"{'':29}{heads}{'GB before':>11}{'GB after':>10}")
    with multiprocessing.get_context("spawn").Pool(1, maxtasksperchild=1) as pool:
        for kind, sizes in SIZES.items():
            for count in sizes if options.only in (None, kind) else ():
                if count <= options.most:
                    found = pool.apply(measure, (kind, count))
                    seconds = "".join(f"{found[step]:{width}.3f}" for step, width in widths.items())
                    print(f"{count:>11,} {kind:17}{seconds}{found['before']:11.2f}{found['after']:10.2f}", flush=True)


if __name__ == "__main__":
    main()
