"""Geometry by modifiers, particles and nodes, and objects as they end up in files."""

from __future__ import annotations

import math
from typing import Any

import bpy
from mathutils import Matrix

from .. import stage
from ..case import case


def _two_tone(name: str) -> Any:
    return stage.principled(name, (0.7, 0.3, 0.15), Roughness=0.5)


@case("Modifiers: Array, Mirror, Boolean, Solidify, Bevel, Screw, Skin, Wireframe, Remesh", bounces=2)
def modifiers() -> None:
    """Several on one object, in the usual orders."""
    stage.studio(width=7.0)
    made = _two_tone("Clay")
    array = stage.add("Array", stage.cube("Array", made, size=0.4), (-3.0, -0.8, 0.3))
    array.modifiers.new("Bevel", "BEVEL").width = 0.06
    several = array.modifiers.new("Array", "ARRAY")
    several.count, several.relative_offset_displace = 4, (1.3, 0.0, 0.3)
    mirror = stage.add("Mirror", stage.monkey("Mirror", made), (1.0, -0.6, 0.7), (0, 0, 0.4), 0.5)
    halves = mirror.modifiers.new("Mirror", "MIRROR")
    halves.use_axis = halves.use_bisect_axis = (True, False, False)
    mirror.modifiers.new("Subdivision", "SUBSURF").render_levels = 2
    cutter = stage.add(
        "Cutter", stage.sphere("Cutter", stage.diffuse("Cut", (0.1, 0.3, 0.7)), radius=0.6), (2.6, -1.2, 0.9)
    )
    cutter.hide_render = True
    cut = stage.add("Cut", stage.cube("Cut", made, size=1.0), (2.9, -0.8, 0.5))
    boolean = cut.modifiers.new("Boolean", "BOOLEAN")
    boolean.object, boolean.solver = cutter, "EXACT"
    shell = stage.add("Shell", stage.grid("Shell", made, size=1.2, cells=6), (-2.6, 1.0, 0.7), (0.6, 0.3, 0))
    shell.modifiers.new("Solidify", "SOLIDIFY").thickness = 0.1
    wave = shell.modifiers.new("Wave", "WAVE")
    wave.height, wave.width = 0.2, 0.7
    profile = stage.mesh("Profile", [(0.3, 0, 0), (0.5, 0, 0.4), (0.2, 0, 0.8), (0.35, 0, 1.2)], [])
    profile.edges.add(3)
    profile.edges.foreach_set("vertices", [0, 1, 1, 2, 2, 3])
    profile.materials.append(made)
    profile.update()
    screw = stage.add("Screw", profile, (-0.6, 1.3, 0.0))
    screw.modifiers.new("Screw", "SCREW").use_smooth_shade = True
    wire = stage.add("Wire", stage.sphere("Wire", made, radius=0.6, segments=16), (0.9, 1.4, 0.6))
    wire.modifiers.new("Wireframe", "WIREFRAME").thickness = 0.05
    low = stage.add("Low", stage.sphere("Low", made, radius=0.6), (2.6, 1.4, 0.6))
    low.modifiers.new("Decimate", "DECIMATE").ratio = 0.05


@case("A symmetric mesh that is mirrored as a whole, so that it lies twice at the same place", bounces=2,
      differs=("faces lie twice at the same place: in Cycles they shadow each other by rounding; the export names "
               "them",))  # fmt: skip
def mirrored_whole() -> None:
    """A frequent mistake: Cycles renders such meshes with dark speckles."""
    stage.studio(width=5.0)
    mirror = stage.add("Mirror", stage.monkey("Mirror", _two_tone("Clay")), (0, 0, 1.0), (0, 0, 0.4), 0.9)
    mirror.modifiers.new("Mirror", "MIRROR").use_axis = (True, False, False)
    mirror.modifiers.new("Subdivision", "SUBSURF").render_levels = 2


def _smooth_by_angle() -> Any:
    """Blender's own node group, from the assets that come with it."""
    from pathlib import Path

    path = Path(bpy.utils.system_resource("DATAFILES")) / "assets" / "nodes" / "geometry_nodes_essentials.blend"
    with bpy.data.libraries.load(str(path), link=False) as (found, wanted):
        wanted.node_groups = [name for name in found.node_groups if name == "Smooth by Angle"]
    return wanted.node_groups[0]


@case("Smooth by Angle, Weighted Normal, marked edges, custom normals of a transfer", bounces=2)
def smoothing() -> None:
    """Auto smooth of all versions."""
    stage.studio(width=6.0)
    shiny = stage.principled("Shiny", (0.5, 0.55, 0.6), Metallic=1.0, Roughness=0.35)
    group = _smooth_by_angle()
    first = stage.add("By angle", stage.cylinder("By angle", shiny, radius=0.6, depth=1.0, smooth=True), (-2.0, 0, 0.5))
    nodes = first.modifiers.new("Smooth by Angle", "NODES")
    nodes.node_group = group
    second = stage.add("Weighted", stage.cube("Weighted", shiny, size=1.0), (-0.4, 0, 0.5), (0, 0, 0.5))
    bevel = second.modifiers.new("Bevel", "BEVEL")
    bevel.width, bevel.segments = 0.15, 3
    for face in second.data.polygons:
        face.use_smooth = True
    second.modifiers.new("Weighted", "WEIGHTED_NORMAL").keep_sharp = True
    cone = stage.cylinder("Marked", shiny, radius=0.6, top=0.3, depth=1.0, segments=12, smooth=True)
    third = stage.add("Marked", cone, (1.2, 0, 0.5))  # fmt: skip
    for edge in third.data.edges:
        edge.use_edge_sharp = edge.index % 3 == 0
    fourth = stage.add("Split", stage.sphere("Split", shiny, radius=0.6, segments=12), (2.6, 0, 0.6))
    fourth.modifiers.new("Split", "EDGE_SPLIT").split_angle = math.radians(40.0)


@case(
    "Scatter by geometry nodes: instances on points, random turns and sizes, realised and not, by collection", bounces=2
)
def node_scatter() -> None:
    """Grass, stones and trees of tutorials."""
    stage.studio(width=6.0)
    stones = bpy.data.collections.new("Stones")
    for k in range(2):
        ob = bpy.data.objects.new(f"Stone {k}", stage.sphere(f"Stone {k}", stage.principled(f"Stone {k}", (
            0.6 - 0.4 * k, 0.4, 0.2 + 0.5 * k)), radius=0.12, segments=12, smooth=k > 0))  # fmt: skip
        ob.location = (5.0 * k, 3.0, 0.1)
        ob.scale = (1.0, 0.7, 1.4)
        stones.objects.link(ob)

    def scattered(name: str, realised: bool) -> Any:
        group = bpy.data.node_groups.new(name, "GeometryNodeTree")
        group.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
        group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
        start, end = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
        points = stage.node(group, "GeometryNodeDistributePointsOnFaces", {"Mesh": start.outputs[0], "Density": 6.0})
        info = stage.node(group, "GeometryNodeCollectionInfo", {"Collection": stones}, transform_space="ORIGINAL")
        info.inputs["Separate Children"].default_value = True
        info.inputs["Reset Children"].default_value = True
        sizes = stage.node(group, "FunctionNodeRandomValue", data_type="FLOAT")
        sizes.inputs[2].default_value, sizes.inputs[3].default_value = 0.6, 1.8
        placed = stage.node(group, "GeometryNodeInstanceOnPoints", {
            "Points": points.outputs["Points"], "Instance": info, "Rotation": points.outputs["Rotation"],
            "Scale": sizes.outputs[1]})  # fmt: skip
        placed.inputs["Pick Instance"].default_value = True
        found = stage.node(group, "GeometryNodeRealizeInstances", {0: placed}) if realised else placed
        both = group.nodes.new("GeometryNodeJoinGeometry")
        group.links.new(start.outputs[0], both.inputs[0])
        group.links.new(found.outputs[0], both.inputs[0])
        group.links.new(both.outputs[0], end.inputs[0])
        return group

    for k in range(2):
        patch = stage.grid(f"Ground {k}", _two_tone("Ground"), size=2.4)
        ground = stage.add(f"Ground {k}", patch, (-1.4 + 2.8 * k, 0, 0.2), (0.2, 0.1, 0.3))  # fmt: skip
        ground.modifiers.new("Scatter", "NODES").node_group = scattered(f"Scatter {k}", k > 0)


@case("Objects as they end up: sheared by parents, mirrored, inside out, overlapping, loose vertices", bounces=2)
def untidy_objects() -> None:
    """Nothing applied, nothing cleaned."""
    stage.studio(width=6.0)
    made = stage.principled("Paint", (0.2, 0.5, 0.3), Roughness=0.3)
    parent = stage.add("Parent", None, (-2.0, 0, 0.6), (0, 0, 0.5), (2.0, 0.6, 1.0))
    child = stage.add("Sheared", stage.cube("Sheared", made, size=0.8), (0, 0, 0), (0.3, 0.2, 0.7))
    child.parent = parent
    mirrored = stage.add("Mirrored", stage.monkey("Mirrored", made), (-0.2, 0.0, 0.7), (0, 0, 0.3), (-0.6, 0.6, 0.6))
    mirrored.matrix_parent_inverse = Matrix.Identity(4)
    inside = stage.sphere("Inside out", made, radius=0.6)
    inside.flip_normals()
    stage.add("Inside out", inside, (1.3, 0.2, 0.6))
    glass = stage.sphere("Inside out glass", stage.simple("Glass", "ShaderNodeBsdfGlass", {"IOR": 1.45}), radius=0.5)
    glass.flip_normals()
    stage.add("Inside out glass", glass, (2.5, 0.2, 0.5))
    block = stage.add("Overlap 1", stage.cube("Overlap 1", made, size=0.8), (0.4, -1.4, 0.4))
    stage.add("Overlap 2", stage.cube("Overlap 2", _two_tone("Other"), size=0.8), (0.7, -1.3, 0.35), (0.2, 0.3, 0.1))
    block.data.vertices.add(3)
    block.data.edges.add(1)
    stage.add("Points only", stage.mesh("Points only", [(0, 0, 1), (1, 0, 1)], []))
    stage.add("Empty mesh", bpy.data.meshes.new("Empty mesh"))


@case("Curves with bevel objects, taper and fill; text with depth and bevel; metaballs; NURBS", bounces=2)
def curves_and_text() -> None:
    """All that Blender turns into meshes by itself."""
    stage.studio(width=6.0)
    gold = stage.principled("Gold", (0.8, 0.6, 0.2), Metallic=1.0, Roughness=0.3)
    path = bpy.data.curves.new("Pipe", "CURVE")
    path.dimensions, path.bevel_depth, path.bevel_resolution, path.use_fill_caps = "3D", 0.12, 4, True
    spline = path.splines.new("BEZIER")
    spline.bezier_points.add(3)
    for k, point in enumerate(spline.bezier_points):
        point.co = (0.6 * k - 0.9, 0.4 * (-1) ** k, 0.3 * k)
        point.handle_left_type = point.handle_right_type = "AUTO"
    path.materials.append(gold)
    stage.add("Pipe", path, (-1.8, 0.5, 0.3))
    round_ = bpy.data.curves.new("Profile", "CURVE")
    round_.dimensions = "2D"
    circle = round_.splines.new("NURBS")
    circle.points.add(4)
    for k, point in enumerate(circle.points):
        point.co = (0.15 * math.cos(k * 1.2566), 0.08 * math.sin(k * 1.2566), 0, 1)
    circle.use_cyclic_u, circle.order_u = True, 3
    profile = stage.add("Profile", round_, (0, 8, 0))
    rail = bpy.data.curves.new("Rail", "CURVE")
    rail.dimensions, rail.bevel_mode, rail.bevel_object = "3D", "OBJECT", profile
    poly = rail.splines.new("POLY")
    poly.points.add(3)
    for k, point in enumerate(poly.points):
        point.co = (0.5 * k, 0.2 * k, 0.1 * k, 1)
        point.tilt = 0.4 * k
    rail.materials.append(_two_tone("Rail"))
    stage.add("Rail", rail, (-0.3, -0.8, 0.3))
    font = bpy.data.curves.new("Words", "FONT")
    font.body, font.extrude, font.bevel_depth, font.size, font.align_x = "Edge\ngrad", 0.08, 0.02, 0.7, "CENTER"
    font.materials.append(stage.principled("Letters", (0.2, 0.3, 0.8)))
    stage.add("Words", font, (1.4, 0.8, 0.9), (1.3, 0, -0.2))
    ball = bpy.data.metaballs.new("Blob")
    ball.render_resolution = 0.08
    for k in range(3):
        element = ball.elements.new()
        element.co, element.radius = (0.5 * k, 0.2 * k, 0.1), 0.6
    ball.materials.append(_two_tone("Blob"))
    stage.add("Blob", ball, (1.2, -0.9, 0.4))


@case("A scene of millimetres: a ring on a table, unit scale 0.001 and not", bounces=4, samples=96)
def millimetres() -> None:
    """Jewellery: one thousandth of the usual size."""
    stage.studio(width=6.0)
    stage.row([stage.principled("Gold", (0.9, 0.7, 0.3), Metallic=1.0, Roughness=0.15),
               stage.simple("Gem", "ShaderNodeBsdfGlass", {"IOR": 2.0, "Color": (0.9, 0.95, 1.0)})],
              gap=1.6)  # fmt: skip
    _scaled(0.001)


@case("A scene of kilometres: buildings, clip end far away", bounces=3)
def kilometres() -> None:
    """A thousand times the usual size."""
    stage.studio(width=6.0)
    stage.row([_two_tone("A"), stage.principled("B", Metallic=1.0, Roughness=0.2)], gap=1.6)
    stage.add("Block", stage.cube("Block", _two_tone("C"), size=1.0), (0, 1.4, 0.5), (0, 0, 0.3))
    _scaled(1000.0)


@case("Ten kilometres from the origin: a city model in map coordinates", bounces=2)
def ten_kilometres_away() -> None:
    """Single precision leaves a millimetre."""
    stage.studio(width=6.0)
    stage.row([_two_tone("A"), stage.principled("B", Metallic=1.0, Roughness=0.2)], gap=1.6)
    for ob in bpy.context.scene.objects:
        ob.location = ob.location + type(ob.location)((8000.0, -6000.0, 40.0))


def _scaled(factor: float) -> None:
    for ob in bpy.context.scene.objects:
        ob.location = ob.location * factor
        if ob.type == "LIGHT":
            ob.data.energy *= factor**2
            ob.data.size *= factor
        elif ob.type == "CAMERA":
            ob.data.clip_start, ob.data.clip_end = ob.data.clip_start * factor, ob.data.clip_end * factor
        else:
            ob.scale = ob.scale * factor


@case("Collection instances with an offset, of a collection that is excluded, and linked objects", bounces=2)
def excluded_sources() -> None:
    """Kits of parts: sources excluded from the view layer, instances shown."""
    stage.studio(width=6.0)
    scene = bpy.context.scene
    kit = bpy.data.collections.new("Kit")
    scene.collection.children.link(kit)
    for k in range(2):
        ob = bpy.data.objects.new(f"Part {k}", stage.cube(f"Part {k}", stage.principled(f"Part {k}", (
            0.7 - 0.5 * k, 0.3, 0.2 + 0.4 * k)), size=0.6))  # fmt: skip
        ob.location = (0.7 * k, 0.0, 0.3 + 0.3 * k)
        kit.objects.link(ob)
    kit.instance_offset = (0.3, 0.2, 0.0)
    for k in range(3):
        ob = stage.add(f"Kit {k}", None, (-1.8 + 1.7 * k, 0.5 - 0.5 * k, 0), (0, 0, 0.4 * k), (1.0 - 0.2 * k, 1.0, 1.0))
        ob.instance_type, ob.instance_collection = "COLLECTION", kit
    bpy.context.view_layer.layer_collection.children["Kit"].exclude = True


@case("Particles: emitted objects with random size and turn, children, and a hair system of a collection", bounces=2)
def particle_scatter() -> None:
    """Old ways of scattering."""
    stage.studio(width=6.0)
    leaf = stage.add("Leaf", stage.monkey("Leaf", stage.principled("Leaf", (0.2, 0.5, 0.1))), (0, 30, 0), scale=0.2)
    ground = stage.add("Ground", stage.grid("Ground", _two_tone("Ground"), size=4.0), (0, 0, 0.1))
    ground.modifiers.new("Scatter", "PARTICLE_SYSTEM")
    settings = ground.particle_systems[0].settings
    settings.type, settings.count, settings.hair_length = "HAIR", 60, 1.0
    settings.render_type, settings.instance_object = "OBJECT", leaf
    settings.particle_size, settings.size_random = 0.6, 0.5
    settings.use_advanced_hair, settings.use_rotations = True, True
    settings.rotation_factor_random, settings.phase_factor_random = 0.2, 2.0
