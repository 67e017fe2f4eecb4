"""Fit a sphere to Suzanne from Cycles pictures, or one side of her from one picture with symmetry.

    python blend_examples/sculpt_suzanne.py sphere --views 6
    python blend_examples/sculpt_suzanne.py sphere --views 12 --size 64 --samples 4 --per-iteration 2
    python blend_examples/sculpt_suzanne.py side

A picture of start, result and truth goes to blend_examples/output/suzanne_NAME.png. The last line printed is JSON: mean
distances in percent of the diagonal of Suzanne's box, from the visible parts of the truth to the result and back, and
the pairs of faces that cross each other, before and after.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from build_sculpt import add, diffuse, look_at, read_points, set_up_cycles, write_points  # type: ignore[import-not-found]
from mathutils import Vector
from mathutils.bvhtree import BVHTree
from numpy.typing import NDArray

import edgegrad
from edgegrad import _native, images
from edgegrad.progress import ProgressBar
from edgegrad_addon.parameters import Names
from edgegrad_addon.session import Picture, Request, Session
from edgegrad_addon.vertex_options import VertexOptions

OUTPUT = Path(__file__).resolve().parent / "output"
F64 = NDArray[np.float64]
SAMPLES, DISTANCE = 64, 6.0  # Cycles' samples per pixel
# From all sides, so that the shape is brighter than the background everywhere: where it is as bright, an outline tells
# nothing.
LAMPS = ((3.0, -4.0, 4.0), (-4.5, -2.0, 1.5), (0.0, 4.5, 3.0), (4.0, 1.0, -3.0), (-1.0, -3.0, -4.0))
POWERS, BACKGROUND = (220.0, 60.0, 60.0, 60.0, 60.0), (0.03, 0.04, 0.06)
SHOWN = ((0.0, 0.3), (0.7, 0.8), (1.6, 0.2), (3.14, 0.8))  # azimuths and heights of the pictures of the result


def suzanne(levels: int) -> Any:
    """Suzanne's mesh, subdivided."""
    bpy.ops.mesh.primitive_monkey_add()
    made = bpy.context.object
    made.modifiers.new("Subdivision", "SUBSURF").levels = levels
    mesh = bpy.data.meshes.new_from_object(made.evaluated_get(bpy.context.evaluated_depsgraph_get()))
    bpy.data.objects.remove(made)
    return mesh


def sphere() -> Any:
    """A ball of quads that fills Suzanne's box roughly."""
    bpy.ops.mesh.primitive_cube_add(size=2.0)
    made = bpy.context.object
    divide = made.modifiers.new("Subdivide", "SUBSURF")
    divide.subdivision_type, divide.levels = "SIMPLE", 5
    mesh = bpy.data.meshes.new_from_object(made.evaluated_get(bpy.context.evaluated_depsgraph_get()))
    bpy.data.objects.remove(made)
    directions = np.tan(read_points(mesh) * np.pi / 4.0)
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    write_points(mesh, directions * (1.0, 0.85, 0.95))
    return mesh


def stage(mesh: Any, places: list[tuple[float, float]], size: int) -> Any:
    """One object under lamps before a dark background, and a camera at each place; returns the object."""
    scene = bpy.context.scene
    head = add("Head", mesh)
    mesh.materials.clear()
    mesh.materials.append(diffuse("Clay", (0.7, 0.6, 0.5)))
    mesh.shade_smooth()
    for number, (place, power) in enumerate(zip(LAMPS, POWERS, strict=True)):
        lamp = bpy.data.lights.new(f"Lamp {number}", "AREA")
        lamp.energy, lamp.size = power, 2.0
        look_at(add(lamp.name, lamp, place), np.zeros(3))
    world = bpy.data.worlds.new("World")
    if world.node_tree is None:
        world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (*BACKGROUND, 1.0)
    scene.world = world
    for k, (azimuth, height) in enumerate(places):
        lens = bpy.data.cameras.new(f"View {k:02d}")
        lens.lens = 62.0
        look_at(add(lens.name, lens, (DISTANCE * np.sin(azimuth), -DISTANCE * np.cos(azimuth), height)), np.zeros(3))
    scene.camera = bpy.data.objects["View 00"]
    set_up_cycles(scene, size)
    scene.cycles.samples = SAMPLES
    return head


def pictures(folder: Path) -> list[Picture]:
    """Render all cameras with Cycles."""
    scene, out = bpy.context.scene, []
    for camera in [ob for ob in scene.objects if ob.type == "CAMERA"]:
        scene.camera = camera
        scene.render.filepath = str(folder / f"suzanne_{camera.name.replace(' ', '_')}.exr")
        bpy.ops.render.render(write_still=True)
        out.append(Picture(camera.name, scene.render.filepath))
    return out


def triangles(mesh: Any) -> NDArray[np.int32]:
    """(m, 3) vertices of the triangles of a mesh."""
    mesh.calc_loop_triangles()
    out = np.empty((len(mesh.loop_triangles), 3), np.int32)
    mesh.loop_triangles.foreach_get("vertices", out.ravel())
    return out


def crossings(points: F64, faces: NDArray[np.int32]) -> int:
    """Number of pairs of faces that cross each other."""
    return len(_native.crossing_face_pairs(points, faces, 0))


def distances(points: F64, faces: NDArray[np.int32], of: F64, of_faces: NDArray[np.int32], eyes: F64) -> float:
    """Mean distance of the parts of a surface that some eye sees from another surface, in percent of its diagonal."""
    rng = np.random.default_rng(0)
    corners = points[faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    chosen = corners[rng.choice(len(faces), 6000, p=area / area.sum())]
    weight = rng.dirichlet((1.0, 1.0, 1.0), len(chosen))
    own, other = (BVHTree.FromPolygons(p.tolist(), f.tolist()) for p, f in ((points, faces), (of, of_faces)))
    found = []
    for place in np.einsum("nk,nkc->nc", weight, chosen):
        for eye in eyes:
            way = Vector(eye - place)
            if own.ray_cast(Vector(place) + 1e-3 * way.normalized(), way, way.length)[0] is None:
                found.append(other.find_nearest(Vector(place))[3])
                break
    return 100.0 * float(np.mean(found)) / float(np.linalg.norm(np.ptp(of, axis=0)))


def shown(points: F64, faces: NDArray[np.int32]) -> NDArray[np.float32]:
    """Pictures of a shape from several sides, in a row."""
    row = []
    for azimuth, height in SHOWN:
        pose = np.eye(4)
        eye = np.array([DISTANCE * np.sin(azimuth), -DISTANCE * np.cos(azimuth), height])
        pose[:3, :3] = np.array(Vector(eye).to_track_quat("Z", "Y").to_matrix())
        pose[:3, 3] = eye
        scene = edgegrad.Scene(
            edgegrad.Camera(pose, 0.56, 200, 200),
            {"head": edgegrad.Mesh(points, faces, ("clay",), smoothing=faces)},
            {"clay": edgegrad.Material(np.array([0.7, 0.6, 0.5]))},
            {f"lamp {k}": _lamp(*one) for k, one in enumerate(zip(LAMPS, POWERS, strict=True))},
            edgegrad.World(np.array(BACKGROUND)),
        )
        row.append(edgegrad.render(scene, spp=32, max_depth=2))
    return np.concatenate(row, axis=1)


def _lamp(place: tuple[float, float, float], power: float) -> edgegrad.AreaLight:
    pose = np.eye(4)
    pose[:3, :3] = np.array(Vector(place).to_track_quat("Z", "Y").to_matrix())
    pose[:3, 3] = place
    return edgegrad.AreaLight(pose, np.full(2, 2.0), power=power)


def perturbed_side(points: F64) -> F64:
    """Suzanne with the ear and the cheek on one side bent, by up to 8 % of her width."""
    amount = np.clip((points[:, :1] - 0.45) / 0.3, 0.0, 1.0)
    return points + 0.22 * amount * np.sin(3.0 * points[:, [2, 0, 1]] + (0.3, 1.0, 2.0))


def run(task: str, views: int, size: int, settings: dict[str, Any]) -> dict[str, Any]:
    """Make the pictures, fit with these settings of a request, measure and draw."""
    OUTPUT.mkdir(exist_ok=True)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if task == "sphere":
        places = [(2.0 * np.pi * k / views, (1.6, -1.2)[k % 2]) for k in range(views)]
    else:
        places = [(0.7, 0.6)]  # from the bent side
    head = stage(suzanne(2 if task == "sphere" else 1), places, size)
    truth, true_faces = read_points(head.data), triangles(head.data)
    targets = pictures(OUTPUT)
    options: dict[str, Any] = {}
    if task == "sphere":
        material = head.data.materials[0]
        head.data = sphere()
        head.data.materials.append(material)
        head.data.shade_smooth()
    else:
        write_points(head.data, perturbed_side(truth))
        options["vertex_options"] = {"Head": VertexOptions(symmetry="X")}
    start, faces = read_points(head.data), triangles(head.data)
    request = Request(targets, Names(vertices=("Head",)), in_place=True, **settings, **options)
    session = Session.prepare(bpy.context, request)
    with ProgressBar(f"{task}, {len(targets)} views") as bar:
        result = session.run(progress=bar.update)
    session.write(result)
    for note in result.notes:
        print(f"note: {note}", file=sys.stderr)
    found = read_points(head.data)
    name = f"suzanne_{task}" + (f"_{views}" if task == "sphere" else "")
    rows = [shown(start, faces), shown(found, faces), shown(truth, true_faces)]
    images.write_image(OUTPUT / f"{name}.png", np.concatenate(rows))
    np.savez(OUTPUT / f"{name}.npz", vertices=found, faces=faces)
    eyes = np.array([ob.matrix_world.translation for ob in bpy.context.scene.objects if ob.type == "CAMERA"])
    out: dict[str, Any] = {
        "truth to result": [distances(truth, true_faces, p, faces, eyes) for p in (start, found)],
        "result to truth": [distances(p, faces, truth, true_faces, eyes) for p in (start, found)],
        "crossings": [crossings(p, faces) for p in (start, found)],
        "loss": [result.losses[0], result.losses[result.best]],
        "seconds": result.seconds,
    }
    if task == "side":
        out["mean error of left and right"] = {
            side: [100.0 * float(np.linalg.norm(p - truth, axis=1)[of].mean() / np.linalg.norm(np.ptp(truth, axis=0)))
                   for p in (start, found)]
            for side, of in (("bent", truth[:, 0] > 0.6), ("other", truth[:, 0] < -0.6))
        }  # fmt: skip
    return out


def main() -> int:
    """Run what the command line names; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("task", choices=["sphere", "side"])
    parser.add_argument("--views", type=int, default=6)
    parser.add_argument("--iterations", type=int, default=200)
    parser.add_argument("--size", type=int, default=96, help="pixels along each side of the pictures")
    parser.add_argument("--samples", type=int, default=16, help="samples per pixel of each iteration")
    parser.add_argument("--per-iteration", type=int, help="views of each iteration (default: all)")
    arguments = parser.parse_args()
    settings = {"iterations": arguments.iterations, "samples": arguments.samples,
                "views_per_iteration": arguments.per_iteration}  # fmt: skip
    print(json.dumps(run(arguments.task, arguments.views, arguments.size, settings)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
