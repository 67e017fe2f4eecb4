"""Shared code of the builders: an empty scene, nodes from nested calls, common meshes, lamps and cameras."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import bmesh
import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

WIDTH, HEIGHT = 160, 120

Shader = Callable[[Any], Any]
Inputs = Mapping[Any, Any]  # by name or number


def empty() -> Any:
    """A scene with nothing in it, rendered by Cycles at the comparison's size; returns Blender's scene."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
    scene.render.resolution_percentage = 100
    return scene


# ------------------------------------------------------------------------------------------------ objects
def add(name: str, data: Any, location: Any = (0, 0, 0), rotation: Any = (0, 0, 0), scale: Any = (1, 1, 1)) -> Any:
    """A new object in the scene; a single number scales all axes."""
    ob = bpy.data.objects.new(name, data)
    ob.location, ob.rotation_euler = location, rotation
    ob.scale = scale if isinstance(scale, Sequence) else (scale,) * 3
    bpy.context.scene.collection.objects.link(ob)
    return ob


def aim(location: Any, target: Any) -> Any:
    """Euler angles that turn -Z from location to target, with +Y up (cameras, lamps)."""
    return (Vector(target) - Vector(location)).to_track_quat("-Z", "Y").to_euler()


def camera(location: Any, target: Any, lens: float = 50.0) -> Any:
    """The active camera."""
    ob = add("Camera", bpy.data.cameras.new("Camera"), location, aim(location, target))
    ob.data.lens = lens
    bpy.context.scene.camera = ob
    return ob


def lamp(kind: str, name: str, energy: float, location: Any = (0, 0, 0), target: Any = None, **settings: Any) -> Any:
    """A light object that shines at the target; settings are those of its data, or else of the object."""
    data = bpy.data.lights.new(name, kind)
    data.energy = energy
    ob = add(name, data, location, (0, 0, 0) if target is None else aim(location, target))
    for key, value in settings.items():
        setattr(data if hasattr(data, key) else ob, key, value)
    return ob


def world(color: Any = (1, 1, 1), strength: float = 1.0) -> Any:
    """A world of one colour; returns its node tree."""
    made = bpy.data.worlds.new("World")
    bpy.context.scene.world = made
    if made.node_tree is None:
        made.use_nodes = True
    background = made.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (*color, 1.0)
    background.inputs["Strength"].default_value = strength
    return made.node_tree


def image_world(pixels: Any) -> None:
    """A world with the image (h, w, 3) of linear colours."""
    tree = world()
    sky = image("Sky", pixels.astype(np.float32), "Linear Rec.709", is_float=True)
    tree.links.new(node(tree, "ShaderNodeTexEnvironment", image=sky).outputs[0], tree.nodes["Background"].inputs[0])


# ------------------------------------------------------------------------------------------------ nodes
def node(tree: Any, kind: str, inputs: Inputs | None = None, **settings: Any) -> Any:
    """A node; inputs are values or other nodes' sockets (of a node: its first output), settings its properties."""
    made = tree.nodes.new(kind)
    for key, value in settings.items():
        setattr(made, key, value)
    for name, value in (inputs or {}).items():
        socket = made.inputs[name]
        if isinstance(value, bpy.types.Node):
            value = value.outputs[0]
        if isinstance(value, bpy.types.NodeSocket):
            tree.links.new(value, socket)
        elif socket.type == "RGBA" and len(value) == 3:
            socket.default_value = (*value, 1.0)
        else:
            socket.default_value = value
    return made


def material(name: str, shader: Shader) -> Any:
    """A material whose surface is what `shader` returns for its node tree."""
    made = bpy.data.materials.new(name)
    if made.node_tree is None:
        made.use_nodes = True
    tree = made.node_tree
    tree.nodes.clear()
    node(tree, "ShaderNodeOutputMaterial", {"Surface": shader(tree)})
    return made


def simple(name: str, kind: str, inputs: Inputs | None = None, **settings: Any) -> Any:
    """A material of a single node."""
    return material(name, lambda tree: node(tree, kind, inputs, **settings))


def principled(name: str, color: Any = (0.8, 0.8, 0.8), **inputs: Any) -> Any:
    """A Principled material; inputs by their names with _ for blanks (Specular_IOR_Level, IOR)."""
    values = {key.replace("_", " "): value for key, value in inputs.items()}
    return simple(name, "ShaderNodeBsdfPrincipled", {"Base Color": color, **values})


def diffuse(name: str, color: Any = (0.8, 0.8, 0.8)) -> Any:
    """A Diffuse material."""
    return simple(name, "ShaderNodeBsdfDiffuse", {"Color": color})


def emitter(name: str, color: Any = (1, 1, 1), strength: float = 1.0) -> Any:
    """An Emission material."""
    return simple(name, "ShaderNodeEmission", {"Color": color, "Strength": strength})


# ------------------------------------------------------------------------------------------------ images
def image(name: str, pixels: NDArray[Any], colorspace: str = "sRGB", is_float: bool = False) -> Any:
    """A packed image of (height, width, 3 or 4) stored values, row 0 on top."""
    height, width, channels = pixels.shape
    made = bpy.data.images.new(name, width, height, alpha=channels == 4, float_buffer=is_float)
    made.colorspace_settings.name = colorspace
    full = np.ones((height, width, 4), np.float32)
    full[..., :channels] = pixels[::-1]
    made.pixels.foreach_set(full.ravel())
    made.update()
    made.pack()
    return made


# ------------------------------------------------------------------------------------------------ meshes
def mesh(name: str, points: Any, faces: Any, *materials: Any) -> Any:
    """A mesh of these points and faces."""
    made = bpy.data.meshes.new(name)
    made.from_pydata(points, [], faces)
    for one in materials:
        made.materials.append(one)
    return made


def _made(name: str, smooth: bool, materials: Any, create: Callable[[Any], Any]) -> Any:
    made = bpy.data.meshes.new(name)
    body = bmesh.new()
    body.loops.layers.uv.new("UVMap")
    create(body)
    for face in body.faces:
        face.smooth = smooth
    body.to_mesh(made)
    body.free()
    for one in materials:
        made.materials.append(one)
    return made


def sphere(name: str, *materials: Any, radius: float = 1.0, segments: int = 96, smooth: bool = True) -> Any:
    """A UV sphere with a UV map."""
    return _made(name, smooth, materials, lambda body: bmesh.ops.create_uvsphere(
        body, u_segments=segments, v_segments=segments // 2, radius=radius, calc_uvs=True))  # fmt: skip


def cube(name: str, *materials: Any, size: float = 2.0) -> Any:
    """A cube with a UV map."""
    return _made(name, False, materials, lambda body: bmesh.ops.create_cube(body, size=size, calc_uvs=True))


def cylinder(name: str, *materials: Any, radius: float = 1.0, top: float | None = None, depth: float = 2.0,
             segments: int = 32, smooth: bool = False) -> Any:  # fmt: skip
    """A closed cylinder, or a cone if the top's radius is given."""
    return _made(name, smooth, materials, lambda body: bmesh.ops.create_cone(
        body, cap_ends=True, segments=segments, radius1=radius, radius2=radius if top is None else top, depth=depth,
        calc_uvs=True))  # fmt: skip


def monkey(name: str, *materials: Any, smooth: bool = True) -> Any:
    """Blender's Suzanne."""
    return _made(name, smooth, materials, lambda body: bmesh.ops.create_monkey(body, calc_uvs=True))


def plane(name: str, *materials: Any, size: float = 20.0) -> Any:
    """A square in the XY plane whose UV map covers it once."""
    return grid(name, *materials, size=size, cells=1)


def grid(name: str, *materials: Any, size: float = 2.0, cells: int = 8) -> Any:
    """A square of cells x cells quads in the XY plane."""
    return _made(name, False, materials, lambda body: bmesh.ops.create_grid(
        body, x_segments=cells, y_segments=cells, size=0.5 * size, calc_uvs=True))  # fmt: skip


# ------------------------------------------------------------------------------------------------ arrangements
def row(materials: Sequence[Any], y: float = 0.0, z: float = 0.6, radius: float = 0.55, gap: float = 1.3,
        **settings: Any) -> list[Any]:  # fmt: skip
    """Spheres side by side, one per material."""
    start = -0.5 * gap * (len(materials) - 1)
    return [add(one.name, sphere(one.name, one, radius=radius, **settings), (start + gap * k, y, z))
            for k, one in enumerate(materials)]  # fmt: skip


def studio(floor: Any = None, width: float = 6.0) -> None:
    """A floor, a large soft lamp, a small one, a dim world and a camera that sees two rows of spheres."""
    add("Floor", plane("Floor", floor or diffuse("Floor", (0.35, 0.35, 0.38)), size=30.0))
    lamp("AREA", "Key", 300.0, (-3.0, -3.0, 5.0), (0, 0, 0.5), size=2.5)
    lamp("AREA", "Rim", 80.0, (4.0, 2.0, 3.0), (0, 0, 0.5), size=1.0, color=(1.0, 0.8, 0.6))
    world((0.35, 0.45, 0.6), 0.5)
    distance = 1.25 * width
    camera((0.0, -distance * math.cos(0.6), 0.5 + distance * math.sin(0.6)), (0, 0.2, 0.5), 40.0)
