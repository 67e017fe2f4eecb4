"""Small scenes in Blender for the add-on's tests, and Cycles as the judge. Importing needs bpy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from edgegrad import images
from edgegrad_addon.export import Export, export_scene

SIZE = 32
_own_preferences = False  # this process has loaded Blender's own preferences


def new_file() -> None:
    """Load Blender's own empty file, with Blender's own preferences.

    Loading the preferences registers all of Blender's add-ons again, which takes six times as long as the file. They
    are loaded where they may differ: by the first call in a process, and after a test has changed one of them.
    """
    global _own_preferences
    preferences = bpy.context.preferences
    if _own_preferences and not preferences.is_dirty:
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        return
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.preferences.is_dirty = False  # which Blender does not say of its own ones
    _own_preferences = True


def empty(size: int = SIZE) -> Any:
    """A scene with nothing in it; returns Blender's scene, set up so that Cycles evaluates Edgegrad's integral."""
    new_file()
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    cycles = scene.cycles
    cycles.device, cycles.samples = "CPU", 64
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.pixel_filter_type = "BOX"
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = 0
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGB", "32"
    return scene


def add(name: str, data: Any, location: Any = (0, 0, 0), rotation: Any = (0, 0, 0), scale: Any = (1, 1, 1)) -> Any:
    """A new object in the scene."""
    ob = bpy.data.objects.new(name, data)
    ob.location, ob.rotation_euler, ob.scale = location, rotation, scale
    bpy.context.scene.collection.objects.link(ob)
    return ob


def offset_shading(ob: Any, offset: float) -> None:
    """Set an object's shadow terminator shading offset: a setting of Cycles until Blender 4.5."""
    if hasattr(ob, "shadow_terminator_shading_offset"):
        ob.shadow_terminator_shading_offset = offset
    else:
        ob.cycles.shadow_terminator_offset = offset


def offset_shadow_rays(ob: Any, offset: float) -> None:
    """Set an object's shadow terminator geometry offset: a setting of Cycles until Blender 4.5."""
    (ob if hasattr(ob, "shadow_terminator_geometry_offset") else ob.cycles).shadow_terminator_geometry_offset = offset


def camera(location: Any = (0, 0, 5), rotation: Any = (0, 0, 0), name: str = "Camera") -> Any:
    """A camera, made the active one; without rotation it looks down."""
    ob = add(name, bpy.data.cameras.new(name), location, rotation)
    bpy.context.scene.camera = ob
    return ob


def light(kind: str, name: str = "Light", location: Any = (0, 0, 8), rotation: Any = (0, 0, 0), scale: Any = (1, 1, 1),
          **settings: Any) -> Any:  # fmt: skip
    """A light object without radius or angle unless the settings say otherwise."""
    data = bpy.data.lights.new(name, kind)
    if kind == "SUN":
        data.angle = 0.0
    elif kind == "POINT":
        data.shadow_soft_size = 0.0
    for key, value in settings.items():
        setattr(data, key, value)
    return add(name, data, location, rotation, scale)


def material(name: str, color: Any = (0.5, 0.5, 0.5), node: str = "ShaderNodeBsdfDiffuse", **inputs: Any) -> Any:
    """A material with one shader node."""
    made = bpy.data.materials.new(name)
    if made.node_tree is None:
        made.use_nodes = True
    tree = made.node_tree
    tree.nodes.clear()
    shader = tree.nodes.new(node)
    shader.inputs["Base Color" if "Base Color" in shader.inputs else "Color"].default_value = (*color, 1.0)
    for key, value in inputs.items():
        shader.inputs[key].default_value = value
    tree.links.new(shader.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return made


def shader(made: Any) -> Any:
    """The shader node of a material made by `material`."""
    return next(node for node in made.node_tree.nodes if node.type != "OUTPUT_MATERIAL")


def normal_mapped(strength: float, node: str = "ShaderNodeBsdfDiffuse", **inputs: Any) -> Any:
    """A material of one shader, bent by a small picture of noise."""
    made = material("Bent", (0.8, 0.8, 0.8), node, **inputs)
    tree = made.node_tree
    pixels = np.random.default_rng(0).uniform(0.3, 0.7, (8, 8, 4)).astype(np.float32)
    pixels[..., 2:] = 0.95, 1.0
    picture = bpy.data.images.new("Noise", 8, 8, float_buffer=True, is_data=True)
    picture.pixels.foreach_set(pixels.ravel())
    picture.update()
    texture, bend = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeNormalMap")
    texture.image = picture
    bend.inputs["Strength"].default_value = strength
    tree.links.new(texture.outputs["Color"], bend.inputs["Color"])
    tree.links.new(bend.outputs["Normal"], shader(made).inputs["Normal"])
    return made


def mesh(name: str, points: Any, faces: Any, *materials: Any) -> Any:
    """Blender's mesh of these points and faces."""
    made = bpy.data.meshes.new(name)
    made.from_pydata(points, [], faces)
    for one in materials:
        made.materials.append(one)
    return made


def plane(name: str = "Plane", size: float = 20.0, *materials: Any) -> Any:
    """A square mesh in the XY plane."""
    h = 0.5 * size
    return mesh(name, [(-h, -h, 0), (h, -h, 0), (h, h, 0), (-h, h, 0)], [(0, 1, 2, 3)], *materials)


def cube(name: str, *materials: Any) -> Any:
    """A cube of edge 2, quads."""
    points = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return mesh(name, points, faces, *materials)


def world(color: Any, strength: float = 1.0) -> None:
    """A constant environment."""
    made = bpy.data.worlds.new("World")
    bpy.context.scene.world = made
    if made.node_tree is None:
        made.use_nodes = True
    background = made.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (*color, 1.0)
    background.inputs["Strength"].default_value = strength


def export(bake: int = 64) -> Export:
    """The current scene, exported."""
    return export_scene(bpy.context.scene, bake=bake)


def cycles(folder: Path) -> NDArray[np.float32]:
    """The current scene's picture by Cycles, linear."""
    path = folder / "cycles.exr"
    bpy.context.scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    return images.read_image(path)
