"""What a render evaluates and the viewport does not: levels, switches, hiding, edit mode, view layers, instancers."""

from __future__ import annotations

from typing import Any

import bmesh
import bpy
import numpy as np

from . import stage
from .case import case

CLAY = (0.55, 0.35, 0.25)


def studio() -> None:
    """A floor, one lamp, a dim world and a camera; small, since these scenes are simple."""
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y = 112, 80
    stage.add("Floor", stage.plane("Floor", stage.diffuse("Floor", (0.4, 0.4, 0.42)), size=30.0))
    stage.lamp("AREA", "Key", 300.0, (-3.0, -3.0, 5.0), (0, 0, 0.5), size=2.5)
    stage.world((0.35, 0.45, 0.6), 0.5)
    stage.camera((0.0, -6.2, 4.6), (0, 0.2, 0.4), 40.0)


def clay(name: str = "Clay", color: Any = CLAY) -> Any:
    return stage.diffuse(name, color)


def collection(name: str, *members: Any) -> Any:
    """A collection of the scene with these objects, moved out of the scene's own."""
    made = bpy.data.collections.new(name)
    bpy.context.scene.collection.children.link(made)
    for ob in members:
        made.objects.link(ob)
        bpy.context.scene.collection.objects.unlink(ob)
    return made


def box(name: str, x: float, color: Any = CLAY, y: float = 0.0) -> Any:
    return stage.add(name, stage.cube(name, clay(name, color), size=0.8), (x, y, 0.5), (0, 0, 0.4))


@case("Subdivision and multiresolution with more levels in renders than in the viewport", bounces=2)
def render_levels() -> None:
    """Boxes that the viewport shows coarser than a render does."""
    studio()
    for k, (viewport, render) in enumerate(((0, 3), (1, 2), (3, 1))):
        ob = stage.add(f"Box {k}", stage.cube(f"Box {k}", clay(), size=1.3), (1.8 * (k - 1), 0, 0.65), (0, 0, 0.4))
        modifier = ob.modifiers.new("Subdivision", "SUBSURF")
        modifier.levels, modifier.render_levels = viewport, render
    ball = stage.add("Ball", stage.cube("Ball", clay(), size=1.1), (0, 1.6, 0.6))
    modifier = ball.modifiers.new("Multires", "MULTIRES")
    bpy.context.view_layer.objects.active = ball
    for _ in range(2):
        bpy.ops.object.multires_subdivide(modifier=modifier.name)
    modifier.levels, modifier.render_levels = 0, 2


@case("Render settings' Simplify limits the levels of subdivision", bounces=2)
def simplified() -> None:
    """The limit of renders is another than that of the viewport."""
    studio()
    render = bpy.context.scene.render
    render.use_simplify, render.simplify_subdivision, render.simplify_subdivision_render = True, 3, 1
    ob = stage.add("Box", stage.cube("Box", clay(), size=1.8), (0, 0, 0.9), (0, 0, 0.4))
    modifier = ob.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels = modifier.render_levels = 3


@case("Modifiers that are off in the viewport and on in renders, and the reverse", bounces=2)
def modifier_switches() -> None:
    """An array, a mirror and a bevel."""
    studio()
    row = stage.add("Row", stage.cube("Row", clay("Row", (0.3, 0.5, 0.3)), size=0.5), (-2.0, -0.6, 0.3))
    array = row.modifiers.new("Array", "ARRAY")
    array.count, array.relative_offset_displace, array.show_viewport = 4, (1.6, 0, 0), False
    single = stage.add("Single", stage.cube("Single", clay("Single", (0.3, 0.3, 0.6)), size=0.7), (-1.5, 1.2, 0.4))
    array = single.modifiers.new("Array", "ARRAY")
    array.count, array.relative_offset_displace, array.show_render = 4, (1.4, 0, 0), False
    half = stage.add("Half", stage.monkey("Half", clay()), (1.4, 0.6, 0.8), scale=0.7)
    mirror = half.modifiers.new("Mirror", "MIRROR")
    mirror.use_axis, mirror.use_bisect_axis, mirror.show_viewport = (False, False, True), (False, False, True), False


@case("Helpers of modifiers: hidden cutters, a hidden path and empties; parents that are hidden or excluded", bounces=2)
def hidden_helpers() -> None:
    """Objects that are rendered depend on objects that are not."""
    studio()
    wall = stage.add("Wall", stage.cube("Wall", clay(), size=1.0), (-1.5, 0, 0.7), (0, 0, 0.3), (1.2, 0.4, 1.4))
    cutter = stage.add("Cutter", stage.cylinder("Cutter", clay("Inside", (0.2, 0.5, 0.3)), radius=0.35, depth=3.0),
                       (-1.5, 0, 0.8), (1.57, 0, 0.3))  # fmt: skip
    cut = wall.modifiers.new("Boolean", "BOOLEAN")
    cut.object, cut.operation, cut.solver = cutter, "DIFFERENCE", "EXACT"
    cutter.hide_render, cutter.display_type = True, "WIRE"
    cutter.hide_set(True)
    path = bpy.data.curves.new("Path", "CURVE")
    path.dimensions = "3D"
    spline = path.splines.new("BEZIER")
    spline.bezier_points.add(1)
    for k, point in enumerate(spline.bezier_points):
        point.co, point.handle_left_type, point.handle_right_type = (2.4 * k, 0.8 * k, 0.0), "AUTO", "AUTO"
    rail = stage.add("Path", path, (-0.2, -0.4, 0.3))
    bead = stage.add("Bead", stage.cube("Bead", clay("Bead", (0.3, 0.3, 0.6)), size=0.3), (-0.2, -0.4, 0.3))
    array = bead.modifiers.new("Array", "ARRAY")
    array.fit_type, array.curve, array.relative_offset_displace = "FIT_CURVE", rail, (1.3, 0, 0)
    bend = bead.modifiers.new("Curve", "CURVE")
    bend.object = rail
    collection("Helpers", rail)
    bpy.context.view_layer.layer_collection.children["Helpers"].exclude = True
    parent = stage.add("Parent", None, (0.6, 1.2, 0.6), (0, 0, 0.6), 0.8)
    parent.hide_render = parent.hide_viewport = True
    child = stage.add("Child", stage.monkey("Child", clay()), scale=0.7)
    child.parent = parent


@case("Hidden in the viewport in every way, yet rendered: eye, monitor, collections, lamps", bounces=2)
def hidden_in_viewport() -> None:
    """Six boxes and a lamp; what a render hides is hidden, too."""
    studio()
    box("Eye", -2.2, (0.7, 0.2, 0.2)).hide_set(True)
    box("Monitor", -1.1, (0.2, 0.6, 0.2)).hide_viewport = True
    collection("Monitor", box("Collection's monitor", 0.0, (0.2, 0.2, 0.7))).hide_viewport = True
    eye = collection("Eye", box("Collection's eye", 1.1, (0.7, 0.7, 0.2)))
    children = bpy.context.view_layer.layer_collection.children
    children[eye.name].hide_viewport = True
    box("In renders", -1.6, y=1.4).hide_render = True
    collection("In renders", box("Collection in renders", 0.0, y=1.4)).hide_render = True
    excluded = collection("Excluded", box("Excluded", 1.6, y=1.4))
    children[excluded.name].exclude = True
    lamp = stage.lamp("POINT", "Hidden lamp", 120.0, (2.2, -1.2, 1.2), shadow_soft_size=0.2)
    lamp.hide_viewport = True
    stage.lamp("POINT", "Lamp in renders", 120.0, (-2.2, -1.2, 1.2), shadow_soft_size=0.2).hide_render = True


def _edited(*obs: Any) -> None:
    """Put these objects into edit mode."""
    bpy.ops.object.select_all(action="DESELECT")
    for ob in obs:
        ob.select_set(True)
    bpy.context.view_layer.objects.active = obs[0]
    bpy.ops.object.mode_set(mode="EDIT")


@case("Saved in edit mode: several objects, a texture by UV, slots per face", bounces=2)
def edit_mode() -> None:
    """Objects whose evaluated meshes are edit meshes."""
    studio()
    checks = np.kron([[0.1, 0.8], [0.7, 0.2]], np.ones((4, 4)))[..., None] * np.array([1.0, 0.8, 0.5])
    image = stage.image("Checks", checks.astype(np.float32))
    painted = stage.material("Painted", lambda tree: stage.node(
        tree, "ShaderNodeBsdfDiffuse", {"Color": stage.node(tree, "ShaderNodeTexImage", image=image)}))  # fmt: skip
    textured = stage.add("Textured", stage.cube("Textured", painted, size=1.1), (-1.4, 0, 0.6), (0, 0, 0.5))
    slots = stage.cube("Slots", clay(), clay("Green", (0.2, 0.6, 0.3)), size=1.1)
    slots.polygons.foreach_set("material_index", np.arange(6) % 2)
    slotted = stage.add("Slots", slots, (0.4, 0.2, 0.6), (0, 0, 0.2))
    smooth = stage.add("Smooth", stage.monkey("Smooth", clay()), (1.9, 0.1, 0.7), scale=0.7)
    _edited(textured, slotted, smooth)


@case("Saved in edit mode with a Subdivision modifier, as it happens to a modeller", bounces=2)
def edit_mode_subdivision() -> None:
    """The cage is edited; a render has other levels. Another object uses the same mesh."""
    studio()
    mesh = stage.cube("Box", clay(), size=1.2)
    box = stage.add("Box", mesh, (-1.1, 0, 0.7), (0, 0, 0.4))
    modifier = box.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels, modifier.render_levels = 1, 3
    stage.add("Twin", mesh, (1.1, 0.2, 0.7), (0, 0, 0.2))
    monkey = stage.add("Monkey", stage.monkey("Monkey", clay("Blue", (0.3, 0.4, 0.6))), (0, 1.7, 0.8), scale=0.6)
    modifier = monkey.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels, modifier.render_levels, modifier.show_in_editmode = 1, 2, False
    _edited(box, monkey)


@case("Saved in edit mode of curves, with finer resolution in renders", bounces=2)
def edit_mode_curves() -> None:
    """A tube and a text; the text is not edited."""
    studio()
    path = bpy.data.curves.new("Path", "CURVE")
    path.dimensions, path.bevel_depth, path.bevel_resolution = "3D", 0.2, 3
    path.resolution_u, path.render_resolution_u = 1, 12
    path.materials.append(clay())
    spline = path.splines.new("BEZIER")
    spline.bezier_points.add(2)
    for k, point in enumerate(spline.bezier_points):
        point.co = (1.2 * (k - 1), 0.4 * (-1) ** k, 0.4 + 0.5 * (k % 2))
        point.handle_left_type = point.handle_right_type = "AUTO"
    text = bpy.data.curves.new("Text", "FONT")
    text.body, text.extrude, text.align_x = "edit", 0.1, "CENTER"
    text.resolution_u, text.render_resolution_u = 1, 8
    text.materials.append(clay("Ink", (0.1, 0.3, 0.6)))
    stage.add("Text", text, (0, 1.2, 0.2), (1.2, 0, 0), 1.4)
    _edited(stage.add("Path", path, (0, -0.6, 0)))


@case("Saved in sculpt mode, with multiresolution levels that only renders use", bounces=2)
def sculpt_mode() -> None:
    """A sculptor works on a coarse level."""
    studio()
    ball = stage.add("Ball", stage.cube("Ball", clay(), size=1.6), (-0.9, 0, 0.9), (0, 0, 0.3))
    modifier = ball.modifiers.new("Multires", "MULTIRES")
    bpy.ops.object.select_all(action="DESELECT")
    ball.select_set(True)
    bpy.context.view_layer.objects.active = ball
    for _ in range(3):
        bpy.ops.object.multires_subdivide(modifier=modifier.name)
    modifier.levels, modifier.sculpt_levels, modifier.render_levels = 0, 1, 3
    twin = stage.add("Twin", ball.data, (1.2, 0.3, 0.8), scale=0.8)
    twin.modifiers.new("Subdivision", "SUBSURF").render_levels = 1
    bpy.ops.object.mode_set(mode="SCULPT")


def _two_layers() -> tuple[Any, Any]:
    """View layers of the scene, each of which excludes the other's box."""
    left, right = collection("Left", box("Left", -1.0)), collection("Right", box("Right", 1.0, (0.2, 0.5, 0.4)))
    scene = bpy.context.scene
    first, second = scene.view_layers[0], scene.view_layers.new("Second")
    first.layer_collection.children[right.name].exclude = True
    second.layer_collection.children[left.name].exclude = True
    return first, second


@case("The file was saved while the window showed a view layer that is not rendered", bounces=2)
def second_view_layer() -> None:
    """Only the second view layer is used for rendering."""
    studio()
    first, second = _two_layers()
    first.use, second.use = False, True
    bpy.context.window.view_layer = first


@case("Several view layers are rendered; Blender shows the picture of the first", bounces=2)
def several_view_layers() -> None:
    """The window shows the second."""
    studio()
    _, second = _two_layers()
    bpy.context.window.view_layer = second


@case("Collections that only indirect rays see", bounces=3)
def indirect_only() -> None:
    """A bright box that is only seen by its shadow and its colour on the floor."""
    studio()
    hidden = collection("Hidden", box("Box", 0.9, (0.8, 0.1, 0.1)), stage.add(
        "Lamp", stage.sphere("Lamp", stage.emitter("Lamp", (0.4, 0.7, 1.0), 12.0), radius=0.25, segments=24),
        (-0.9, 0.2, 0.5)))  # fmt: skip
    bpy.context.view_layer.layer_collection.children[hidden.name].indirect_only = True
    box("Seen", 0.0, (0.7, 0.7, 0.7), y=1.0)


@case("Holdout collections", bounces=2)
def holdout_collection() -> None:
    """A box that cuts a hole into the picture."""
    studio()
    hole = collection("Hole", box("Hole", -0.7))
    bpy.context.view_layer.layer_collection.children[hole.name].holdout = True
    box("Seen", 0.8, (0.3, 0.5, 0.3))


@case("Unapplied scale: negative, uneven, inherited from parents", bounces=2)
def unapplied_scale() -> None:
    """Monkeys, a flat-shaded ball and a lamp with unapplied transforms."""
    studio()
    clay = stage.principled("Clay", CLAY, Roughness=0.4)
    stage.add("X", stage.monkey("X", clay), (-2.0, 0, 0.8), (0, 0, 0.3), (-0.7, 0.7, 0.7))
    stage.add("All", stage.monkey("All", clay), (-0.6, 0, 0.8), (0.3, 0, 0), (-0.6, -0.7, -0.8))
    parent = stage.add("Parent", None, (0.8, 0, 0.8), (0.2, 0.3, 0.1), (1.0, -1.0, 0.6))
    child = stage.add("Child", stage.monkey("Child", clay), (0, 0, 0), (0, 0.4, 0.5), (0.6, 0.9, 0.8))
    child.parent = parent
    flat = stage.add("Flat", stage.sphere("Flat", clay, radius=0.6, segments=16, smooth=False), (2.1, 0, 0.6))
    flat.scale = (1.0, 1.0, -1.0)
    lamp = stage.lamp("AREA", "Mirrored lamp", 60.0, (1.5, -2.0, 2.5), (0.5, 0, 0.5), size=1.0)
    lamp.scale = (-1.0, 1.5, 1.0)


@case("Far from the origin: everything stands a kilometre away", bounces=2)
def far_from_origin() -> None:
    """A scene that was placed by map coordinates."""
    studio()
    stage.add("Ball", stage.sphere("Ball", clay(), radius=0.7, segments=48), (-1.0, 0, 0.7))
    box("Box", 1.0, (0.3, 0.4, 0.6))
    for ob in bpy.context.scene.objects:
        ob.location.x += 870.0
        ob.location.y -= 430.0
        ob.location.z += 25.0


@case("An animated frame: keyed places, levels and visibility; the camera changes by markers", bounces=2)
def animated_frame() -> None:
    """Frame 7 of 20."""
    studio()
    scene = bpy.context.scene
    mover = box("Mover", 0.0)
    for frame, x in ((1, -3.0), (20, 3.0)):
        mover.location.x = x
        mover.keyframe_insert("location", index=0, frame=frame)
    for name, hidden in (("Appears", (True, False)), ("Vanishes", (False, True))):
        ob = box(name, 1.2 if hidden[0] else -1.6, (0.3, 0.5, 0.3), y=1.3)
        for frame, state in zip((1, 5), hidden, strict=True):
            ob.hide_render = state
            ob.keyframe_insert("hide_render", frame=frame)
    rounded = stage.add("Rounded", stage.cube("Rounded", clay(), size=1.1), (1.8, 0, 0.6))
    modifier = rounded.modifiers.new("Subdivision", "SUBSURF")
    for frame, levels in ((1, 0), (7, 3)):
        modifier.render_levels = levels
        modifier.keyframe_insert("render_levels", frame=frame)
    first = scene.camera
    second = stage.camera((3.0, -5.0, 3.6), (0, 0.2, 0.4), 40.0)
    second.name = "Second camera"
    for frame, ob in ((1, first), (6, second)):
        scene.timeline_markers.new(f"Camera {frame}", frame=frame).camera = ob
    scene.frame_end = 20
    scene.frame_set(7)
    scene.camera = first


@case("A posed body: shape keys, an armature that is off in the viewport, subdivision", bounces=2)
def posed() -> None:
    """A column that an armature bends in renders only."""
    studio()
    column = stage.cylinder("Column", clay(), radius=0.3, depth=2.0, segments=12, smooth=True)
    body = bmesh.new()
    body.from_mesh(column)
    long = [edge for edge in body.edges if abs(edge.verts[0].co.z - edge.verts[1].co.z) > 1.0]
    bmesh.ops.subdivide_edges(body, edges=long, cuts=9, use_grid_fill=True)
    body.to_mesh(column)
    body.free()
    ob = stage.add("Column", column, (0, 0, 1.05))
    ob.shape_key_add(name="Basis")
    fat = ob.shape_key_add(name="Fat")
    for point in fat.points:
        point.co.x *= 1.6
    fat.value = 0.7
    bones = bpy.data.armatures.new("Bones")
    rig = stage.add("Rig", bones, (0, 0, 1.05))
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    lower, upper = bones.edit_bones.new("Lower"), bones.edit_bones.new("Upper")
    lower.head, lower.tail = (0, 0, -1), (0, 0, 0)
    upper.head, upper.tail, upper.parent = (0, 0, 0), (0, 0, 1), lower
    bpy.ops.object.mode_set(mode="OBJECT")
    for name, side in (("Lower", -1.0), ("Upper", 1.0)):
        group = ob.vertex_groups.new(name=name)
        for vertex in column.vertices:
            group.add([vertex.index], min(max(0.5 + side * vertex.co.z, 0.0), 1.0), "REPLACE")
    rig.pose.bones["Upper"].rotation_mode = "XYZ"
    rig.pose.bones["Upper"].rotation_euler = (0.0, 0.3, 0.9)
    armature = ob.modifiers.new("Armature", "ARMATURE")
    armature.object, armature.show_viewport = rig, False
    divide = ob.modifiers.new("Subdivision", "SUBSURF")
    divide.levels, divide.render_levels = 0, 2


@case("A background set: the objects and lamps of another scene", bounces=2)
def background_set() -> None:
    """The floor's lamp and a box come from the set."""
    studio()
    box("Own", -0.9)
    scene = bpy.context.scene
    other = bpy.data.scenes.new("Set")
    for ob in (box("Of the set", 0.9, (0.2, 0.5, 0.4)), bpy.data.objects["Key"]):
        other.collection.objects.link(ob)
        scene.collection.objects.unlink(ob)
    scene.background_set = other
