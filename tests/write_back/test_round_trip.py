"""An export, a fit that changes nothing, and its write-back leave a .blend with every kind of datablock as it was."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
from edgegrad import images
from edgegrad_addon.animated.parameter import Wanted
from edgegrad_addon.parameters import Names
from edgegrad_addon.session import Picture, Request, Session
from tests.support.scenes import blender_scenes as bs
from tests.write_back.data_dump import INTERFACE, difference, dump

# Kinds that come from files and windows.
NOT_MADE = {"libraries", *INTERFACE, "fonts", "cache_files", "movieclips", "sounds",
            "paint_curves", "colors", "annotations", "grease_pencils_v3", "shape_keys"}  # fmt: skip
# Kinds that are made by their name alone, in the versions that have them.
BY_NAME = ("brushes", "palettes", "linestyles", "masks", "volumes", "hair_curves", "pointclouds", "grease_pencils",
           "lightprobes", "speakers", "particles")  # fmt: skip


def every_kind() -> None:
    """A scene with data of every kind that a script can make, many of them animated and linked to each other."""
    scene = bs.empty(16)
    bs.camera(name="Front")
    bs.light("POINT", "Bulb")
    bs.light("AREA", "Panel")
    bs.world((0.3, 0.3, 0.3))
    clay = bs.material("Clay")
    glow = bs.material("Glow", (1.0, 0.5, 0.2), "ShaderNodeEmission")
    cube = bs.add("Cube", bs.cube("Cube", clay), rotation=(0.2, 0.3, 0.4))
    cube["mine"] = 1.5
    cube.vertex_groups.new(name="Group").add([0, 1], 0.5, "REPLACE")
    cube.shape_key_add(name="Basis")
    smile = cube.shape_key_add(name="Smile")
    smile.points[2].co.x += 0.4
    smile.value = 0.5
    cube.data.uv_layers.new(name="Map")
    cube.data.color_attributes.new("Paint", "BYTE_COLOR", "CORNER")
    small = bs.add("Small", bs.cube("Small", glow), (1.5, 0, 0), scale=(0.2, 0.3, 0.4))
    small.modifiers.new("Round", "SUBSURF").levels = 1
    small.constraints.new("LIMIT_LOCATION")
    picture = bpy.data.images.new("Picture", 4, 4)
    picture.pack()
    tree = clay.node_tree
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = picture
    group = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    group.nodes.new("ShaderNodeValue")
    tree.nodes.new("ShaderNodeGroup").node_tree = group
    bpy.data.textures.new("Clouds", "CLOUDS")
    displaced = bs.add("Displaced", bs.cube("Displaced", clay), (-1.5, 0, 0), scale=(0.3, 0.3, 0.3))
    displaced.modifiers.new("Displace", "DISPLACE").texture = bpy.data.textures["Clouds"]
    curve = bpy.data.curves.new("Curve", "CURVE")
    curve.splines.new("BEZIER").bezier_points.add(2)
    bs.add("Curve", curve)
    text = bpy.data.curves.new("Word", "FONT")
    text.body = "word"
    bs.add("Word", text, (0, 1.5, 0), scale=(0.3, 0.3, 0.3))
    surface = bpy.data.curves.new("Surface", "SURFACE")
    bs.add("Surface", surface)
    ball = bpy.data.metaballs.new("Ball")
    ball.elements.new().radius = 0.5
    bs.add("Ball", ball, (0, -1.5, 0))
    lattice = bpy.data.lattices.new("Lattice")
    lattice.points[0].co_deform.x += 0.1
    small.modifiers.new("Lattice", "LATTICE").object = bs.add("Lattice", lattice)
    bs.add("Rig", bpy.data.armatures.new("Rig"))
    instancer = bs.add("Instancer", None, (0, 0, -2))
    collection = bpy.data.collections.new("Held")
    collection.objects.link(bs_object := bpy.data.objects.new("Inside", bs.cube("Inside", clay)))
    bs_object.scale = (0.2, 0.2, 0.2)
    instancer.instance_type, instancer.instance_collection = "COLLECTION", collection
    instancer.keyframe_insert("location")  # makes an action
    cube.driver_add("delta_location", 0).driver.expression = "0.0"
    bpy.data.texts.new("Note").write("a note")
    scene.timeline_markers.new("Here", frame=3)
    bpy.data.scenes.new("Other").world = bpy.data.worlds.new("Other")
    for kind in BY_NAME:
        if hasattr(getattr(bpy.data, kind, None), "new"):
            arguments = {"type": "SPHERE"} if kind == "lightprobes" else {}
            getattr(bpy.data, kind).new(name="Made", **arguments).use_fake_user = True
    scene.frame_current = 2
    bpy.context.view_layer.update()


@pytest.mark.parametrize("in_place", [False, True])
def test_nothing_differs(in_place: bool, tmp_path: Path) -> None:
    every_kind()
    made = {prop.identifier for prop in bpy.types.BlendData.bl_rna.properties
            if prop.type == "COLLECTION" and len(getattr(bpy.data, prop.identifier))}  # fmt: skip
    every = {prop.identifier for prop in bpy.types.BlendData.bl_rna.properties if prop.type == "COLLECTION"}
    assert not every - NOT_MADE - made
    images.write_image(tmp_path / "target.exr", np.full((16, 16, 3), 0.5, np.float32))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "start.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "start.blend"))
    before = dump()
    assert len(before) > 5000
    names = Names(("Cube",), ("Clay",), ("Glow",), ("Bulb", "Panel"))
    animated = (Wanted('objects["Small"].location'), Wanted('worlds["World"].node_tree.nodes["Background"].inputs[1]'
                                                            '.default_value'))  # fmt: skip
    picture = Picture("Front", str(tmp_path / "target.exr"))
    session = Session.prepare(bpy.context, Request([picture], names, 2, 2, in_place=in_place, animated=animated))
    assert not difference(before, dump()), "by the export"
    result = session.run(callback=lambda step: "restore" if step.iteration == 2 else None)
    assert not difference(before, dump()), "by the fit"
    assert len(result.values) == 7 and not session.write(result) and not session.unwritten
    assert not difference(before, dump()), "by the write-back"


def test_a_change_is_seen(tmp_path: Path) -> None:
    """The comparison would show what a fit changes."""
    every_kind()
    images.write_image(tmp_path / "target.exr", np.full((16, 16, 3), 0.5, np.float32))
    before = dump()
    session = Session.prepare(bpy.context, Request([Picture("Front", str(tmp_path / "target.exr"))], Names(
        ("Cube",), ("Clay",), ("Glow",), ("Bulb",)), 1, 1))  # fmt: skip
    values: dict[str, Any] = {path: value + 0.1 for path, value in session.before.items()}
    assert session.write(edgegrad.FitResult(values, [1.0], 0, 0.0, False, {}, ()))
    changed = " ".join(difference(before, dump()))
    for word in ("materials['Clay']", "materials['Glow']", "lights['Bulb']", "shape_keys['Key"):
        assert word in changed
