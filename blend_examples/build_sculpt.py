"""Build the sculpt example: a true scene, its Cycles pictures from eight sides, and a wrong scene to start from.

    python blend_examples/build_sculpt.py            # writes into blend_examples/output/

The sculpt hovers over the ground, so that no surfaces interpenetrate and low cameras see its underside. Cycles follows
direct light only, as this version of Edgegrad does, so that both evaluate the same integral.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Vector, noise
from numpy.typing import NDArray

OUTPUT = Path(__file__).resolve().parent / "output"
SIZE = 224  # pixels along each side of the pictures
SAMPLES = 64  # Cycles' samples per pixel
DIVISIONS = 32  # of a cube's edge; 6 n² + 2 vertices
CENTER = np.array([0.0, 0.0, 1.6])
SCULPT, MATERIALS = "Sculpt", ("Clay", "Glaze")
TRUE_COLORS = ((0.72, 0.33, 0.18), (0.12, 0.30, 0.33))
START_COLORS = ((0.45, 0.40, 0.45), (0.30, 0.25, 0.20))
# Cameras: (azimuth in degrees, height over the ground). The low ones look up at the underside.
VIEWS = ((0, 2.9), (90, 2.9), (180, 2.9), (270, 2.9), (45, 0.25), (135, 0.25), (225, 0.25), (315, 0.25))
DISTANCE = 5.0


def sculpt_mesh() -> Any:
    """The true shape: a ball of quads with a snout, a brow, two ears, and fine noise; glazed in patches."""
    bpy.ops.mesh.primitive_cube_add(size=2.0)
    cube = bpy.context.object
    subdivide = cube.modifiers.new("Subdivide", "SUBSURF")
    subdivide.subdivision_type = "SIMPLE"
    subdivide.levels = int(np.log2(DIVISIONS))
    evaluated = cube.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = bpy.data.meshes.new_from_object(evaluated)
    bpy.data.objects.remove(cube)
    mesh.name = SCULPT
    points = read_points(mesh)
    # Equal angles instead of equal steps, so that quads at the cube's corners are not squeezed.
    directions = np.tan(points * np.pi / 4.0)
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    write_points(mesh, directions * _radius(directions)[:, None])
    mesh.shade_flat()
    for name, color in zip(MATERIALS, TRUE_COLORS, strict=True):
        mesh.materials.append(diffuse(name, color))
    for face in mesh.polygons:
        face.material_index = int(noise.noise(2.8 * face.center.normalized() + Vector((5.0, 1.0, 3.0))) > 0.05)
    return mesh


def _radius(directions: NDArray[np.float64]) -> NDArray[np.float64]:
    radius = np.full(len(directions), 0.85)
    #         towards             height  width (radians)
    bumps = (((0.0, -1.0, -0.1), 0.28, 0.42), ((0.0, -0.8, 0.55), 0.10, 0.30), ((0.75, 0.1, 0.65), 0.42, 0.28),
             ((-0.75, 0.1, 0.65), 0.42, 0.28), ((0.45, -0.85, 0.2), -0.14, 0.22),
             ((-0.45, -0.85, 0.2), -0.14, 0.22), ((0.0, 0.9, -0.4), 0.18, 0.5))  # fmt: skip
    for towards, height, width in bumps:
        axis = np.array(towards) / np.linalg.norm(towards)
        angle = np.arccos(np.clip(directions @ axis, -1.0, 1.0))
        radius += height * np.exp(-((angle / width) ** 2))
    fine = np.array([noise.fractal(Vector(3.5 * d), 1.0, 2.0, 4) for d in directions])
    return radius + 0.035 * fine


def deform(mesh: Any) -> NDArray[np.float64]:
    """(n, 3) vertices of the wrong start: broad strokes that inflate and deflate, as sculpting brushes do.

    Vertices move along the surface's normals, smoothed so that fine detail rides along unchanged.
    """
    points = read_points(mesh)
    x, y, z = (points / np.linalg.norm(points, axis=1)[:, None]).T
    stroke = 0.09 * x + 0.07 * np.sin(2.2 * z + 0.7) - 0.09 * x * y + 0.06 * (3.0 * z * z - 1.0) / 2.0 + 0.05 * y * z
    return points + stroke[:, None] * _smooth_normals(mesh)


def _smooth_normals(mesh: Any, rounds: int = 25) -> NDArray[np.float64]:
    """(n, 3) vertex normals, averaged over neighbours several times."""
    normals = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertex_normals.foreach_get("vector", normals.ravel())
    edges = np.empty((len(mesh.edges), 2), np.int32)
    mesh.edges.foreach_get("vertices", edges.ravel())
    out = normals.astype(np.float64)
    for _ in range(rounds):
        total = out.copy()
        np.add.at(total, edges[:, 0], out[edges[:, 1]])
        np.add.at(total, edges[:, 1], out[edges[:, 0]])
        out = total / np.linalg.norm(total, axis=1)[:, None]
    return out


def read_points(mesh: Any) -> NDArray[np.float64]:
    """(n, 3) vertices of a mesh."""
    points = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("co", points.ravel())
    return points.astype(np.float64)


def write_points(mesh: Any, points: NDArray[np.float64]) -> None:
    """Replace a mesh's vertices."""
    mesh.vertices.foreach_set("co", np.ascontiguousarray(points, np.float32).ravel())
    mesh.update()


def diffuse(name: str, color: tuple[float, float, float]) -> Any:
    """A material with one Diffuse node."""
    material = bpy.data.materials.new(name)
    if material.node_tree is None:
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    node = tree.nodes.new("ShaderNodeBsdfDiffuse")
    node.inputs["Color"].default_value = (*color, 1.0)
    tree.links.new(node.outputs["BSDF"], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


def add(name: str, data: Any, location: Any = (0.0, 0.0, 0.0)) -> Any:
    """A new object in the scene."""
    ob = bpy.data.objects.new(name, data)
    ob.location = location
    bpy.context.scene.collection.objects.link(ob)
    return ob


def look_at(ob: Any, point: NDArray[np.float64]) -> None:
    """Turn an object's -Z towards a point, its Y upwards."""
    ob.rotation_euler = (Vector(point) - ob.location).to_track_quat("-Z", "Y").to_euler()


def build_true_scene() -> Any:
    """The scene as it should come out; returns the sculpt's object."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    sculpt = add(SCULPT, sculpt_mesh(), CENTER)
    ground = bpy.data.meshes.new("Ground")
    half = 12.0
    ground.from_pydata([(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)], [], [(0, 1, 2, 3)])
    ground.materials.append(diffuse("Floor", (0.25, 0.27, 0.30)))
    add("Ground", ground)
    light = bpy.data.lights.new("Key", "AREA")
    light.energy, light.size = 350.0, 1.5
    key = add("Key", light, (2.5, -3.0, 5.5))
    look_at(key, CENTER)
    world = bpy.data.worlds.new("World")
    scene.world = world
    if world.node_tree is None:
        world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.45, 0.5, 0.6, 1.0)
    for azimuth, height in VIEWS:
        lens = bpy.data.cameras.new(f"View {azimuth:03d}")
        lens.lens = 68.0
        angle = np.radians(azimuth)
        camera = add(lens.name, lens, (DISTANCE * np.sin(angle), -DISTANCE * np.cos(angle), height))
        look_at(camera, CENTER)
    scene.camera = bpy.data.objects[f"View {VIEWS[0][0]:03d}"]
    # Half of the samples of other examples: the error of the shape hardly grows (docs/measurements.md)
    set_up_cycles(scene, samples=SAMPLES // 2)
    return sculpt


def set_up_cycles(scene: Any, size: int = SIZE, samples: int = SAMPLES) -> None:
    """Cycles with direct light only, a box filter, and square pictures of `size` pixels a side."""
    scene.render.engine = "CYCLES"
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    cycles = scene.cycles
    cycles.device, cycles.samples, cycles.seed = "CPU", samples, 0
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.pixel_filter_type = "BOX"
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = 0
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGB", "32"


def render_targets(folder: Path) -> dict[str, Path]:
    """Render every camera with Cycles; returns camera name -> EXR file."""
    scene = bpy.context.scene
    active = scene.camera
    scene.render.use_persistent_data = True
    targets = {}
    cameras = sorted((ob for ob in scene.objects if ob.type == "CAMERA"), key=lambda ob: str(ob.name))
    for number, camera in enumerate(cameras, 1):
        scene.camera = camera
        targets[camera.name] = folder / f"target_{camera.name.replace(' ', '_')}.exr"
        scene.render.filepath = str(targets[camera.name])
        bpy.ops.render.render(write_still=True)
        print(f"Cycles target {number} of {len(cameras)}: {targets[camera.name].name}", file=sys.stderr)
    scene.camera = active
    scene.render.use_persistent_data = False
    return targets


def build(folder: Path = OUTPUT) -> dict[str, Path]:
    """Write true.blend, the targets, and start.blend into the folder; returns camera name -> target."""
    folder.mkdir(parents=True, exist_ok=True)
    sculpt = build_true_scene()
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "true.blend"), compress=True)
    targets = render_targets(folder)
    write_points(sculpt.data, deform(sculpt.data))
    for name, color in zip(MATERIALS, START_COLORS, strict=True):
        bpy.data.materials[name].node_tree.nodes["Diffuse BSDF"].inputs["Color"].default_value = (*color, 1.0)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "start.blend"), compress=True)
    (folder / "targets.json").write_text(json.dumps({name: str(path) for name, path in targets.items()}, indent=2))
    return targets


if __name__ == "__main__":
    build()
