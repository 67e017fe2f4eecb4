"""The same sculpt refined twice from Cycles pictures, as a mesh and as a distance field, side by side.

    python blend_examples/sculpt_both_ways.py

Both fits begin with the same wrong shape and get the same pictures, iterations and samples; the colours are known. The
picture goes to blend_examples/output/sculpt_both_ways.png. The last line printed is JSON: for the start, the mesh and
the field, the Chamfer distance as a fraction of the diagonal of the sculpt's bounding box and the root mean square
error of the pictures, and the seconds and CPU seconds of both fits.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import replace
from typing import Any

import bpy
import build_sculpt  # type: ignore[import-not-found]
import numpy as np
from build_sculpt import SCULPT
from open_holes import draw, pictures_of  # type: ignore[import-not-found]

from edgegrad import FieldSteps, Mesh, Scene, Target, distance_fields, fit, images
from edgegrad.progress import ProgressBar
from edgegrad_addon.export import export_scene

OUTPUT = build_sculpt.OUTPUT
SIZE = 96  # pixels along each side of the pictures
CELLS = 48  # of the field, along its longest side
ITERATIONS, SAMPLES, VIEWS_PER_ITERATION = 60, 4, 4
VERTEX_STEP = 0.009  # metres
FIELD_STEP = 0.25  # cells, about 15 mm
# What is wrong is as smooth as strokes of brushes: no topology is to change.
FIELD_STEPS = FieldSteps(topology_every=0, smoothness=8.0, laplacian=0.1)


def build() -> tuple[Scene, list[Target], Mesh]:
    """Render the true sculpt with Cycles; returns the scene with the wrong one, the pictures and the true mesh."""
    sculpt = build_sculpt.build_true_scene()
    mesh = sculpt.data
    mesh.polygons.foreach_set("material_index", np.zeros(len(mesh.polygons), np.int32))
    mesh.shade_smooth()
    build_sculpt.set_up_cycles(bpy.context.scene, SIZE)
    pictures = build_sculpt.render_targets(OUTPUT)
    true = export_scene(bpy.context.scene).scene.meshes[SCULPT]
    build_sculpt.write_points(mesh, build_sculpt.deform(mesh))
    export = export_scene(bpy.context.scene, [bpy.data.objects[name] for name in pictures])
    seen = zip(pictures.values(), export.views, strict=True)
    return export.scene, [Target(images.read_image(path), view) for path, view in seen], true


def fitted(scene: Scene, targets: list[Target], path: str, iterations: int, step: float) -> dict[str, float]:
    """Fit one parameter of the scene; returns the seconds that it took."""
    cpu, seconds = time.process_time(), time.monotonic()
    with ProgressBar(path) as bar:
        fit(scene, targets, [path], iterations=iterations, spp=SAMPLES, views_per_iteration=VIEWS_PER_ITERATION,
            field_steps=FIELD_STEPS if path.startswith("fields.") else None, step_sizes={path: step},
            progress=bar.update)  # fmt: skip
    return {"seconds": time.monotonic() - seconds, "cpu_seconds": time.process_time() - cpu}


def main() -> int:
    """Build, fit both ways, measure and draw; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--iterations", type=int, default=ITERATIONS)
    given = parser.parse_args()
    OUTPUT.mkdir(parents=True, exist_ok=True)
    start, targets, truth = build()
    wrong = start.meshes[SCULPT]
    field = distance_fields.from_mesh(wrong, CELLS)
    by_mesh = replace(start, meshes={**start.meshes, SCULPT: replace(wrong, vertices=wrong.vertices.copy())})
    by_field = replace(start, meshes={k: one for k, one in start.meshes.items() if k != SCULPT}, fields={SCULPT: field})
    spent = {
        "mesh": fitted(by_mesh, targets, f"meshes.{SCULPT}.vertices", given.iterations, VERTEX_STEP),
        "field": fitted(by_field, targets, f"fields.{SCULPT}.values", given.iterations, FIELD_STEP),
    }
    results = {"start": (start, wrong), "mesh": (by_mesh, by_mesh.meshes[SCULPT]),
               "field": (by_field, distance_fields.to_mesh(by_field.fields[SCULPT]))}  # fmt: skip
    diagonal = float(np.linalg.norm(np.ptp(truth.vertices, axis=0)))
    goal = [np.asarray(target.image)[..., :3] for target in targets]
    rows, found = {"target (Cycles)": goal}, dict[str, Any]()
    for name, (scene, mesh) in results.items():
        rows[name] = pictures_of(scene, targets)
        away = distance_fields.chamfer_distance(mesh, truth, samples=2000) / diagonal
        error = np.sqrt(np.mean([np.mean((a - b) ** 2) for a, b in zip(rows[name], goal, strict=True)]))
        found[name] = {"chamfer": away, "image_error": float(error)} | spent.get(name, {})
    draw({name: rows[name] for name in ("start", "mesh", "field", "target (Cycles)")}, OUTPUT / "sculpt_both_ways.png")
    print(json.dumps({name: {k: round(v, 5) for k, v in one.items()} for name, one in found.items()}), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
