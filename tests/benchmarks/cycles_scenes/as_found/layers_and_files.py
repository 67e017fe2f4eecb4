"""Blender's own files, and how scenes are organised: view layers, holdouts, light groups, engines of old files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy

from .. import stage
from ..case import case


def _template(name: str) -> None:
    """Open a start-up file that comes with Blender, as the current scene."""
    folder = Path(bpy.utils.system_resource("SCRIPTS")) / "startup" / "bl_app_templates_system" / name
    bpy.ops.wm.open_mainfile(filepath=str(folder / "startup.blend"))
    _small()


def _small() -> None:
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 160, 120, 100


@case("The file that Blender starts with: cube, lamp and camera")
def startup_general() -> None:
    """Rendered without any change."""
    bpy.ops.wm.read_factory_settings(use_empty=False)
    _small()


@case("The start-up file of sculpting: a smooth ball, with a camera and a lamp")
def startup_sculpting() -> None:
    """It has no camera of its own."""
    _template("Sculpting")
    stage.camera((4.0, -6.0, 3.0), (0, 0, 0))
    stage.lamp("POINT", "Lamp", 500.0, (3.0, -3.0, 4.0))


@case("Startup materials on a floor: the grey default, faces of several slots, a plane that glows")
def first_steps() -> None:
    """What a first tutorial ends with: unsmoothed monkey, plane, area lamp, default world."""
    bpy.ops.wm.read_factory_settings(use_empty=False)
    _small()
    scene = bpy.context.scene
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    bpy.ops.mesh.primitive_monkey_add(size=2.0, location=(0, 0, 1))
    bpy.ops.object.shade_smooth()
    bpy.context.object.modifiers.new("Subdivision", "SUBSURF").levels = 1
    bpy.ops.mesh.primitive_plane_add(size=20.0)
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=(2.0, 0.5, 0.5))
    cube = bpy.context.object
    made = stage.principled("Glow", (0.8, 0.8, 0.8))
    made.node_tree.nodes["Principled BSDF"].inputs["Emission Strength"].default_value = 2.0
    cube.data.materials.append(made)
    scene.view_settings.view_transform = "AgX"


@case("Excluded, disabled and indirect collections in two view layers; objects of several collections", bounces=3)
def organised() -> None:
    """A file with a clean outliner."""
    stage.studio(width=6.0)
    scene = bpy.context.scene
    names = ("Shown", "Excluded", "Disabled", "Indirect")
    for k, name in enumerate(names):
        collection = bpy.data.collections.new(name)
        scene.collection.children.link(collection)
        ob = bpy.data.objects.new(name, stage.sphere(name, stage.principled(name, (0.2 + 0.2 * k, 0.5, 0.8 - 0.2 * k)),
                                                     radius=0.5))  # fmt: skip
        ob.location = (1.4 * k - 2.1, 0.0, 0.5)
        collection.objects.link(ob)
        lamp = bpy.data.objects.new(f"Lamp {name}", bpy.data.lights.new(f"Lamp {name}", "POINT"))
        lamp.data.energy = 20.0
        lamp.location = (1.4 * k - 2.1, -1.2, 0.6)
        collection.objects.link(lamp)
    layer = scene.view_layers[0].layer_collection.children
    layer["Excluded"].exclude = True
    bpy.data.collections["Disabled"].hide_render = True
    layer["Indirect"].indirect_only = True
    bpy.data.collections["Shown"].objects.link(bpy.data.objects["Excluded"])
    scene.view_layers.new("Second").layer_collection.children["Shown"].exclude = True


@case("Holdout objects before a transparent film")
def holdouts() -> None:
    """Objects that cut holes."""
    stage.studio(width=5.0)
    stage.row([stage.principled("Red", (0.7, 0.1, 0.1)), stage.simple("Hole", "ShaderNodeHoldout"),
               stage.principled("Blue", (0.1, 0.1, 0.7))])  # fmt: skip
    bpy.data.objects["Blue"].is_holdout = True
    bpy.context.scene.render.film_transparent = True


@case("A file of Blender 2.7: engine EEVEE or Workbench, materials without nodes, grey world", bounces=3)
def other_engine() -> None:
    """Materials that never had nodes show the viewport's colour."""
    stage.studio(width=5.0)
    made: list[Any] = []
    for k in range(3):
        one = bpy.data.materials.new(f"Plain {k}")
        one.diffuse_color = (0.8 - 0.3 * k, 0.2 + 0.2 * k, 0.1 + 0.3 * k, 1.0)
        one.roughness, one.metallic = 0.1 + 0.3 * k, 0.5 * k
        one.use_nodes = False
        made.append(one)
    stage.row(made)
    for area in ("Key", "Rim"):
        bpy.data.lights[area].use_shadow = area == "Key"
