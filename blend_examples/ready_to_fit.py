"""Build .blend files whose fit is set up: open one in Blender with Edgegrad enabled, and press Fit.

    python -m blend_examples.ready_to_fit                       # writes all into blend_examples/output/ready/
    python -m blend_examples.ready_to_fit pose camera           # writes these

Each example is built as it should come out, rendered by Cycles, and then changed. Its folder has the .blend and the
pictures, which the .blend names by paths relative to itself. The same fits run without a window, from what is stored:

    python -m edgegrad fit blend_examples/output/ready/pose/pose.blend --save fitted.blend
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

import edgegrad_addon
from blend_examples import build_sculpt
from blend_examples.build_sculpt import add, diffuse, look_at, read_points, write_points
from edgegrad_addon import setups

OUTPUT = build_sculpt.OUTPUT / "ready"
SIZE = 160  # pixels along each side of the pictures
SAMPLES = 64  # Cycles' samples per pixel
TURN = 0.6  # of the posed bones, radians


@dataclass(frozen=True)
class Example:
    """A scene with something to find.

    Attributes
    ----------
    about
        What is found, and from what.
    task
        Name of the set-up (`edgegrad_addon.setups.SETUPS`).
    build
        Builds the scene as it should come out; returns a function that changes it into the start, and selects what is
        to be found.
    """

    about: str
    task: str
    build: Callable[[], Callable[[], None]]


def select(ob: Any) -> None:
    """Select one object and make it active."""
    for other in bpy.context.view_layer.objects:
        other.select_set(other == ob)
    bpy.context.view_layer.objects.active = ob


def stage(eye: Sequence[float] = (3.0, -5.0, 3.0), at: Sequence[float] = (0.0, 0.0, 0.9), lens: float = 50.0) -> None:
    """Make a scene with a floor, an area light, a grey world and one camera."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    floor = bpy.data.meshes.new("Floor")
    floor.from_pydata([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], [], [(0, 1, 2, 3)])
    floor.materials.append(diffuse("Floor", (0.35, 0.35, 0.35)))
    add("Floor", floor)
    light = bpy.data.lights.new("Key", "AREA")
    light.energy, light.size = 350.0, 1.0
    look_at(add("Key", light, (2.5, -3.0, 5.0)), np.array([0.0, 0.0, 0.9]))
    scene.world = bpy.data.worlds.new("World")
    if scene.world.node_tree is None:
        scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.2, 0.22, 0.25, 1.0)
    camera = bpy.data.cameras.new("Front")
    camera.lens = lens
    scene.camera = add("Front", camera, eye)
    look_at(scene.camera, np.array(at))


def solid(name: str, color: tuple[float, float, float], location: Sequence[float], make: Callable[[], Any]) -> Any:
    """Add an object by one of Blender's operators, with a diffuse material of its own."""
    make()
    ob = bpy.context.view_layer.objects.active
    ob.name = ob.data.name = name
    ob.location = location
    ob.data.materials.append(diffuse(name, color))
    return ob


def sculpt() -> Callable[[], None]:
    """A head whose cheeks are to become fuller, as one picture shows."""
    stage(lens=65.0)
    head = solid("Head", (0.7, 0.4, 0.25), (0.0, 0.0, 1.1), lambda: bpy.ops.mesh.primitive_monkey_add(size=2.2))
    head.rotation_euler.z = 0.4
    head.data.shade_smooth()
    thin = read_points(head.data)
    cheeks = 0.25 * np.exp(-6.0 * (thin[:, 2:] + 0.4) ** 2) * np.array([1.0, 0.6, 0.2])
    write_points(head.data, thin * (1.0 + cheeks))

    def start() -> None:
        write_points(head.data, thin)
        select(head)

    return start


def shape() -> Callable[[], None]:
    """A sculpture from pictures of all sides."""
    found = build_sculpt.build_true_scene()

    def start() -> None:
        write_points(found.data, build_sculpt.deform(found.data))
        select(found)

    return start


def materials() -> Callable[[], None]:
    """Colors of three things and the power of two lamps."""
    stage()
    ball = solid("Ball", (0.7, 0.2, 0.1), (-0.9, 0.0, 0.7), lambda: bpy.ops.mesh.primitive_uv_sphere_add(radius=0.7))
    ball.data.shade_smooth()
    solid("Box", (0.1, 0.35, 0.6), (0.8, 0.4, 0.6), lambda: bpy.ops.mesh.primitive_cube_add(size=1.2))
    solid("Cone", (0.25, 0.5, 0.15), (0.3, -1.0, 0.5), lambda: bpy.ops.mesh.primitive_cone_add(radius1=0.5, depth=1.0))
    side = bpy.data.lights.new("Side", "POINT")
    side.energy, side.shadow_soft_size = 150.0, 0.3
    add("Side", side, (-3.0, -1.5, 2.5))

    def start() -> None:
        for name in ("Ball", "Box", "Cone", "Floor"):
            node = bpy.data.materials[name].node_tree.nodes["Diffuse BSDF"]
            node.inputs["Color"].default_value = (0.4, 0.4, 0.4, 1.0)
        bpy.data.lights["Key"].energy, bpy.data.lights["Side"].energy = 250.0, 250.0

    return start


def pose() -> Callable[[], None]:
    """The pose of an arm of three bones."""
    stage(eye=(0.5, -6.5, 2.2), at=(0.4, 0.0, 1.3))
    arm = solid("Arm", (0.7, 0.45, 0.3), (0.0, 0.0, 1.5),
                lambda: bpy.ops.mesh.primitive_cylinder_add(vertices=24, radius=0.25, depth=3.0))  # fmt: skip
    bpy.ops.object.mode_set(mode="EDIT")
    for height in np.linspace(0.15, 2.85, 18):
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.mesh.bisect(plane_co=(0.0, 0.0, height), plane_no=(0.0, 0.0, 1.0))
    bpy.ops.object.mode_set(mode="OBJECT")
    rig = add("Rig", bpy.data.armatures.new("Rig"))
    select(rig)
    bpy.ops.object.mode_set(mode="EDIT")
    before = None
    for k, name in enumerate(("Upper", "Lower", "Hand")):
        bone = rig.data.edit_bones.new(name)
        bone.head, bone.tail, bone.parent, bone.use_connect = (0, 0, k), (0, 0, k + 1), before, before is not None
        before = bone
    bpy.ops.object.mode_set(mode="OBJECT")
    heights = read_points(arm.data)[:, 2] + 1.5
    for k, name in enumerate(("Upper", "Lower", "Hand")):
        group = arm.vertex_groups.new(name=name)
        # Neighbouring bones share the vertices near their joint; the shares of all bones sum to one.
        below = 1.0 if k == 0 else np.clip(0.5 + (heights - k) / 0.6, 0.0, 1.0)
        above = 0.0 if k == 2 else np.clip(0.5 + (heights - k - 1) / 0.6, 0.0, 1.0)
        for index, weight in enumerate(np.asarray(below - above).tolist()):
            if weight > 0.0:
                group.add([index], weight, "REPLACE")
    arm.modifiers.new("Rig", "ARMATURE").object = rig
    for bone in rig.pose.bones:
        bone.rotation_mode = "XYZ"
    rig.pose.bones["Lower"].rotation_euler = (0.0, 0.0, -TURN)
    rig.pose.bones["Hand"].rotation_euler = (0.2, 0.0, -TURN)

    def start() -> None:
        for bone in rig.pose.bones:
            bone.matrix_basis = Matrix()
        select(rig)

    return start


def shadow() -> Callable[[], None]:
    """The shape of a thing above the picture, from its shadow on the floor."""
    stage(eye=(0.0, -6.0, 2.5), at=(0.0, 0.0, 0.0), lens=70.0)
    key = bpy.data.objects["Key"]
    key.location, key.data.size = (0.0, 0.0, 7.0), 0.3
    look_at(key, np.array([0.0, 0.0, 0.0]))
    ball = solid("Hidden", (0.5, 0.5, 0.5), (0.0, 0.0, 3.2),
                 lambda: bpy.ops.mesh.primitive_ico_sphere_add(radius=0.55, subdivisions=4))  # fmt: skip
    points = read_points(ball.data)
    lobes = 1.0 + 0.3 * np.cos(3.0 * np.arctan2(points[:, 1], points[:, 0]))
    write_points(ball.data, points * np.stack([lobes, lobes, np.full_like(lobes, 0.5)], axis=1))

    def start() -> None:
        write_points(ball.data, points * np.array([1.0, 1.0, 0.5]))
        select(ball)

    return start


def camera() -> Callable[[], None]:
    """Place, rotation and lens of the camera that took a picture."""
    materials()
    front = bpy.context.scene.camera

    def start() -> None:
        front.location = (3.3, -4.6, 3.2)
        look_at(front, np.array([0.15, 0.1, 0.8]))
        front.data.lens = 46.0

    return start


EXAMPLES = {
    "sculpt": Example("a sculpt is corrected by one picture", "SCULPT", sculpt),
    "shape": Example("a shape is found from eight pictures of all sides", "SCULPT", shape),
    "materials": Example("colors and lamps are found from one picture", "MATERIALS", materials),
    "pose": Example("the pose of a rigged arm is found from one picture", "POSE", pose),
    "shadow": Example("the shape of a thing outside of the picture is found from its shadow", "SCULPT", shadow),
    "camera": Example("a camera is matched to its picture", "CAMERA", camera),
}


def build(name: str, output: Path = OUTPUT, size: int = SIZE, samples: int = SAMPLES) -> Path:
    """Write an example and its pictures into a folder of its own; returns the .blend."""
    example, folder = EXAMPLES[name], output / name
    folder.mkdir(parents=True, exist_ok=True)
    start = example.build()
    scene = bpy.context.scene
    build_sculpt.set_up_cycles(scene, size)
    scene.cycles.samples = samples
    pictures = build_sculpt.render_targets(folder)
    start()
    for camera, picture in pictures.items():
        row = scene.edgegrad.targets.add()
        row.camera, row.image = scene.objects[camera], f"//{picture.name}"
    setups.apply(bpy.context, example.task)
    path = folder / f"{name}.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True)
    return path


def main(names: Sequence[str]) -> None:
    """Build the examples that are named, or all."""
    edgegrad_addon.register()
    for name in names or EXAMPLES:
        if name not in EXAMPLES:
            sys.exit(f"there is no example '{name}'; there are {', '.join(EXAMPLES)}")
        print(f"{build(name)}: {EXAMPLES[name].about}")


if __name__ == "__main__":
    main(sys.argv[1:])
