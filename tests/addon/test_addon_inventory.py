"""The inventory of Blender's settings: it is complete for this Blender, and named settings are reported."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

from edgegrad_addon.export.inventory import nodes as inventory
from edgegrad_addon.export.inventory.naming import name_settings, tables
from edgegrad_addon.export.inventory.structs import STRUCTS
from edgegrad_addon.export.inventory.table import Named, Table
from edgegrad_addon.export.materials.shader_nodes import SHADERS
from edgegrad_addon.export.nodes.expressions import READERS
from edgegrad_addon.problem import Report
from tests.support.scenes import blender_scenes as bs

STRUCT_ROOTS = ("Material", "PointLight", "SpotLight", "SunLight", "AreaLight", "Camera", "Object", "World",
                "ViewLayer", "RenderSettings")  # fmt: skip
WHERE = "add it to addon/export/inventory: read, without effect, or named"


def rna_types() -> dict[str, Any]:
    """Types of structures with a table, by name; those of Cycles are groups of properties."""
    found = {name: getattr(bpy.types, name) for name in STRUCTS if hasattr(bpy.types, name)}
    groups = {one.__name__: one for one in bpy.types.PropertyGroup.__subclasses__()}
    return {name: one.bl_rna for name, one in ({k: groups[k] for k in STRUCTS if k in groups} | found).items()}


def shader_nodes() -> Iterator[Any]:
    """One node of each type of shader node that Blender has."""
    material, world, light = bpy.data.materials.new("M"), bpy.data.worlds.new("W"), bpy.data.lights.new("L", "POINT")
    for owner in (material, world, light):
        if owner.node_tree is None:
            owner.use_nodes = True
    for name in dir(bpy.types):
        one = getattr(bpy.types, name)
        if not (isinstance(one, type) and issubclass(one, bpy.types.ShaderNode)) or one is bpy.types.ShaderNode:
            continue
        for owner in (material, world, light):
            try:
                yield owner.node_tree.nodes.new(one.bl_rna.identifier)
                break
            except RuntimeError:  # base classes, and nodes of another kind of tree
                continue


def test_every_setting_is_in_the_inventory() -> None:
    types = rna_types()
    assert set(STRUCT_ROOTS) <= set(types) and "CyclesRenderSettings" in types
    unknown = [f"{name}.{prop.identifier}" for name, rna in types.items() for prop in rna.properties
               if prop.identifier != "rna_type" and not any(t.knows(prop.identifier) for t in tables(rna))]  # fmt: skip
    assert unknown == [], WHERE


def test_settings_of_cycles_are_reached_from_what_they_belong_to() -> None:
    """A table that no walk reaches names nothing."""
    nested = {word for table in STRUCTS.values() for word in table.nested.split()}
    for name, rna in rna_types().items():
        if name in STRUCT_ROOTS:
            inner = {p.identifier for p in rna.properties if p.type == "POINTER" and p.fixed_type.identifier in STRUCTS
                     and p.fixed_type.identifier.startswith("Cycles")}  # fmt: skip
            assert inner <= nested, name


def test_every_shader_node_is_in_the_inventory() -> None:
    read = {*READERS, *SHADERS}
    others = inventory.FOLLOWED.union(inventory.EVALUATED_BY_CYCLES, *inventory.WITHOUT.values())
    unknown = []
    common = {p.identifier for p in bpy.types.ShaderNode.bl_rna.properties}
    for node in shader_nodes():
        table = inventory.NODES.get(node.type)
        if node.type in read and table is not None:
            names = {p.identifier for p in node.bl_rna.properties} - common
            names |= {socket.identifier.replace(" ", "_") for socket in node.inputs}
            unknown += [f"{node.type}.{name}" for name in sorted(names)
                        if not table.knows(name) and not inventory.COMMON.knows(name)]  # fmt: skip
        elif node.type in read or node.type not in others:
            unknown.append(node.type)
    assert unknown == [], WHERE


@pytest.fixture(name="scene")
def _scene() -> Any:
    scene = bs.empty()
    bs.camera()
    bs.light("POINT")
    return scene


@pytest.mark.parametrize("name", sorted(STRUCTS))
def test_defaults_are_not_warned_about(name: str, scene: Any) -> None:
    """What Blender makes has the values at which nothing that is named acts."""
    world = bpy.data.worlds.new("W")
    made = {"Material": bs.material("M"), "Light": bpy.data.objects["Light"].data, "Camera": scene.camera.data,
            "Object": scene.camera, "World": world, "ViewLayer": scene.view_layers[0],
            "RenderSettings": scene.render, "CyclesRenderSettings": scene.cycles}  # fmt: skip
    if name in made:
        report = Report()
        name_settings(made[name], "it", scene, report)
        assert report.lines == []


def test_settings_are_named_where_they_act(scene: Any) -> None:
    lamp = bpy.data.objects["Light"]
    lamp.data.cycles.max_bounces = 20  # more than the scene's limit: changes nothing
    scene.cycles.max_bounces = 12
    scene.cycles.film_transparent_glass = True  # acts only with a transparent film
    assert bs.export().report.lines == []
    lamp.data.cycles.max_bounces = 1
    scene.render.film_transparent = True
    scene.cycles.use_fast_gi, scene.cycles.fast_gi_method = True, "ADD"
    scene.render.use_motion_blur = True
    ball = bs.add("Ball", bs.cube("Ball", bs.material("Grey")))
    ball.is_shadow_catcher = True
    named = bs.export().report.lines
    for words in (("scene 'Scene'", "glass"), ("scene 'Scene'", "fast global"),
                  ("scene 'Scene'", "motion blur"), ("object 'Ball'", "shadow catcher")):  # fmt: skip
        assert any(all(word in line for word in words) for line in named), words
    assert len(named) == 4


def test_settings_of_nodes_are_named(scene: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not all versions of Blender have nodes with such settings, so the table gets one."""
    named = {"from_instancer": Named("it is not the instancer's", False)}
    monkeypatch.setitem(inventory.NODES, "UVMAP", Table("uv_map", named=named))
    made = bs.material("Grey")
    tree = made.node_tree
    uv = tree.nodes.new("ShaderNodeUVMap")
    uv.from_instancer = True
    tree.links.new(uv.outputs[0], bs.shader(made).inputs["Color"])
    bs.add("Ball", bs.cube("Ball", made))
    assert any("'UV Map'" in line and "instancer" in line for line in bs.export().report.lines)
