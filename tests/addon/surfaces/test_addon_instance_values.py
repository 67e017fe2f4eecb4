"""Instances share a mesh where materials read values of objects, properties or attributes that differ among them."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

from edgegrad_addon.export.geometry import attributes, hashes
from tests.support.scenes import blender_scenes as bs
from tests.support.scenes.material_tree import Tree

pytestmark = pytest.mark.usefixtures("lit_scene")


def test_instances_share_a_mesh_and_have_values_of_their_own() -> None:
    tree = Tree()
    info = tree.node("ObjectInfo")
    tree.link(info.outputs["Random"], "Roughness")
    tree.link(info.outputs["Color"], "Base Color")
    tree.link(tree.node("Attribute", attribute_type="OBJECT", attribute_name="wear").outputs["Fac"], "Metallic")
    bs.add("Twin", tree.object.data, (3, 0, 0))
    tree.object["wear"], bpy.data.objects["Twin"]["wear"] = 0.25, 0.75
    bpy.data.objects["Twin"].color = (0.1, 0.2, 0.3, 1.0)
    tree.export()
    mesh = tree.made.scene.meshes["Cube"]
    assert list(tree.made.scene.meshes) == ["Cube"] and len(mesh.instances) == 2 and not mesh.attributes
    own = mesh.instance_attributes
    name_of = ["Cube", "Twin"] if mesh.instances[1, 0, 3] == 3.0 else ["Twin", "Cube"]
    twin = name_of.index("Twin")
    random = [hashes.name_hash(name) / hashes.WORD for name in name_of]
    np.testing.assert_allclose(own[attributes.RANDOM][:, 0], random)
    np.testing.assert_allclose(own[attributes.COLOR][twin], [0.1, 0.2, 0.3, 1.0])
    np.testing.assert_allclose(own[attributes.PROPERTY + "wear"][[twin, 1 - twin], 0], [0.75, 0.25])
    # An object without the property has no such value, and cannot have a row.
    del bpy.data.objects["Twin"]["wear"]
    bpy.data.objects["Twin"].update_tag()
    tree.export()
    assert len(tree.made.scene.meshes) == 2


# Ids of scattered points are large; where two scatters are joined, they may be repeated.
@pytest.mark.parametrize("ids", [None, (2**30 + 2, 2**30, 2**30 + 1), (2**30 + 1, 2**30 + 1, 2**30)])
def test_instances_of_geometry_nodes_have_attributes_of_their_instancer(ids: tuple[int, ...] | None) -> None:
    tree = Tree()
    for name, to in (("heat", "Roughness"), ("wear", "Metallic"), ("own", "Alpha")):
        node = tree.node("Attribute", attribute_type="INSTANCER", attribute_name=name)
        tree.link(node.outputs["Fac"], to)
    points = bpy.data.meshes.new("Points")
    points.from_pydata([(3, 0, 0), (6, 0, 0), (9, 0, 0)], [], [])
    points.attributes.new("heat", "FLOAT", "POINT").data.foreach_set("value", [0.1, 0.5, 0.9])
    if ids is not None:
        points.attributes.new("id", "INT", "POINT").data.foreach_set("value", ids)
    holder = bs.add("Points", points)
    holder["wear"], tree.object["wear"], tree.object["own"] = 0.25, 0.75, 0.5
    group = bpy.data.node_groups.new("Group", "GeometryNodeTree")
    for kind in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=kind, socket_type="NodeSocketGeometry")
    nodes = {kind: group.nodes.new(kind) for kind in ("NodeGroupInput", "NodeGroupOutput",
                                                      "GeometryNodeInstanceOnPoints", "GeometryNodeObjectInfo")}
    nodes["GeometryNodeObjectInfo"].inputs["Object"].default_value = tree.object
    copies = nodes["GeometryNodeInstanceOnPoints"]
    group.links.new(nodes["NodeGroupInput"].outputs[0], copies.inputs["Points"])
    group.links.new(nodes["GeometryNodeObjectInfo"].outputs["Geometry"], copies.inputs["Instance"])
    group.links.new(copies.outputs[0], nodes["NodeGroupOutput"].inputs[0])
    holder.modifiers.new("Copies", "NODES").node_group = group
    tree.export()
    mesh = next(mesh for mesh in tree.made.scene.meshes.values() if mesh.instances is not None)
    order = np.argsort(mesh.instances[:, 0, 3])
    assert len(mesh.instances) == 3
    own = {name: mesh.instance_attributes[attributes.INSTANCER + name][order, 0] for name in ("heat", "wear")}
    np.testing.assert_allclose(own["heat"], [0.1, 0.5, 0.9])
    np.testing.assert_allclose(own["wear"], 0.25)
    # The object itself is no instance: it has properties of its own.
    alone = next(mesh for mesh in tree.made.scene.meshes.values() if mesh.instances is None)
    assert np.unique(alone.attributes[attributes.INSTANCER + "wear"]).tolist() == [0.75]
    assert np.unique(alone.attributes[attributes.INSTANCER + "own"]).tolist() == [0.5]


@pytest.mark.parametrize("through", ["", "collection", "collection of nodes"])
def test_nested_instances_have_attributes_of_each_level(through: str) -> None:
    """Two copies stand above each of three points."""
    tree = Tree()
    for name, to in (("heat", "Roughness"), ("level", "Metallic")):
        node = tree.node("Attribute", attribute_type="INSTANCER", attribute_name=name)
        tree.link(node.outputs["Fac"], to)
    points = bpy.data.meshes.new("Points")
    points.from_pydata([(3, 0, 0), (6, 0, 0), (9, 0, 0)], [], [])
    points.attributes.new("heat", "FLOAT", "POINT").data.foreach_set("value", [0.1, 0.5, 0.9])
    holder = bs.add("Points", points)
    group = bpy.data.node_groups.new("Group", "GeometryNodeTree")
    for kind in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=kind, socket_type="NodeSocketGeometry")
    given, found, line, below, level, store, above, index = (group.nodes.new(kind) for kind in (
        "NodeGroupInput", "GeometryNodeObjectInfo", "GeometryNodeMeshLine", "GeometryNodeInstanceOnPoints",
        "GeometryNodeInputIndex", "GeometryNodeStoreNamedAttribute", "GeometryNodeInstanceOnPoints",
        "NodeGroupOutput"))  # fmt: skip
    found.inputs["Object"].default_value = tree.object
    line.inputs["Count"].default_value, line.inputs["Offset"].default_value = 2, (0.0, 0.0, 5.0)
    store.domain, store.inputs["Name"].default_value = "INSTANCE", "level"
    for source, target in ((line.outputs[0], below.inputs["Points"]),
                           (found.outputs["Geometry"], below.inputs["Instance"]),
                           (below.outputs[0], store.inputs["Geometry"]), (level.outputs[0], store.inputs["Value"]),
                           (given.outputs[0], above.inputs["Points"]), (store.outputs[0], above.inputs["Instance"]),
                           (above.outputs[0], index.inputs[0])):  # fmt: skip
        group.links.new(source, target)
    holder.modifiers.new("Copies", "NODES").node_group = group
    if through:
        unused, collection = bs.add("Unused", bpy.data.meshes.new("Unused")), bpy.data.collections.new("Set")
        unused.hide_render = True
        for ob in (unused, holder):
            collection.objects.link(ob)
            bpy.context.scene.collection.objects.unlink(ob)
    if through == "collection":
        carrier = bs.add("Set", None)
        carrier.instance_type, carrier.instance_collection = "COLLECTION", collection
    elif through:
        outer = group.copy()
        carrier = bs.add("Set", bpy.data.meshes.new("Set"))
        carrier.modifiers.new("Set", "NODES").node_group = outer
        whole = outer.nodes.new("GeometryNodeCollectionInfo")
        whole.inputs["Collection"].default_value = collection
        end = next(node for node in outer.nodes if node.bl_idname == "NodeGroupOutput")
        outer.links.new(whole.outputs[0], end.inputs[0])
    tree.export()
    mesh = next(mesh for mesh in tree.made.scene.meshes.values() if mesh.instances is not None)
    order = np.lexsort((mesh.instances[:, 2, 3], mesh.instances[:, 0, 3]))
    own = {name: mesh.instance_attributes[attributes.INSTANCER + name][order, 0] for name in ("heat", "level")}
    np.testing.assert_allclose(own["heat"], [0.1, 0.1, 0.5, 0.5, 0.9, 0.9])
    np.testing.assert_allclose(own["level"], [0, 1, 0, 1, 0, 1])


def test_particles_have_properties_of_their_system_before_those_of_their_instancer() -> None:
    tree = Tree()
    for name, to in (("heat", "Roughness"), ("wear", "Metallic")):
        tree.link(tree.node("Attribute", attribute_type="INSTANCER", attribute_name=name).outputs["Fac"], to)
    holder = bs.add("Holder", bs.plane("Holder", 4.0))
    settings = holder.modifiers.new("Hair", "PARTICLE_SYSTEM").particle_system.settings
    settings.type, settings.count = "HAIR", 3
    settings.use_advanced_hair, settings.render_type, settings.instance_object = True, "OBJECT", tree.object
    settings["heat"], holder["heat"], holder["wear"] = 0.25, 0.5, 0.75
    tree.export()
    mesh = next(mesh for mesh in tree.made.scene.meshes.values() if mesh.instances is not None)
    assert len(mesh.instances) == 3
    for name, value in (("heat", 0.25), ("wear", 0.75)):
        np.testing.assert_allclose(mesh.instance_attributes[attributes.INSTANCER + name], value)


def test_object_values_of_bakes_and_displacements_keep_instances_apart() -> None:
    tree = Tree()
    info = tree.node("ObjectInfo")
    tree.link(info.outputs["Random"], "Roughness")
    bs.add("Twin", tree.object.data, (3, 0, 0))
    displace = tree.node("Displacement")
    output = next(node for node in tree.tree.nodes if node.type == "OUTPUT_MATERIAL")
    tree.tree.links.new(info.outputs["Random"], displace.inputs["Height"])
    tree.tree.links.new(displace.outputs[0], output.inputs["Displacement"])
    tree.object.data.materials[0].displacement_method = "DISPLACEMENT"
    tree.export()
    meshes = tree.made.scene.meshes
    values = [meshes[name].attributes[attributes.RANDOM] for name in ("Cube", "Twin")]
    assert all(np.ptp(v) == 0.0 for v in values) and values[0][0, 0, 0] != values[1][0, 0, 0]
    tree.tree.links.remove(displace.outputs[0].links[0])
    tree.tree.links.clear()
    tree.surface(tree.shader.outputs[0])
    tree.export()
    assert list(tree.made.scene.meshes) == ["Cube"] and len(tree.made.scene.meshes["Cube"].instances) == 2


@pytest.mark.parametrize("kind, output", [("TexCoord", "Generated"), ("TexCoord", "UV"), ("UVMap", "UV")])
def test_instances_have_the_coordinates_of_their_place_on_the_instancer(kind: str, output: str) -> None:
    """Blender gives the middle of the carrier as generated coordinates of vertices, where Cycles' are -0.5."""
    tree = Tree()
    tree.link(tree.node(kind, from_instancer=True).outputs[output], "Base Color")
    carrier = bpy.data.meshes.new("Carrier")
    carrier.from_pydata([(3, 0, 0), (6, 0, 0), (6, 4, 0), (3, 4, 0)], [], [(0, 1, 2, 3)])
    carrier.uv_layers.new(name="UVMap").uv.foreach_set("vector", [0.1, 0.2, 0.7, 0.2, 0.7, 0.6, 0.1, 0.6])
    holder = bs.add("Carrier", carrier)
    holder.instance_type = "FACES" if output == "UV" else "VERTS"
    tree.object.parent = holder
    bs.add("Alone", tree.object.data, (0, 5, 0))
    tree.export()
    assert not [line for line in tree.made.report.lines if "instancer" in line]
    name, alone = (attributes.INSTANCER_UV, [0, 0]) if output == "UV" else (attributes.INSTANCER_GENERATED, [0, 0, 0])
    (mesh,) = (mesh for mesh in tree.made.scene.meshes.values() if mesh.instances is not None)
    expected = [(0.4, 0.4)] if output == "UV" else [(-0.5, -0.5, -0.5)] * 4
    found = sorted(map(tuple, mesh.instance_attributes[name].tolist()))
    np.testing.assert_allclose(found, sorted([*expected, tuple(alone)]), atol=1e-6)


def test_instances_have_the_colour_of_their_outermost_instancer() -> None:
    tree = Tree()
    tree.link(tree.node("ObjectInfo").outputs["Color"], "Base Color")
    kit, outer = bpy.data.collections.new("Kit"), bpy.data.collections.new("Outer")
    kit.objects.link(tree.object)
    inner = bpy.data.objects.new("Inner", None)
    outer.objects.link(inner)
    holder = bs.add("Holder", None, (3, 0, 0))
    for ob, instanced in ((inner, kit), (holder, outer)):
        ob.instance_type, ob.instance_collection = "COLLECTION", instanced
    tree.object.color, inner.color, holder.color = (1, 0, 0, 1), (0, 1, 0, 1), (0, 0, 1, 0.5)
    tree.export()
    (mesh,) = tree.made.scene.meshes.values()
    assert sorted(mesh.instance_attributes[attributes.COLOR].tolist()) == [[0, 0, 1, 0.5], [1, 0, 0, 1]]


@pytest.mark.parametrize("kind", ["LIGHT", "EMPTY"])
def test_nodes_may_instance_objects_without_geometry(kind: str) -> None:
    """A tree places two lamps, or what an empty instances."""
    tree = Tree()
    if kind == "LIGHT":
        placed = bs.light("POINT", "Lamp", location=(0, -20, 0))
    else:
        kit = bpy.data.collections.new("Kit")
        kit.objects.link(tree.object)
        placed = bs.add("Placed", None, (0, -20, 0))
        placed.instance_type, placed.instance_collection = "COLLECTION", kit
    points = bpy.data.meshes.new("Points")
    points.from_pydata([(3, 0, 0), (6, 0, 0)], [], [])
    group = bpy.data.node_groups.new("Group", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    start, found, copies, end = (group.nodes.new(one) for one in (
        "NodeGroupInput", "GeometryNodeObjectInfo", "GeometryNodeInstanceOnPoints", "NodeGroupOutput"))  # fmt: skip
    found.inputs["Object"].default_value, found.inputs["As Instance"].default_value = placed, True
    group.links.new(start.outputs[0], copies.inputs["Points"])
    group.links.new(found.outputs["Geometry"], copies.inputs["Instance"])
    group.links.new(copies.outputs[0], end.inputs[0])
    bs.add("Points", points).modifiers.new("Copies", "NODES").node_group = group
    tree.export()
    if kind == "LIGHT":
        places = [light.position.tolist() for light in tree.made.scene.lights.values() if light.position[0] > 2.0]
        assert sorted(places) == [[3, 0, 0], [6, 0, 0]]
    else:
        (mesh,) = tree.made.scene.meshes.values()
        assert {3.0, 6.0} <= set(mesh.instances[:, 0, 3].tolist())
