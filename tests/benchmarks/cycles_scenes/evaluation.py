"""What a render evaluates and the viewport does not: levels, switches, hiding, edit mode, view layers, instancers."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from . import stage
from .case import case

CLAY = (0.55, 0.35, 0.25)


def _studio() -> None:
    """A floor, one lamp, a dim world and a camera; small, since these scenes are simple."""
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y = 112, 80
    stage.add("Floor", stage.plane("Floor", stage.diffuse("Floor", (0.4, 0.4, 0.42)), size=30.0))
    stage.lamp("AREA", "Key", 300.0, (-3.0, -3.0, 5.0), (0, 0, 0.5), size=2.5)
    stage.world((0.35, 0.45, 0.6), 0.5)
    stage.camera((0.0, -6.2, 4.6), (0, 0.2, 0.4), 40.0)


def _clay(name: str = "Clay", color: Any = CLAY) -> Any:
    return stage.diffuse(name, color)


def _collection(name: str, *members: Any) -> Any:
    """A collection of the scene with these objects, moved out of the scene's own."""
    made = bpy.data.collections.new(name)
    bpy.context.scene.collection.children.link(made)
    for ob in members:
        made.objects.link(ob)
        bpy.context.scene.collection.objects.unlink(ob)
    return made


def _box(name: str, x: float, color: Any = CLAY, y: float = 0.0) -> Any:
    return stage.add(name, stage.cube(name, _clay(name, color), size=0.8), (x, y, 0.5), (0, 0, 0.4))


@case("Subdivision and multiresolution with more levels in renders than in the viewport", bounces=2)
def render_levels() -> None:
    """Boxes that the viewport shows coarser than a render does."""
    _studio()
    for k, (viewport, render) in enumerate(((0, 3), (1, 2), (3, 1))):
        ob = stage.add(f"Box {k}", stage.cube(f"Box {k}", _clay(), size=1.3), (1.8 * (k - 1), 0, 0.65), (0, 0, 0.4))
        modifier = ob.modifiers.new("Subdivision", "SUBSURF")
        modifier.levels, modifier.render_levels = viewport, render
    ball = stage.add("Ball", stage.cube("Ball", _clay(), size=1.1), (0, 1.6, 0.6))
    modifier = ball.modifiers.new("Multires", "MULTIRES")
    bpy.context.view_layer.objects.active = ball
    for _ in range(2):
        bpy.ops.object.multires_subdivide(modifier=modifier.name)
    modifier.levels, modifier.render_levels = 0, 2


@case("Render settings' Simplify limits the levels of subdivision", bounces=2)
def simplified() -> None:
    """The limit of renders is another than that of the viewport."""
    _studio()
    render = bpy.context.scene.render
    render.use_simplify, render.simplify_subdivision, render.simplify_subdivision_render = True, 3, 1
    ob = stage.add("Box", stage.cube("Box", _clay(), size=1.8), (0, 0, 0.9), (0, 0, 0.4))
    modifier = ob.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels = modifier.render_levels = 3


@case("Modifiers that are off in the viewport and on in renders, and the reverse", bounces=2)
def modifier_switches() -> None:
    """An array, a mirror and a bevel."""
    _studio()
    row = stage.add("Row", stage.cube("Row", _clay("Row", (0.3, 0.5, 0.3)), size=0.5), (-2.0, -0.6, 0.3))
    array = row.modifiers.new("Array", "ARRAY")
    array.count, array.relative_offset_displace, array.show_viewport = 4, (1.6, 0, 0), False
    single = stage.add("Single", stage.cube("Single", _clay("Single", (0.3, 0.3, 0.6)), size=0.7), (-1.5, 1.2, 0.4))
    array = single.modifiers.new("Array", "ARRAY")
    array.count, array.relative_offset_displace, array.show_render = 4, (1.4, 0, 0), False
    half = stage.add("Half", stage.monkey("Half", _clay()), (1.4, 0.6, 0.8), scale=0.7)
    mirror = half.modifiers.new("Mirror", "MIRROR")
    mirror.use_axis, mirror.use_bisect_axis, mirror.show_viewport = (False, False, True), (False, False, True), False


@case("Hidden in the viewport in every way, yet rendered: eye, monitor, collections, lamps", bounces=2)
def hidden_in_viewport() -> None:
    """Six boxes and a lamp; what a render hides is hidden, too."""
    _studio()
    _box("Eye", -2.2, (0.7, 0.2, 0.2)).hide_set(True)
    _box("Monitor", -1.1, (0.2, 0.6, 0.2)).hide_viewport = True
    _collection("Monitor", _box("Collection's monitor", 0.0, (0.2, 0.2, 0.7))).hide_viewport = True
    eye = _collection("Eye", _box("Collection's eye", 1.1, (0.7, 0.7, 0.2)))
    children = bpy.context.view_layer.layer_collection.children
    children[eye.name].hide_viewport = True
    _box("In renders", -1.6, y=1.4).hide_render = True
    _collection("In renders", _box("Collection in renders", 0.0, y=1.4)).hide_render = True
    excluded = _collection("Excluded", _box("Excluded", 1.6, y=1.4))
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
    _studio()
    checks = np.kron([[0.1, 0.8], [0.7, 0.2]], np.ones((4, 4)))[..., None] * np.array([1.0, 0.8, 0.5])
    image = stage.image("Checks", checks.astype(np.float32))
    painted = stage.material("Painted", lambda tree: stage.node(
        tree, "ShaderNodeBsdfDiffuse", {"Color": stage.node(tree, "ShaderNodeTexImage", image=image)}))  # fmt: skip
    textured = stage.add("Textured", stage.cube("Textured", painted, size=1.1), (-1.4, 0, 0.6), (0, 0, 0.5))
    slots = stage.cube("Slots", _clay(), _clay("Green", (0.2, 0.6, 0.3)), size=1.1)
    slots.polygons.foreach_set("material_index", np.arange(6) % 2)
    slotted = stage.add("Slots", slots, (0.4, 0.2, 0.6), (0, 0, 0.2))
    smooth = stage.add("Smooth", stage.monkey("Smooth", _clay()), (1.9, 0.1, 0.7), scale=0.7)
    _edited(textured, slotted, smooth)


@case("Saved in edit mode with a Subdivision modifier, as it happens to a modeller", bounces=2)
def edit_mode_subdivision() -> None:
    """The cage is edited; a render has other levels. Another object uses the same mesh."""
    _studio()
    mesh = stage.cube("Box", _clay(), size=1.2)
    box = stage.add("Box", mesh, (-1.1, 0, 0.7), (0, 0, 0.4))
    modifier = box.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels, modifier.render_levels = 1, 3
    stage.add("Twin", mesh, (1.1, 0.2, 0.7), (0, 0, 0.2))
    monkey = stage.add("Monkey", stage.monkey("Monkey", _clay("Blue", (0.3, 0.4, 0.6))), (0, 1.7, 0.8), scale=0.6)
    modifier = monkey.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels, modifier.render_levels, modifier.show_in_editmode = 1, 2, False
    _edited(box, monkey)


def _two_layers() -> tuple[Any, Any]:
    """View layers of the scene, each of which excludes the other's box."""
    left, right = _collection("Left", _box("Left", -1.0)), _collection("Right", _box("Right", 1.0, (0.2, 0.5, 0.4)))
    scene = bpy.context.scene
    first, second = scene.view_layers[0], scene.view_layers.new("Second")
    first.layer_collection.children[right.name].exclude = True
    second.layer_collection.children[left.name].exclude = True
    return first, second


@case("The file was saved while the window showed a view layer that is not rendered", bounces=2)
def second_view_layer() -> None:
    """Only the second view layer is used for rendering."""
    _studio()
    first, second = _two_layers()
    first.use, second.use = False, True
    bpy.context.window.view_layer = first


@case("Several view layers are rendered; Blender shows the picture of the first", bounces=2)
def several_view_layers() -> None:
    """The window shows the second."""
    _studio()
    _, second = _two_layers()
    bpy.context.window.view_layer = second


@case("Collections that only indirect rays see", bounces=3)
def indirect_only() -> None:
    """A bright box that is only seen by its shadow and its colour on the floor."""
    _studio()
    hidden = _collection("Hidden", _box("Box", 0.9, (0.8, 0.1, 0.1)), stage.add(
        "Lamp", stage.sphere("Lamp", stage.emitter("Lamp", (0.4, 0.7, 1.0), 12.0), radius=0.25, segments=24),
        (-0.9, 0.2, 0.5)))  # fmt: skip
    bpy.context.view_layer.layer_collection.children[hidden.name].indirect_only = True
    _box("Seen", 0.0, (0.7, 0.7, 0.7), y=1.0)


HOLDOUT = "objects of a holdout collection are rendered as ordinary objects, which the export reports by name"


@case("Holdout collections", bounces=2, differs=[HOLDOUT])
def holdout_collection() -> None:
    """A box that cuts a hole into the picture."""
    _studio()
    hole = _collection("Hole", _box("Hole", -0.7))
    bpy.context.view_layer.layer_collection.children[hole.name].holdout = True
    _box("Seen", 0.8, (0.3, 0.5, 0.3))


@case("Unapplied scale: negative, uneven, inherited from parents", bounces=2)
def unapplied_scale() -> None:
    """Monkeys, a flat-shaded ball and a lamp with unapplied transforms."""
    _studio()
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
    _studio()
    stage.add("Ball", stage.sphere("Ball", _clay(), radius=0.7, segments=48), (-1.0, 0, 0.7))
    _box("Box", 1.0, (0.3, 0.4, 0.6))
    for ob in bpy.context.scene.objects:
        ob.location.x += 870.0
        ob.location.y -= 430.0
        ob.location.z += 25.0


@case("Collection instances: nested, offset, with members hidden in the viewport or in renders", bounces=2)
def collection_instances() -> None:
    """The source collections are excluded from the view layer, as it is usual."""
    _studio()
    body = stage.add("Body", stage.monkey("Body", _clay()), (0, 0, 0.7), scale=0.4)
    modifier = body.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels, modifier.render_levels = 0, 2
    hat = stage.add("Hat", stage.cylinder("Hat", _clay("Hat", (0.2, 0.3, 0.6)), radius=0.3, depth=0.2), (0, 0, 1.15))
    hat.hide_viewport = True
    wrong = stage.add("Wrong", stage.cube("Wrong", _clay(), size=0.9), (0, 0, 0.5))
    wrong.hide_render = True
    one = _collection("One", body, hat, wrong)
    one.instance_offset = (0.0, 0.0, 0.1)
    pair = [stage.add(f"Of pair {k}", None, (0.9 * k - 0.45, 0, 0), (0, 0, 0.5 * k)) for k in range(2)]
    for empty in pair:
        empty.instance_type, empty.instance_collection = "COLLECTION", one
    two = _collection("Two", *pair)
    for name in ("One", "Two"):
        bpy.context.view_layer.layer_collection.children[name].exclude = True
    for k in range(3):
        empty = stage.add(f"Pair {k}", None, (1.9 * (k - 1), 0.3 * k - 0.4, 0.05), (0, 0, 0.2 * k), 1.0 - 0.15 * k)
        empty.instance_type, empty.instance_collection = "COLLECTION", two
    hidden = stage.add("Hidden", None, (0, 1.8, 0))
    hidden.instance_type, hidden.instance_collection, hidden.hide_viewport = "COLLECTION", one, True


def _emitter(name: str, x: float, shown: bool, **settings: Any) -> Any:
    """A board with twelve resting particles."""
    ob = stage.add(name, stage.grid(name, _clay(name, (0.6, 0.6, 0.3)), size=1.4, cells=3), (x, 0, 0.25), (0.1, 0, 0))
    ob.modifiers.new("Particles", "PARTICLE_SYSTEM")
    ob.show_instancer_for_render = shown
    particles = ob.particle_systems[0].settings
    particles.count, particles.frame_start, particles.frame_end, particles.lifetime = 12, 1.0, 1.0, 100.0
    particles.normal_factor, particles.physics_type = 0.0, "NO"
    particles.particle_size, particles.size_random, particles.use_rotations = 0.25, 0.4, True
    for key, value in settings.items():
        setattr(particles, key, value)
    return ob


@case("Particles that instance objects and collections; emitters shown and hidden; particles as None", bounces=2)
def particle_instances() -> None:
    """Emitters in a row; what is instanced lies out of sight."""
    _studio()
    bead = stage.add("Bead", stage.sphere("Bead", _clay(), radius=0.6, segments=16), (0, -20, 0))
    chip = stage.add("Chip", stage.cube("Chip", _clay("Chip", (0.2, 0.4, 0.6)), size=0.8), (0, -22, 0))
    _emitter("Objects", -2.1, False, render_type="OBJECT", instance_object=bead)
    _emitter("Collection", -0.4, True, render_type="COLLECTION", instance_collection=_collection("Parts", bead, chip))
    _emitter("Nothing", 1.2, True, render_type="NONE")
    _emitter("Hidden", 2.6, False, render_type="NONE")


@case("Instances on vertices and faces: carriers shown and hidden, in the viewport or in renders", bounces=2)
def instances_on_faces() -> None:
    """Three boards with children."""
    _studio()
    for k, (kind, viewport, render) in enumerate((("VERTS", False, True), ("FACES", True, False),
                                                  ("FACES", False, True))):  # fmt: skip
        board = stage.add(f"Board {k}", stage.grid(f"Board {k}", _clay("Board", (0.6, 0.6, 0.3)), size=1.4, cells=2),
                          (1.9 * (k - 1), 0, 0.4), (0.3, 0.1 * k, 0))  # fmt: skip
        board.instance_type, board.use_instance_faces_scale, board.instance_faces_scale = kind, True, 0.5
        board.show_instancer_for_viewport, board.show_instancer_for_render = viewport, render
        child = stage.add(f"Child {k}", stage.monkey(f"Child {k}", _clay()), scale=0.25)
        child.parent = board
