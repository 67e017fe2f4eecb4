"""Bodies that simulations, old modifiers and untidy modelling make."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np

from .. import stage
from ..case import case
from .habits import checks, small, textured


@case("Ocean with foam, cloth over a ball, soft body, explosion, as the frame leaves them", bounces=3, samples=64)
def simulations() -> None:
    """Frame 12 of an animation that was never baked."""
    small()

    def foam(tree: Any) -> Any:
        read = stage.node(tree, "ShaderNodeAttribute", attribute_name="foam")
        return stage.node(tree, "ShaderNodeBsdfPrincipled", {
            "Base Color": read.outputs[0], "Roughness": 0.1, "IOR": 1.33})  # fmt: skip

    water = stage.add("Water", stage.plane("Water", stage.material("Sea", foam), size=1.0), (-1.2, 0.8, 0.3))
    ocean = water.modifiers.new("Ocean", "OCEAN")
    ocean.resolution, ocean.spatial_size, ocean.size = 4, 10, 0.15
    ocean.use_foam, ocean.foam_layer_name, ocean.time = True, "foam", 2.0
    ball = stage.add("Ball", stage.sphere("Ball", stage.diffuse("Ball", (0.7, 0.2, 0.1)), radius=0.35, segments=24),
                     (1.0, 0.6, 0.4))  # fmt: skip
    ball.modifiers.new("Collision", "COLLISION")
    sheet = stage.grid("Sheet", textured("Sheet", checks("Sheet")), size=1.3, cells=20)
    cloth = stage.add("Sheet", sheet, (1.0, 0.6, 0.85))
    cloth.modifiers.new("Cloth", "CLOTH")
    jelly = stage.add("Jelly", stage.cube("Jelly", stage.principled("Jelly", (0.2, 0.7, 0.3)), size=0.6),
                      (-0.2, -0.8, 0.6), (0.3, 0.4, 0))  # fmt: skip
    jelly.modifiers.new("Soft", "SOFT_BODY")
    burst = stage.add("Burst", stage.sphere("Burst", stage.diffuse("Shell", (0.3, 0.3, 0.8)), radius=0.4, segments=12),
                      (1.2, -0.8, 0.5))  # fmt: skip
    system = burst.modifiers.new("Particles", "PARTICLE_SYSTEM").particle_system
    system.settings.count, system.settings.frame_end = 40, 5
    system.settings.render_type = "NONE"
    burst.modifiers.new("Explode", "EXPLODE")
    for frame in range(1, 13):
        bpy.context.scene.frame_set(frame)


@case("Faces of many corners: concave, bent, flat beside smooth, with UVs, colours and doubled vertices", bounces=2)
def untidy_faces() -> None:
    """A house front of one face, a bowl, a strip of bent quads."""
    small()
    outline = [(0, 0), (1.4, 0), (1.4, 1.2), (1.0, 1.2), (1.0, 0.4), (0.4, 0.4), (0.4, 1.2), (0, 1.2)]
    points = [(x, 0.15 * math.sin(3 * x + y), y) for x, y in outline]
    points += [(x, 0.0, 1.2 + 0.0 * x) for x in (0.0, 0.7, 1.4)] + [(0.7, 0.1, 1.7)]
    faces = [tuple(range(8)), (8, 9, 11), (9, 10, 11)]
    front = stage.mesh("Front", points, faces, textured("Front", checks("Front")))
    layer = front.uv_layers.new(name="UVMap")
    for loop in front.loops:
        x, _, z = points[loop.vertex_index]
        layer.data[loop.index].uv = (x * 0.8, z * 0.6)
    stage.add("Front", front, (-2.0, 0.5, 0.05), (0, 0, 0.3))
    angle = np.linspace(0, 2 * math.pi, 14, endpoint=False)
    fan = [(0.6 * math.cos(a), 0.6 * math.sin(a), 0.25 * math.sin(2 * a)) for a in angle]

    def painted(tree: Any) -> Any:
        read = stage.node(tree, "ShaderNodeVertexColor", layer_name="Paint")
        return stage.node(tree, "ShaderNodeBsdfPrincipled", {"Base Color": read.outputs[0], "Roughness": 0.3})

    for k, smooth in enumerate((False, True)):
        saddle = stage.mesh(f"Saddle {k}", fan, [tuple(range(14))], stage.material(f"Painted {k}", painted))
        saddle.polygons.foreach_set("use_smooth", [smooth])
        color = saddle.color_attributes.new("Paint", "FLOAT_COLOR", "CORNER")
        for j, value in enumerate(color.data):
            value.color = (0.1 + 0.06 * j, 0.6, 0.9 - 0.06 * j, 1.0)
        stage.add(f"Saddle {k}", saddle, (0.3 + 1.3 * k, 0.4, 0.5), (0.5, 0, 0))
    bent = [(0.3 * i, 0.6 * j, 0.25 * ((i * 3 + j * 5) % 4)) for i in range(8) for j in range(2)]
    quads = [(2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1) for i in range(7)]
    strip = stage.mesh("Strip", bent, quads, stage.principled("Strip", (0.8, 0.5, 0.2), Roughness=0.2))
    strip.polygons.foreach_set("use_smooth", [k % 2 == 0 for k in range(7)])
    stage.add("Strip", strip, (-1.0, -1.3, 0.1))


@case("Geometry Nodes that make bodies from nothing: hulls, tubes, volumes to meshes, instances on points", bounces=2)
def node_shapes() -> None:
    """Groups of nodes that make their bodies from nothing."""
    small()
    clay = stage.principled("Clay", (0.7, 0.45, 0.3), Roughness=0.4)

    def body(name: str, place: Any, build: Any) -> None:
        tree = bpy.data.node_groups.new(name, "GeometryNodeTree")
        tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
        end = tree.nodes.new("NodeGroupOutput")
        colored = stage.node(tree, "GeometryNodeSetMaterial", {"Geometry": build(tree), "Material": clay})
        tree.links.new(colored.outputs[0], end.inputs[0])
        mesh = stage.mesh(name, [], [])
        ob = stage.add(name, mesh, place)
        ob.modifiers.new("Nodes", "NODES").node_group = tree

    def hull(tree: Any) -> Any:
        ball = stage.node(tree, "GeometryNodeMeshIcoSphere", {"Radius": 0.5, "Subdivisions": 2})
        return stage.node(tree, "GeometryNodeConvexHull", {0: ball.outputs[0]}).outputs[0]

    def tube(tree: Any) -> Any:
        spiral = stage.node(tree, "GeometryNodeCurveSpiral", {"Rotations": 2.0, "Height": 0.8, "Start Radius": 0.4,
                                                              "End Radius": 0.1})  # fmt: skip
        ring = stage.node(tree, "GeometryNodeCurvePrimitiveCircle", {"Radius": 0.08, "Resolution": 8})
        wide = stage.node(tree, "GeometryNodeCurveToMesh", {"Curve": spiral.outputs[0],
                                                            "Profile Curve": ring.outputs[0]})  # fmt: skip
        return stage.node(tree, "GeometryNodeSetShadeSmooth", {0: wide.outputs[0]}).outputs[0]

    def blob(tree: Any) -> Any:
        cube = stage.node(tree, "GeometryNodeMeshCube", {"Size": (0.6, 0.6, 0.6)})
        fog = stage.node(tree, "GeometryNodeMeshToVolume", {"Mesh": cube.outputs[0], "Voxel Amount": 24.0})
        return stage.node(tree, "GeometryNodeVolumeToMesh", {"Volume": fog.outputs[0]}).outputs[0]

    def many(tree: Any) -> Any:
        cube = stage.node(tree, "GeometryNodeMeshCube", {"Size": (0.2, 0.2, 0.2)})
        line = stage.node(tree, "GeometryNodeMeshLine", {"Count": 4, "Offset": (0.1, 0.05, 0.25)})
        return stage.node(tree, "GeometryNodeInstanceOnPoints", {"Points": line.outputs[0],
                                                                 "Instance": cube.outputs[0]}).outputs[0]  # fmt: skip

    for k, build in enumerate((hull, tube, blob, many)):
        body(build.__name__, (-1.7 + 1.15 * k, 0.0, 0.4), build)


@case("Old particles: halos, lines and paths of emitters, boids, objects along paths, density by a texture", bounces=2)
def old_particles() -> None:
    """Emitters of tutorials before Geometry Nodes."""
    small()
    leaf = stage.add("Leaf", stage.cube("Leaf", stage.diffuse("Leaf", (0.2, 0.6, 0.1)), size=0.15), (9, 9, 9))
    for k, kind in enumerate(("HALO", "LINE", "PATH", "OBJECT")):
        made = stage.diffuse(kind, (0.8, 0.3 + 0.1 * k, 0.2))
        ball = stage.add(kind, stage.sphere(kind, made, radius=0.35, segments=16), (-1.7 + 1.15 * k, 0.2, 0.5))
        settings = ball.modifiers.new("System", "PARTICLE_SYSTEM").particle_system.settings
        settings.count, settings.frame_end, settings.lifetime = 60, 5, 40
        settings.normal_factor, settings.effector_weights.gravity = 1.5, 0.2
        settings.render_type = kind
        if kind == "OBJECT":
            settings.instance_object, settings.particle_size = leaf, 1.0
            settings.use_rotations, settings.rotation_factor_random = True, 0.6
    for frame in range(1, 11):
        bpy.context.scene.frame_set(frame)
