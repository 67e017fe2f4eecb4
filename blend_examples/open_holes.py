"""A ball becomes a body with two holes: a distance field is fitted to 12 pictures by Cycles, without masks.

    python blend_examples/open_holes.py
    python blend_examples/open_holes.py --painted

With --painted, the body has colours that vary over its surface, and the fit finds them as well. The picture goes to
blend_examples/output/open_holes.png, or painted_holes.png. The last line printed is JSON: the Chamfer distance as a
fraction of the diagonal of the body's bounding box, the Euler number (-2 for two holes) and the number of parts of
start and result, the root mean square error of the colours, and the seconds and CPU seconds of the fit.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from typing import Any

import bpy
import build_sculpt  # type: ignore[import-not-found]
import matplotlib

matplotlib.use("Agg")
import numpy as np
from matplotlib import pyplot
from numpy.typing import NDArray

from edgegrad import Field, FieldSteps, Mesh, Renderer, Scene, Target, distance_fields, fit, images
from edgegrad.progress import ProgressBar
from edgegrad_addon.export import export_scene

F64 = NDArray[np.float64]
OUTPUT = build_sculpt.OUTPUT
BODY, CLAY, PAINT = "Body", "Clay", "Paint"
SIZE = 80  # pixels along each side of the pictures
CELLS = 32  # of the field, along each axis of its box from -1 to 1
TRUTH_CELLS = 40
VIEWS, DISTANCE = 12, 4.0
ITERATIONS, SAMPLES, VIEWS_PER_ITERATION = 72, 4, 4
TOPOLOGY_EVERY = 8
# Values of the colours along each axis, for a grid whose cells are twice as large as those of the field.
COLORS = CELLS // 2 + 1
# First step of the colours: they must be about right before holes are carved, which compares pictures.
COLOR_STEP = 0.1
# Weight against roughness: a larger one is smoother, and rounds the shape.
LAPLACIAN = 0.03


def grid(cells: int) -> F64:
    """Places of the coefficients of a field with this number of cells."""
    line = (np.arange(cells + 3) - 1.0) / cells * 2.0 - 1.0
    return np.stack(np.meshgrid(line, line, line, indexing="ij"), axis=-1)


def two_holes(p: F64) -> F64:
    """Distance from two tori that melt into each other."""
    rings = [np.hypot(np.hypot(p[..., 0] - x, p[..., 1]) - 0.36, p[..., 2]) - 0.17 for x in (-0.4, 0.4)]
    # The smooth minimum of both.
    width = 0.12
    part = np.clip(0.5 + 0.5 * (rings[1] - rings[0]) / width, 0.0, 1.0)
    return np.asarray(rings[1] * (1.0 - part) + rings[0] * part - width * part * (1.0 - part))


def turned(p: F64) -> F64:
    """Points in the frame of the body, which lies askew: no view looks along its axes."""
    c, s = np.cos(0.5), np.sin(0.5)
    return np.asarray(p @ np.array([[1, 0, 0], [0, c, s], [0, -s, c]]) @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]))


def paint(p: F64) -> F64:
    """Colours of places of the painted body."""
    return np.asarray(0.45 + 0.35 * np.sin(5.0 * turned(p) + [0.0, 2.0, 4.0]))


def build(is_painted: bool) -> tuple[Scene, list[Target], Mesh]:
    """Build the scene in Blender and render it with Cycles; returns the scene, its pictures and the true body."""
    truth = distance_fields.to_mesh(Field(two_holes(turned(grid(TRUTH_CELLS))).astype(np.float32), CLAY))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    mesh = bpy.data.meshes.new(BODY)
    mesh.from_pydata(truth.vertices.tolist(), [], truth.faces.tolist())
    clay = build_sculpt.diffuse(CLAY, (0.7, 0.7, 0.7))
    mesh.materials.append(clay)
    if is_painted:
        colors = np.concatenate([paint(truth.vertices), np.ones((len(truth.vertices), 1))], axis=1)
        mesh.color_attributes.new(PAINT, "FLOAT_COLOR", "POINT").data.foreach_set(
            "color", colors.astype(np.float32).ravel())  # fmt: skip
        tree = clay.node_tree
        node = tree.nodes.new("ShaderNodeVertexColor")
        node.layer_name = PAINT
        [shader] = [one for one in tree.nodes if one.type == "BSDF_DIFFUSE"]
        tree.links.new(node.outputs["Color"], shader.inputs["Color"])
    mesh.shade_smooth()
    build_sculpt.add(BODY, mesh)
    scene.world = coloured_sky()
    turn = np.pi * (3.0 - np.sqrt(5.0))  # places on a sphere: a golden spiral
    for k in range(VIEWS):
        height = 1.0 - 2.0 * (k + 0.5) / VIEWS
        lens = bpy.data.cameras.new(f"View {k:02d}")
        lens.angle = 0.52
        around = np.sqrt(1.0 - height**2) * np.array([np.cos(k * turn), np.sin(k * turn)])
        camera = build_sculpt.add(lens.name, lens, DISTANCE * np.append(around, height))
        build_sculpt.look_at(camera, np.zeros(3))
    scene.camera = bpy.data.objects["View 00"]
    build_sculpt.set_up_cycles(scene, SIZE)
    pictures = build_sculpt.render_targets(OUTPUT)
    export = export_scene(scene, [bpy.data.objects[name] for name in pictures])
    seen = zip(pictures.values(), export.views, strict=True)
    targets = [Target(images.read_image(path), view) for path, view in seen]
    return export.scene, targets, truth


def coloured_sky() -> Any:
    """A world whose colour differs in every direction, so that shading shows where a surface looks."""
    width, height = 32, 16
    latitude = ((np.arange(height) + 0.5) / height - 0.5) * np.pi
    longitude = (0.5 - (np.arange(width) + 0.5) / width) * 2.0 * np.pi
    level = np.cos(latitude)[:, None]
    towards = [level * np.cos(longitude), level * np.sin(longitude), np.sin(latitude)[:, None] + 0.0 * longitude]
    image = bpy.data.images.new("Sky", width, height, float_buffer=True)
    image.colorspace_settings.name = "Linear Rec.709"
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., :3] = 0.5 + 0.45 * np.stack(towards, axis=-1)
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    image.pack()
    world = bpy.data.worlds.new("World")
    if world.node_tree is None:
        world.use_nodes = True
    tree = world.node_tree
    node = tree.nodes.new("ShaderNodeTexEnvironment")
    node.image = image
    tree.links.new(node.outputs["Color"], tree.nodes["Background"].inputs["Color"])
    return world


def main() -> int:
    """Build, fit, measure and draw; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--iterations", type=int, default=ITERATIONS)
    parser.add_argument("--painted", action="store_true")
    given = parser.parse_args()
    OUTPUT.mkdir(parents=True, exist_ok=True)
    scene, targets, truth = build(given.painted)
    [material] = {mesh.materials[0] for mesh in scene.meshes.values()}
    scene.meshes = {}
    ball = Field((np.linalg.norm(grid(CELLS), axis=-1) - 0.7).astype(np.float32), material)
    wrt, step_sizes = ["fields.body.values"], {}
    if given.painted:
        ball.attributes = {PAINT: np.full((COLORS, COLORS, COLORS, 3), 0.5)}
        wrt.append(f"fields.body.attributes.{PAINT}")
        step_sizes = {wrt[1]: COLOR_STEP}
    scene.fields = {"body": ball}
    before = pictures_of(scene, targets)
    start = distance_fields.to_mesh(ball)
    steps = FieldSteps(topology_every=TOPOLOGY_EVERY, laplacian=LAPLACIAN, smoothness=2.0)
    cpu, seconds = time.process_time(), time.monotonic()
    with ProgressBar("Fitting") as bar:
        fit(scene, targets, wrt, iterations=given.iterations, spp=SAMPLES,
            views_per_iteration=VIEWS_PER_ITERATION, field_steps=steps, step_sizes=step_sizes,
            progress=bar.update)  # fmt: skip
    cpu, seconds = time.process_time() - cpu, time.monotonic() - seconds
    found = distance_fields.to_mesh(scene.fields["body"])
    rows = {"start": before, "target (Cycles)": [np.asarray(t.image)[..., :3] for t in targets],
            "fitted": pictures_of(scene, targets)}  # fmt: skip
    draw(rows, OUTPUT / ("painted_holes.png" if given.painted else "open_holes.png"))
    result: dict[str, float] = {}
    for name, mesh in (("start", start), ("result", found)):
        shape = distance_fields.topology(mesh)
        diagonal = float(np.linalg.norm(np.ptp(truth.vertices, axis=0)))
        apart = distance_fields.chamfer_distance(mesh, truth, samples=2000)
        result[f"chamfer_{name}"] = round(apart / diagonal, 5)
        result[f"euler_number_{name}"], result[f"parts_{name}"] = shape.euler_number, shape.components
    if given.painted:
        away = found.attributes[PAINT] - paint(found.vertices)[found.faces]
        result["color_error"] = round(float(np.sqrt(np.mean(away**2))), 4)
    print(json.dumps(result | {"seconds": round(seconds, 1), "cpu_seconds": round(cpu, 1)}), flush=True)
    return 0


def pictures_of(scene: Scene, targets: list[Target]) -> list[Any]:
    """The scene as the targets' cameras see it."""
    renderer = Renderer(scene)
    return [renderer.render(spp=64, max_depth=2, camera=target.camera) for target in targets]


def draw(rows: dict[str, list[Any]], path: Path) -> None:
    """Every other view, a row for each kind of picture."""
    columns = len(next(iter(rows.values()))) // 2
    figure, axes = pyplot.subplots(len(rows), columns, figsize=(1.3 * columns, 1.35 * len(rows)), squeeze=False)
    for line, (label, pictures) in zip(axes, rows.items(), strict=True):
        line[0].set_ylabel(label, fontsize=8)
        for axis, picture in zip(line, pictures[::2], strict=True):
            axis.imshow(images.linear_to_srgb(np.clip(picture, 0.0, 1.0)))
            axis.set_xticks([])
            axis.set_yticks([])
    figure.tight_layout(pad=0.3)
    figure.savefig(path, dpi=100)
    pyplot.close(figure)


if __name__ == "__main__":
    sys.exit(main())
