"""Find the motion of an object from a film: Blender and Cycles make it, the fit gets only the pictures.

    python blend_examples/track_film.py                       # 48 frames of 96 x 96 pixels
    python blend_examples/track_film.py --frames 12 --size 48 # a shorter one

The box flies along a curve and turns. Of its motion, the .blend that is fitted knows the first frame. The errors of
place and rotation before and after the fit are printed as JSON, as the means and the largest of all frames.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Euler, Matrix

from edgegrad_addon.command_line import main as edgegrad

OUTPUT = Path(__file__).resolve().parent / "output" / "film"
PLACE, TURN = 'objects["Box"].location', 'objects["Box"].rotation_euler'


def motion(part: float) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Place and rotation at a part of the whole film."""
    place = (-1.3 + 2.6 * part, 0.5 * math.sin(3.0 * part), 0.4 * math.sin(5.0 * part))
    return place, (0.3 * math.sin(4.0 * part), 0.5 * part, 0.3 + 1.6 * part)


def build(size: int) -> Any:
    """Make the scene: a box with sides of different colours above a floor; return the box."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine, scene.render.resolution_x, scene.render.resolution_y = "CYCLES", size, size
    scene.cycles.samples, scene.cycles.use_adaptive_sampling, scene.cycles.use_denoising = 128, False, False
    scene.cycles.max_bounces = 1
    scene.view_settings.view_transform = "Standard"
    scene.world = bpy.data.worlds.new("World")
    scene.world.color = (0.25, 0.28, 0.32)
    bpy.ops.mesh.primitive_plane_add(size=30.0, location=(0.0, 0.0, -1.2))
    bpy.context.object.data.materials.append(material("Floor", (0.4, 0.4, 0.4)))
    bpy.ops.mesh.primitive_cube_add(size=1.0)
    box = bpy.context.object
    box.name = "Box"
    box.data.transform(Matrix.Diagonal((1.0, 0.7, 0.5, 1.0)))
    for k, color in enumerate(((0.7, 0.15, 0.1), (0.1, 0.5, 0.2), (0.1, 0.2, 0.7))):
        box.data.materials.append(material(f"Side{k}", color))
    for k, side in enumerate(box.data.polygons):
        side.material_index = k % 3
    bpy.ops.object.light_add(type="AREA", location=(1.5, -2.5, 4.0), rotation=(0.5, 0.3, 0.0))
    bpy.context.object.data.energy, bpy.context.object.data.size = 200.0, 1.5
    bpy.ops.object.camera_add(location=(0.0, -6.0, 1.5), rotation=(1.33, 0.0, 0.0))
    bpy.context.object.name = "Camera"
    bpy.context.object.data.lens = 42.0
    scene.camera = bpy.context.object
    return box


def material(name: str, color: tuple[float, float, float]) -> Any:
    """Make a diffuse material."""
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    shader = made.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*color, 1.0)
    shader.inputs["Specular IOR Level"].default_value = 0.0
    shader.inputs["Roughness"].default_value = 1.0
    return made


def make_film(folder: Path, frames: int, size: int, length: int = 48) -> None:
    """Render the pictures by Cycles, and save the scene that knows the first frame; `length`: frames of the motion."""
    box, scene = build(size), bpy.context.scene
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    for frame in range(1, frames + 1):
        box.location, box.rotation_euler = motion((frame - 1) / (length - 1))
        scene.frame_current, scene.cycles.seed = frame, frame
        scene.render.filepath = str(folder / f"film.{frame:04d}.exr")
        bpy.ops.render.render(write_still=True)
    box.location, box.rotation_euler = motion(0.0)
    scene.frame_set(1)
    for name in ("location", "rotation_euler"):
        box.keyframe_insert(name, frame=1)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "start.blend"))


def errors(blend: Path, frames: int, length: int = 48) -> dict[str, float]:
    """Errors of the keyed motion in a .blend: of places in Blender's units, of rotations in degrees."""
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    box, far, turned = bpy.data.objects["Box"], [], []
    for frame in range(1, frames + 1):
        bpy.context.scene.frame_set(frame)
        place, turn = motion((frame - 1) / (length - 1))
        far.append(float(np.linalg.norm(np.array(box.location) - place)))
        turned.append(math.degrees(box.rotation_euler.to_quaternion().rotation_difference(
            Euler(turn).to_quaternion()).angle))  # fmt: skip
    return {"place": round(float(np.mean(far)), 4), "place, largest": round(max(far), 4),
            "degrees": round(float(np.mean(turned)), 2), "degrees, largest": round(max(turned), 2)}  # fmt: skip


def track(folder: Path, frames: int, size: int, iterations: int, *more: str) -> dict[str, Any]:
    """Make the film, find the motion, and return the errors before and after, and the seconds of the fit."""
    folder.mkdir(parents=True, exist_ok=True)
    make_film(folder, frames, size)
    began, cpu = time.monotonic(), time.process_time()
    code = edgegrad(["fit", str(folder / "start.blend"), "--frames", f"1:{frames}", "--target",
                     f"Camera={folder / 'film.%04d.exr'}", "--parameter", PLACE, "--parameter", TURN, "--iterations",
                     str(iterations), "--samples", "4", "--first-every", "4", "--save", str(folder / "found.blend"),
                     *more])  # fmt: skip
    if code:
        raise SystemExit(code)
    seconds, cpu = round(time.monotonic() - began, 1), round(time.process_time() - cpu, 1)
    return {"before": errors(folder / "start.blend", frames), "after": errors(folder / "found.blend", frames),
            "seconds": seconds, "CPU seconds": cpu}  # fmt: skip


def main() -> int:
    """Run the example; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=48, help="number of frames (default: 48)")
    parser.add_argument("--size", type=int, default=96, help="pixels of each side (default: 96)")
    parser.add_argument("--iterations", type=int, default=80, help="steps of the first frame (default: 80)")
    given = parser.parse_args()
    print(json.dumps(track(OUTPUT, given.frames, given.size, given.iterations, "--out", str(OUTPUT))))
    return 0


if __name__ == "__main__":
    sys.exit(main())
