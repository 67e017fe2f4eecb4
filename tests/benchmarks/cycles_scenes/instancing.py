"""Instances: by collections, particles, vertices, faces and geometry nodes, and from linked libraries."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import bpy

from . import stage
from .case import case
from .evaluation import clay, collection, studio


@case("Collection instances: nested, offset, with members hidden in the viewport or in renders", bounces=2)
def collection_instances() -> None:
    """The source collections are excluded from the view layer, as it is usual."""
    studio()
    body = stage.add("Body", stage.monkey("Body", clay()), (0, 0, 0.7), scale=0.4)
    modifier = body.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels, modifier.render_levels = 0, 2
    hat = stage.add("Hat", stage.cylinder("Hat", clay("Hat", (0.2, 0.3, 0.6)), radius=0.3, depth=0.2), (0, 0, 1.15))
    hat.hide_viewport = True
    wrong = stage.add("Wrong", stage.cube("Wrong", clay(), size=0.9), (0, 0, 0.5))
    wrong.hide_render = True
    one = collection("One", body, hat, wrong)
    one.instance_offset = (0.0, 0.0, 0.1)
    pair = [stage.add(f"Of pair {k}", None, (0.9 * k - 0.45, 0, 0), (0, 0, 0.5 * k)) for k in range(2)]
    for empty in pair:
        empty.instance_type, empty.instance_collection = "COLLECTION", one
    two = collection("Two", *pair)
    for name in ("One", "Two"):
        bpy.context.view_layer.layer_collection.children[name].exclude = True
    for k in range(3):
        empty = stage.add(f"Pair {k}", None, (1.9 * (k - 1), 0.3 * k - 0.4, 0.05), (0, 0, 0.2 * k), 1.0 - 0.15 * k)
        empty.instance_type, empty.instance_collection = "COLLECTION", two
    hidden = stage.add("Hidden", None, (0, 1.8, 0))
    hidden.instance_type, hidden.instance_collection, hidden.hide_viewport = "COLLECTION", one, True


def _emitter(name: str, x: float, shown: bool, **settings: Any) -> Any:
    """A board with twelve resting particles."""
    ob = stage.add(name, stage.grid(name, clay(name, (0.6, 0.6, 0.3)), size=1.4, cells=3), (x, 0, 0.25), (0.1, 0, 0))
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
    studio()
    bead = stage.add("Bead", stage.sphere("Bead", clay(), radius=0.6, segments=16), (0, -20, 0))
    chip = stage.add("Chip", stage.cube("Chip", clay("Chip", (0.2, 0.4, 0.6)), size=0.8), (0, -22, 0))
    _emitter("Objects", -2.1, False, render_type="OBJECT", instance_object=bead)
    _emitter("Collection", -0.4, True, render_type="COLLECTION", instance_collection=collection("Parts", bead, chip))
    _emitter("Nothing", 1.2, True, render_type="NONE")
    _emitter("Hidden", 2.6, False, render_type="NONE")


@case("Instances on vertices and faces: carriers shown and hidden, in the viewport or in renders", bounces=2)
def instances_on_faces() -> None:
    """Three boards with children."""
    studio()
    for k, (kind, viewport, render) in enumerate((("VERTS", False, True), ("FACES", True, False),
                                                  ("FACES", False, True))):  # fmt: skip
        board = stage.add(f"Board {k}", stage.grid(f"Board {k}", clay("Board", (0.6, 0.6, 0.3)), size=1.4, cells=2),
                          (1.9 * (k - 1), 0, 0.4), (0.3, 0.1 * k, 0))  # fmt: skip
        board.instance_type, board.use_instance_faces_scale, board.instance_faces_scale = kind, True, 0.5
        board.show_instancer_for_viewport, board.show_instancer_for_render = viewport, render
        child = stage.add(f"Child {k}", stage.monkey(f"Child {k}", clay()), scale=0.25)
        child.parent = board


@case("Coordinates of the instancer (From Instancer), on vertices, faces, particles and in a collection", bounces=2)
def instancer_coordinates() -> None:
    """Each instance has one colour; what is no instance has the coordinate 0."""
    studio()

    def at(node: str, output: str) -> Any:
        def shader(tree: Any) -> Any:
            place = stage.node(tree, node, from_instancer=True).outputs[output]
            color = stage.node(tree, "ShaderNodeVectorMath", {0: place, 1: (0.6, 0.5, 0.4), 2: (0.5, 0.3, 0.2)},
                               operation="MULTIPLY_ADD")  # fmt: skip
            return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": color})

        return stage.material(f"{node} {output}", shader)

    generated = at("ShaderNodeTexCoord", "Generated")
    ways = (("VERTS", generated), ("FACES", at("ShaderNodeTexCoord", "UV")), ("FACES", at("ShaderNodeUVMap", "UV")))
    for k, (kind, material) in enumerate(ways):
        board = stage.add(f"Board {k}", stage.grid(f"Board {k}", material, size=1.4, cells=3),
                          (1.9 * k - 1.9, -0.4, 0.3))  # fmt: skip
        board.instance_type = kind
        child = stage.add(f"Child {k}", stage.cube(f"Child {k}", material, size=0.25))
        child.parent = board
    bead = stage.add("Bead", stage.cube("Bead", generated, size=0.8), (0, -20, 0))
    _emitter("Particles", -1.0, True, render_type="OBJECT", instance_object=bead).location.y = 1.6
    parts = collection("Parts", stage.add("Part", stage.cube("Part", generated, size=0.7)))
    place = stage.add("Place", None, (1.2, 1.6, 0.4), (0, 0, 0.4))
    place.instance_type, place.instance_collection = "COLLECTION", parts


def _nodes(ob: Any, name: str) -> Any:
    """A geometry-nodes modifier of the object; returns its tree, which has an input and an output node."""
    tree = bpy.data.node_groups.new(name, "GeometryNodeTree")
    for kind in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=kind, socket_type="NodeSocketGeometry")
        stage.node(tree, f"NodeGroup{kind.title()}")
    ob.modifiers.new(name, "NODES").node_group = tree
    return tree


@case("Geometry nodes: instances of objects and of collections on points, not realised, beside the mesh", bounces=2)
def nodes_instances() -> None:
    """Beads on a board and, beside it, parts on a board that is not shown itself."""
    studio()
    bead = stage.add("Bead", stage.sphere("Bead", clay(), radius=0.15, segments=16), (0, -20, 0))
    chip = stage.add("Chip", stage.cube("Chip", clay("Chip", (0.2, 0.4, 0.6)), size=0.25), (0, -22, 0))
    divide = chip.modifiers.new("Subdivision", "SUBSURF")
    divide.levels, divide.render_levels = 0, 2
    parts = collection("Parts", bead, chip)
    for k, kept in enumerate((True, False)):
        ob = stage.add(f"Board {k}", stage.grid(f"Board {k}", clay("Board", (0.6, 0.6, 0.3)), size=1.8, cells=3),
                       (2.2 * k - 1.1, 0, 0.3), (0.2, 0, 0.3 * k))  # fmt: skip
        tree = _nodes(ob, f"Scatter {k}")
        start, end = tree.nodes["Group Input"], tree.nodes["Group Output"]
        if kept:
            source = stage.node(tree, "GeometryNodeObjectInfo", {"Object": bead, "As Instance": True})
        else:
            source = stage.node(tree, "GeometryNodeCollectionInfo", {"Collection": parts, "Separate Children": True,
                                                                     "Reset Children": True})  # fmt: skip
        points = stage.node(tree, "GeometryNodeInstanceOnPoints", {
            "Points": start, "Instance": next(x for x in source.outputs if x.type == "GEOMETRY"),
            "Pick Instance": not kept, "Rotation": (0.0, 0.0, 0.6)})  # fmt: skip
        join = stage.node(tree, "GeometryNodeJoinGeometry", {"Geometry": points})
        if kept:
            tree.links.new(start.outputs[0], join.inputs[0])
        tree.links.new(join.outputs[0], end.inputs[0])


@case("A linked library: an instanced collection and an overridden one", bounces=2)
def linked_library() -> None:
    """The library is packed into the file."""
    studio()
    body = stage.add("Body", stage.monkey("Body", clay("Painted", (0.2, 0.5, 0.3))), (0, 0, 0.7), scale=0.6)
    modifier = body.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels, modifier.render_levels = 0, 2
    made = collection("Asset", body, stage.add("Base", stage.cylinder("Base", clay("Grey", (0.4,) * 3), depth=0.3),
                                               (0, 0, 0.15), scale=0.6))  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "library.blend")
        bpy.data.libraries.write(path, {made})
        for ob in list(made.objects):
            bpy.data.objects.remove(ob)
        bpy.data.collections.remove(made)
        bpy.data.orphans_purge(do_recursive=True)
        with bpy.data.libraries.load(path, link=True) as (_, linked):
            linked.collections = ["Asset"]
        (asset,) = linked.collections
        place = stage.add("Place", None, (-1.1, 0, 0), (0, 0, 0.4))
        place.instance_type, place.instance_collection = "COLLECTION", asset
        scene = bpy.context.scene
        own = asset.override_hierarchy_create(scene, bpy.context.view_layer)
        for ob in own.objects:
            ob.location.x += 1.1
        # Only libraries with relative paths can be packed.
        bpy.ops.wm.save_as_mainfile(filepath=str(Path(folder) / "scene.blend"))
        bpy.ops.file.make_paths_relative()
        bpy.ops.file.pack_libraries()
