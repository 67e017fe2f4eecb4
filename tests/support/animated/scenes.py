"""A scene in Blender with one property of each kind that moves its picture, for tests of fits of properties."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from tests.support.scenes import blender_scenes as bs

CUBE, KEYS, CLAY = 'objects["Cube"]', 'shape_keys["Key"]', 'materials["Clay"].node_tree'


def stage(size: int = 32) -> Any:
    """A cube above a floor in a grey world, under a round area light; returns the cube."""
    bs.empty(size)
    bs.camera((0.4, -5.5, 3.2), (1.08, 0.05, 0.05))
    bs.light("AREA", "Lamp", (1.5, -1.5, 4.0), (0.25, 0.3, 0.0), energy=150.0, shape="DISK", size=1.5)
    bs.world((0.3, 0.35, 0.4), 0.6)
    bs.add("Floor", bs.plane("Floor", 30.0, bs.material("Grey", (0.4, 0.4, 0.4))), (0, 0, -1.1))
    return bs.add("Cube", bs.cube("Cube", bs.material("Clay", (0.6, 0.35, 0.2))), (0.1, 0.2, 0.2), (0.3, 0.2, 0.4))


def subdivided(ob: Any, levels: int = 2) -> Any:
    """Add a Subdivision modifier."""
    made = ob.modifiers.new("Subdivision", "SUBSURF")
    made.levels = made.render_levels = levels
    return made


def shape_key(ob: Any, name: str, vertex: int, move: Any) -> Any:
    """Add a shape key that moves one vertex."""
    if ob.data.shape_keys is None:
        ob.shape_key_add(name="Basis")
    key = ob.shape_key_add(name=name)
    key.slider_min, key.slider_max, key.value = -1.0, 2.0, 0.3
    for axis in range(3):
        key.data[vertex].co[axis] += move[axis]
    ob.data.shape_keys.name = "Key"
    return key


def armature(ob: Any, bones: int = 2, length: float = 1.0, base: Any = (0, 0, -1)) -> Any:
    """Bind a mesh to a chain of bones along its Z axis, each vertex to the bones near it; returns the rig."""
    data = bpy.data.armatures.new("Rig")
    rig = bs.add("Rig", data, ob.location, ob.rotation_euler)
    bpy.context.view_layer.objects.active = rig
    bpy.context.view_layer.update()
    bpy.ops.object.mode_set(mode="EDIT")
    parent = None
    for k in range(bones):
        bone = data.edit_bones.new(f"Bone{k}")
        bone.head = (base[0], base[1], base[2] + k * length)
        bone.tail = (base[0], base[1], base[2] + (k + 1) * length)
        bone.parent, bone.use_connect = parent, parent is not None
        parent = bone
    bpy.ops.object.mode_set(mode="OBJECT")
    for k in range(bones):
        rig.pose.bones[f"Bone{k}"].rotation_mode = "XYZ"
        group = ob.vertex_groups.new(name=f"Bone{k}")
        middle = base[2] + (k + 0.5) * length
        for vertex in ob.data.vertices:
            weight = max(0.0, 1.0 - abs(vertex.co.z - middle) / (1.2 * length))
            if weight > 0.0:
                group.add([vertex.index], weight, "REPLACE")
    ob.modifiers.new("Armature", "ARMATURE").object = rig
    return rig


def bent_arm(size: int) -> tuple[list[str], Any]:
    """A long box in 48 slices, bent by a chain of eight bones; the bones' angles, and offsets that straighten it."""
    stage(size)
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    ring = ((-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2))
    points = [(x, y, -1.0 + 4.0 * k / 48) for k in range(49) for x, y in ring]
    faces = [(j + i, j + (i + 1) % 4, j + 4 + (i + 1) % 4, j + 4 + i) for j in range(0, 192, 4) for i in range(4)]
    ob = bs.add("Arm", bs.mesh("Arm", points, [*faces, (3, 2, 1, 0), (192, 193, 194, 195)], bpy.data.materials["Clay"]),
                (-1.6, 0.3, 0.2), (0.0, 1.3, 0.3))  # fmt: skip
    rig = armature(ob, 8, 0.5)
    bs.camera((0.0, 0.0, 7.0), (0.0, 0.0, 0.0), "Front")
    bends = np.array([0.1, 0.3, -0.2, 0.2, 0.3, -0.1, 0.2, -0.3])
    for k, bend in enumerate(bends):
        rig.pose.bones[f"Bone{k}"].rotation_euler = (0.0, 0.0, float(bend))
    return [f'objects["Rig"].pose.bones["Bone{k}"].rotation_euler[2]' for k in range(8)], -0.6 * bends


def mixed_material(name: str, factor: float) -> Any:
    """A material whose base colour comes through a Math and a Mix node inside a node group."""
    made = bs.material(name, (0.5, 0.5, 0.5))
    group = bpy.data.node_groups.new("Tint", "ShaderNodeTree")
    group.interface.new_socket("Factor", in_out="INPUT", socket_type="NodeSocketFloat")
    group.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    entry, leave = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    halve, mix = group.nodes.new("ShaderNodeMath"), group.nodes.new("ShaderNodeMix")
    halve.operation, halve.inputs[1].default_value = "POWER", 1.5
    mix.data_type = "RGBA"
    mix.inputs[6].default_value, mix.inputs[7].default_value = (0.9, 0.2, 0.1, 1.0), (0.1, 0.3, 0.8, 1.0)
    group.links.new(entry.outputs[0], halve.inputs[0])
    group.links.new(halve.outputs[0], mix.inputs[0])
    group.links.new(mix.outputs[2], leave.inputs[0])
    tree = made.node_tree
    node = tree.nodes.new("ShaderNodeGroup")
    node.name, node.node_tree = "Tint", group
    node.inputs[0].default_value = factor
    tree.links.new(node.outputs[0], bs.shader(made).inputs["Color"])
    return made


def geometry_nodes(ob: Any, value: float = 0.3) -> Any:
    """A modifier that moves a mesh along Z by its input "Lift", times the height over the origin."""
    group = bpy.data.node_groups.new("Lift", "GeometryNodeTree")
    group.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    group.interface.new_socket("Lift", in_out="INPUT", socket_type="NodeSocketFloat")
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    entry, leave = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    move, place, scale = (group.nodes.new(kind) for kind in ("GeometryNodeSetPosition", "GeometryNodeInputPosition",
                                                             "ShaderNodeVectorMath"))  # fmt: skip
    scale.operation = "SCALE"
    group.links.new(entry.outputs[0], move.inputs["Geometry"])
    group.links.new(place.outputs[0], scale.inputs[0])
    group.links.new(entry.outputs[1], scale.inputs["Scale"])
    group.links.new(scale.outputs[0], move.inputs["Offset"])
    group.links.new(move.outputs[0], leave.inputs[0])
    made = ob.modifiers.new("Nodes", "NODES")
    made.node_group = group
    if bpy.app.version >= (5, 2, 0):
        getattr(made.properties.inputs, group.interface.items_tree[2].identifier).value = value
    else:
        made[next(item.identifier for item in group.interface.items_tree if item.name == "Lift")] = value
    return made


def lattice(ob: Any) -> Any:
    """A 2 x 2 x 2 lattice around a mesh, which deforms it."""
    made = bs.add("Lattice", bpy.data.lattices.new("Lattice"), ob.location, ob.rotation_euler, (2.4, 2.4, 2.4))
    modifier = ob.modifiers.new("Lattice", "LATTICE")
    modifier.object = made
    return made


def driven_by(owner: Any, name: str, value: float, target: Any, path: str,
              index: int = -1) -> None:  # fmt: skip
    """Drive a property by a custom property of a datablock."""
    owner[name] = value
    driver = target.driver_add(path, index).driver
    variable = driver.variables.new()
    variable.name = "x"
    variable.targets[0].id = owner
    variable.targets[0].data_path = f'["{name}"]'
    driver.expression = "x"
