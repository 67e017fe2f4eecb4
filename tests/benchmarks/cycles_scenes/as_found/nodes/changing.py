"""What keys and drivers change, what geometry nodes make for renders, and what assets of Blender build."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy

from ... import stage
from ...case import case
from ..habits import checks, small, textured


def _nodes(ob: Any) -> tuple[Any, Any, Any]:
    """A Geometry Nodes modifier: its tree, input and output."""
    tree = bpy.data.node_groups.new(ob.name, "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    ob.modifiers.new("Nodes", "NODES").node_group = tree
    return tree, tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")


def _drive(owner: Any, path: str, expression: str, index: int = -1) -> None:
    owner.driver_add(path, index).driver.expression = expression


def _key(owner: Any, path: str, first: float, last: float) -> None:
    for frame, value in ((1, first), (20, last)):
        setattr(owner, path, value)
        owner.keyframe_insert(path, frame=frame)


@case("Keys and drivers of lamps, the world, the lens, values of materials, ramps, mappings and groups; half a frame",
      bounces=3)  # fmt: skip
def animated_values() -> None:
    """Everything blinks."""
    scene = small()
    _key(bpy.data.objects["Key"].data, "energy", 10.0, 500.0)
    _drive(bpy.data.objects["Rim"].data, "color", "frame / 20", 0)
    _key(scene.world.node_tree.nodes["Background"].inputs["Strength"], "default_value", 0.0, 1.0)
    _key(scene.camera.data, "lens", 20.0, 45.0)
    driven = stage.principled("Driven", (0.2, 0.2, 0.2))
    shader = next(node for node in driven.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    _drive(shader.inputs["Base Color"], "default_value", "frame / 15", 0)
    _drive(shader.inputs["Roughness"], "default_value", "frame / 50")
    group = bpy.data.node_groups.new("Tone", "ShaderNodeTree")
    group.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketColor")
    tone = group.nodes.new("ShaderNodeRGB")
    group.links.new(tone.outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
    tone.outputs[0].default_value = (0.1, 0.1, 0.1, 1.0)
    _drive(tone.outputs[0], "default_value", "frame / 12", 2)

    def grouped(tree: Any) -> Any:
        used = stage.node(tree, "ShaderNodeGroup", node_tree=group)
        return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": used})

    def sliding(tree: Any) -> Any:
        place = stage.node(tree, "ShaderNodeTexCoord").outputs["Generated"]
        ramp = stage.node(tree, "ShaderNodeValToRGB", {"Fac": place})
        _drive(ramp.color_ramp.elements[0], "position", "frame / 30")
        moved = stage.node(tree, "ShaderNodeMapping", {"Vector": place})
        _drive(moved.inputs["Location"], "default_value", "frame / 20", 0)
        squares = stage.node(tree, "ShaderNodeTexChecker", {"Vector": moved, "Color1": ramp, "Scale": 3.0})
        return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": squares})

    stage.row([driven, stage.material("Grouped", grouped), stage.material("Sliding", sliding)])
    scene.frame_set(12, subframe=0.5)


@case("Geometry nodes: other bodies in renders, free normals, lamps of a collection, letters, material indices",
      bounces=3)  # fmt: skip
def node_switches() -> None:
    """Setups of add-ons."""
    small()
    clay = stage.principled("Clay", (0.7, 0.6, 0.5))
    box = stage.add("Box", stage.cube("Box", clay, size=0.6), (-1.7, 0.8, 0.4))
    tree, start, end = _nodes(box)
    switch = stage.node(tree, "GeometryNodeSwitch", {"Switch": stage.node(tree, "GeometryNodeIsViewport")},
                        input_type="GEOMETRY")  # fmt: skip
    ball = stage.node(tree, "GeometryNodeMeshIcoSphere", {"Radius": 0.4, "Subdivisions": 3})
    blue = stage.node(tree, "GeometryNodeSetMaterial", {0: ball, "Material": stage.diffuse("Blue", (0.2, 0.4, 0.8))})
    for name, output in (("False", blue.outputs[0]), ("True", start.outputs[0])):
        tree.links.new(output, next(socket for socket in switch.inputs if socket.name == name))
    tree.links.new(switch.outputs[0], end.inputs[0])

    bent = stage.add("Bent", stage.sphere("Bent", clay, radius=0.5, segments=16), (-0.5, 0.7, 0.5))
    tree, start, end = _nodes(bent)
    free = stage.node(tree, "GeometryNodeSetMeshNormal", {0: start.outputs[0]}, mode="FREE")
    turned = stage.node(tree, "ShaderNodeVectorMath", {0: stage.node(tree, "GeometryNodeInputNormal"),
                                                       1: (0.6, 0.0, 0.4)}, operation="ADD")  # fmt: skip
    tree.links.new(turned.outputs[0], next(one for one in free.inputs if one.type == "VECTOR" and one.enabled))
    tree.links.new(free.outputs[0], end.inputs[0])

    lamps = bpy.data.collections.new("Lamps")
    lamp = bpy.data.objects.new("Bulb", bpy.data.lights.new("Bulb", "POINT"))
    lamp.data.energy, lamp.data.shadow_soft_size, lamp.data.color = 15.0, 0.05, (1.0, 0.5, 0.2)
    lamps.objects.link(lamp)
    carrier = stage.add("Carrier", stage.grid("Carrier", clay, size=1.6, cells=1), (0.8, 0.6, 0.8), scale=(1, 0.5, 1))
    tree, start, end = _nodes(carrier)
    bulbs = stage.node(tree, "GeometryNodeCollectionInfo", {"Collection": lamps})
    placed = stage.node(tree, "GeometryNodeInstanceOnPoints", {"Points": start.outputs[0], "Instance": bulbs})
    tree.links.new(placed.outputs[0], end.inputs[0])

    sign = stage.add("Sign", stage.mesh("Sign", [(0, 0, 0)], []), (-0.2, -0.9, 0.1), (0.9, 0, 0))
    tree, _, end = _nodes(sign)
    letters = stage.node(tree, "GeometryNodeStringToCurves", {"String": "Ab8", "Size": 0.8})
    solid = stage.node(tree, "GeometryNodeExtrudeMesh", {0: stage.node(tree, "GeometryNodeFillCurve", {0: letters}),
                                                         "Offset Scale": 0.1})  # fmt: skip
    pink = stage.node(tree, "GeometryNodeSetMaterial", {0: solid, "Material": stage.diffuse("Pink", (0.7, 0.2, 0.5))})
    tree.links.new(pink.outputs[0], end.inputs[0])

    spotted = stage.sphere("Spotted", clay, stage.diffuse("Green", (0.1, 0.7, 0.2)), radius=0.4, segments=12)
    tree, start, end = _nodes(stage.add("Spotted", spotted, (1.4, -0.6, 0.4)))
    index = stage.node(tree, "GeometryNodeInputIndex")
    odd = stage.node(tree, "ShaderNodeMath", {0: index, 1: 2.0}, operation="MODULO")
    second = stage.node(tree, "GeometryNodeSetMaterialIndex", {0: start.outputs[0], "Selection": odd,
                                                               "Material Index": 1})  # fmt: skip
    tree.links.new(second.outputs[0], end.inputs[0])


@case("Modifiers of UV maps: projected, warped, offset in arrays and mirrors; rims and stretched screws", bounces=2)
def uv_modifiers() -> None:
    """Textures that modifiers place."""
    small()
    cloth = textured("Cloth", checks("Checks", size=32))
    projector = stage.add("Projector", bpy.data.cameras.new("Projector"), (0, -2, 3), (0.6, 0, 0.3))
    head = stage.add("Head", stage.monkey("Head", cloth), (-1.5, 0.3, 0.6), scale=0.6)
    project = head.modifiers.new("Project", "UV_PROJECT")
    project.uv_layer, project.projector_count, project.aspect_x, project.scale_x = "UVMap", 1, 1.5, 0.7
    project.projectors[0].object = projector
    warp = stage.add("Warp", stage.plane("Warp", cloth, size=1.0), (-0.3, 0.8, 0.4), (0.6, 0, 0)).modifiers.new(
        "Warp", "UV_WARP")  # fmt: skip
    warp.scale, warp.rotation, warp.offset = (2, 3), 0.4, (0.2, 0.1)
    array = stage.add("Row", stage.cube("Row", cloth, size=0.3), (0.4, 0.7, 0.2)).modifiers.new("Array", "ARRAY")
    array.count, array.relative_offset_displace, array.offset_u, array.offset_v = 4, (1.3, 0.1, 0), 0.13, 0.2
    half = stage.plane("Half", cloth, size=0.8)
    for vertex in half.vertices:
        vertex.co.x += 0.4
    mirror = stage.add("Half", half, (0.6, -0.6, 0.3), (0.4, 0, 0)).modifiers.new("Mirror", "MIRROR")
    mirror.use_mirror_u, mirror.mirror_offset_v, mirror.offset_u = True, 0.25, 0.1
    sheet = stage.plane("Sheet", cloth, stage.diffuse("Rim", (0.8, 0.1, 0.1)), stage.diffuse("Back", (0.1, 0.1, 0.8)),
                        size=0.7)  # fmt: skip
    solid = stage.add("Sheet", sheet, (-1.0, -0.8, 0.3), (0.9, 0, 0.3)).modifiers.new("Solidify", "SOLIDIFY")
    solid.thickness, solid.material_offset_rim, solid.material_offset, solid.use_even_offset = 0.15, 1, 2, True
    line = stage.mesh("Line", [(0.2, 0, 0), (0.3, 0, 0.3), (0.15, 0, 0.6)], [], cloth)
    line.edges.add(2)
    line.edges[0].vertices, line.edges[1].vertices = (0, 1), (1, 2)
    screw = stage.add("Line", line, (1.9, 0.2, 0.1)).modifiers.new("Screw", "SCREW")
    screw.use_stretch_u = screw.use_stretch_v = screw.use_smooth_shade = True


@case("Assets that Blender brings: arrays, scattered leaves, tubes along curves, displaced bodies, generated hair",
      bounces=3)  # fmt: skip
def blender_assets() -> None:
    """Modifiers from the asset shelf."""
    small()
    folder = Path(bpy.utils.system_resource("DATAFILES")) / "assets" / "nodes"

    def append(file: str, *names: str) -> list[Any]:
        with bpy.data.libraries.load(str(folder / file), link=False) as (_, wanted):
            wanted.node_groups = list(names)
        return list(wanted.node_groups)

    def use(ob: Any, group: Any, **values: Any) -> None:
        """Add a group as a modifier; values by names of inputs, or 'object' for those that take an object."""
        made = ob.modifiers.new(group.name, "NODES")
        made.node_group = group
        for item in group.interface.items_tree:
            if getattr(item, "in_out", "") == "INPUT":
                name = "object" if item.socket_type == "NodeSocketObject" else item.name.replace(" ", "_")
                if name in values:
                    made[item.identifier] = values[name]

    clay = stage.principled("Clay", (0.6, 0.5, 0.4))
    array, scatter, tube, displace = append("geometry_nodes_essentials.blend", "Array", "Scatter on Surface",
                                            "Curve to Tube", "Displace Geometry")  # fmt: skip
    use(stage.add("Row", stage.cube("Row", clay, size=0.25), (-1.9, 0.8, 0.15), (0, 0, 0.2)), array)
    leaf = stage.cylinder("Leaf", stage.principled("Leaf", (0.2, 0.6, 0.2)), radius=0.06, top=0.0, depth=0.3)
    bed = stage.add("Bed", stage.grid("Bed", clay, size=1.4, cells=3), (-0.2, 0.5, 0.1))
    use(bed, scatter, object=stage.add("Leaf", leaf, (0, -50, 0)), Density=30.0)
    wire = bpy.data.curves.new("Wire", "CURVE")
    wire.dimensions = "3D"
    spline = wire.splines.new("NURBS")
    spline.points.add(4)
    places = ((0, 0, 0), (0.3, 0.5, 0.4), (0.8, -0.5, 0.2), (1.0, 0.3, 0.6), (1.3, 0, 0))
    for point, place in zip(spline.points, places, strict=True):
        point.co = (*place, 1.0)
    wire.materials.append(stage.principled("Steel", (0.2, 0.3, 0.8), Metallic=0.7))
    use(stage.add("Wire", wire, (0.7, 0.2, 0.3)), tube)
    use(stage.add("Stone", stage.sphere("Stone", clay, radius=0.35, segments=32), (1.4, -0.7, 0.4)), displace)
    skin = stage.principled("Skin", (0.8, 0.5, 0.4))
    head = stage.add("Head", stage.sphere("Head", skin, radius=0.4, segments=24), (-0.9, -0.6, 0.4))
    strands = bpy.data.hair_curves.new("Hair")
    strands.surface, strands.surface_uv_map = head, "UVMap"
    strands.materials.append(stage.principled("Hair", (0.3, 0.1, 0.05), Roughness=0.4))
    hair = stage.add("Hair", strands)
    hair.parent = head
    for group in append("procedural_hair_node_assets.blend", "Generate Hair Curves", "Hair Curves Noise",
                        "Set Hair Curve Profile"):  # fmt: skip
        use(hair, group, object=head, Hair_Length=0.2, Density=400.0, Radius=0.006)
