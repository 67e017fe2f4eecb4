"""Bodies that simulations, modifiers and untidy modelling make, and how their mixed data shades them."""

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


def _patched(name: str, material: Any, every: int = 3, segments: int = 10) -> Any:
    """A coarse ball of which every third face is flat."""
    ball = stage.sphere(name, material, radius=0.5, segments=segments)
    for face in ball.polygons:
        face.use_smooth = face.index % every != 0
    return ball


@case("Bodies that are partly flat: glass, metal, bump, normal maps, mirrored and uneven copies", bounces=6, samples=96)
def partly_flat() -> None:
    """Faces that someone set to Shade Flat."""
    small()

    def bumped(tree: Any) -> Any:
        noise = stage.node(tree, "ShaderNodeTexNoise", {"Scale": 8.0})
        bump = stage.node(tree, "ShaderNodeBump", {"Height": noise.outputs[0], "Distance": 0.1})
        return stage.node(tree, "ShaderNodeBsdfPrincipled", {"Normal": bump, "Roughness": 0.3})

    def mapped(tree: Any) -> Any:
        place = stage.node(tree, "ShaderNodeTexCoord").outputs["UV"]
        wave = stage.node(tree, "ShaderNodeTexWave", {"Vector": place, "Scale": 3.0})
        color = stage.node(tree, "ShaderNodeCombineColor", {0: wave.outputs[1], 1: 0.5, 2: 0.9})
        normal = stage.node(tree, "ShaderNodeNormalMap", {"Color": color, "Strength": 0.7})
        return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Normal": normal, "Color": (0.2, 0.5, 0.7)})

    def shown(tree: Any) -> Any:
        return stage.node(tree, "ShaderNodeEmission", {
            "Color": stage.node(tree, "ShaderNodeTexCoord").outputs["Normal"], "Strength": 0.5})  # fmt: skip

    made = [stage.simple("Glass", "ShaderNodeBsdfGlass", {"Roughness": 0.0, "IOR": 1.3}),
            stage.principled("Metal", (0.8, 0.6, 0.3), Metallic=1.0, Roughness=0.2),
            *(stage.material(one.__name__, one) for one in (bumped, mapped, shown))]  # fmt: skip
    for k, one in enumerate(made):
        stage.add(one.name, _patched(one.name, one), (-1.9 + 0.95 * k, 0.6, 0.5), (0.2, 0.1, 0.3 * k), 0.85)
    again = _patched("Again", stage.principled("Clay", (0.7, 0.3, 0.2), Roughness=0.5))
    for k, scale in enumerate(((0.6, 0.6, 0.6), (-0.6, 0.6, 0.6), (0.4, 0.9, 0.6))):
        stage.add(f"Again {k}", again, (-1.3 + 1.2 * k, -0.6, 0.45), (0.2, 0.1, 0.4), scale)
    sharp = _patched("Sharp", made[1])
    for edge in sharp.edges:
        edge.use_edge_sharp = edge.index % 7 == 0
    stage.add("Sharp", sharp, (2.1, -0.5, 0.45), (0.2, 0.1, 0.4), 0.8)


@case("Faces that are turned inside out here and there, doubled faces, slivers, corners of two materials", bounces=4)
def turned_faces() -> None:
    """Meshes that were knitted together by hand."""
    small()
    paint = [stage.principled("Paint", (0.7, 0.2, 0.1), Roughness=0.3), stage.diffuse("Other", (0.2, 0.4, 0.7)),
             stage.simple("Glass", "ShaderNodeBsdfGlass", {"Roughness": 0.0, "IOR": 1.2})]  # fmt: skip
    for k, smooth in enumerate((False, True, True)):
        ball = stage.sphere(f"Turned {k}", paint[2 if k == 2 else 0], paint[1], radius=0.5, segments=14, smooth=smooth)
        for face in ball.polygons:
            if face.index % 5 == 0:
                face.flip()
            face.material_index = int(face.index % 4 == 0 and k != 2)
        ball.update()
        stage.add(f"Turned {k}", ball, (-1.4 + 1.3 * k, 0.5, 0.5))
    points: list[tuple[float, float, float]] = []
    faces: list[tuple[int, ...]] = []
    for j in range(6):
        for i in range(6):
            points.append((0.25 * i + 0.12 * (j % 2), 0.25 * j, 0.2 * math.sin(i + 0.7 * j)))
    for j in range(5):
        for i in range(5):
            a = 6 * j + i
            faces.append((a, a + 1, a + 7, a + 6))
    points += [(1.5, 0.3, 0.3), (1.5, 0.3001, 0.3), (1.9, 0.3, 0.6)]
    faces += [(36, 37, 38), (36, 38, 37)]
    cloth = stage.mesh("Cloth", points, faces, paint[0], paint[1])
    cloth.polygons.foreach_set("use_smooth", [True] * len(faces))
    for face in cloth.polygons:
        face.material_index = face.index % 2
    stage.add("Cloth", cloth, (-0.9, -1.4, 0.3))


@case("Attributes of all domains and types as colours, and layers whose names clash", bounces=2)
def attribute_domains() -> None:
    """What geometry nodes, importers and sculpting leave on a mesh."""
    small()

    def by(name: str, output: str) -> Any:
        def shader(tree: Any) -> Any:
            read = stage.node(tree, "ShaderNodeAttribute", attribute_name=name)
            return stage.node(tree, "ShaderNodeEmission", {"Color": read.outputs[output], "Strength": 0.6})

        return stage.material(f"{name} {output}", shader)

    kinds = (
        ("FLOAT", "FACE", "Fac"),
        ("INT", "POINT", "Fac"),
        ("BOOLEAN", "FACE", "Fac"),
        ("FLOAT2", "CORNER", "Vector"),
        ("FLOAT_VECTOR", "FACE", "Color"),
        ("FLOAT", "EDGE", "Fac"),
        ("INT8", "FACE", "Fac"),
        ("BYTE_COLOR", "POINT", "Alpha"),
        ("FLOAT_COLOR", "FACE", "Color"),
        ("INT", "CORNER", "Color"),
    )
    generator = np.random.default_rng(5)
    for k, (kind, domain, output) in enumerate(kinds):
        name = f"{kind} {domain}"
        grid = stage.grid(name, by(name, output), size=0.85, cells=3)
        layer = grid.attributes.new(name, kind, domain)
        for value in layer.data:
            drawn = generator.uniform(0.1, 0.9, 4)
            if kind in ("FLOAT", "INT", "INT8", "BOOLEAN"):
                value.value = {"FLOAT": float(drawn[0]), "BOOLEAN": bool(drawn[0] > 0.5)}.get(kind, int(3 * drawn[0]))
            elif "COLOR" in kind:
                value.color = drawn
            else:
                value.vector = drawn[: len(value.vector)]
        stage.add(name, grid, (-1.9 + 0.95 * (k % 5), 1.0 * (k // 5) - 0.5, 0.05), (0.3, 0, 0))


@case("Normals by modifiers: Normal Edit, Bevel with hardened normals, Edge Split, Data Transfer, Mirror, Triangulate",
      bounces=3, samples=64)  # fmt: skip
def normal_modifiers() -> None:
    """Game assets and hard surfaces."""
    small()
    metal = stage.principled("Metal", (0.7, 0.7, 0.75), Metallic=1.0, Roughness=0.25)
    leaf = stage.principled("Leaf", (0.2, 0.6, 0.2), Roughness=0.6)
    source = stage.add("Source", stage.sphere("Source", metal, radius=0.6, segments=24), (9, 9, 9))

    def body(name: str, place: Any, mesh: Any, kind: str, **settings: Any) -> None:
        ob = stage.add(name, mesh, place, (0.1, 0.2, 0.4))
        modifier = ob.modifiers.new(kind, kind)
        for key, value in settings.items():
            setattr(modifier, key, value)

    def smooth_cube(name: str) -> Any:
        made = stage.cube(name, metal, size=0.75)
        made.polygons.foreach_set("use_smooth", [True] * len(made.polygons))
        return made

    body("Edit", (-1.8, 0.6, 0.5), stage.grid("Edit", leaf, size=0.9, cells=4), "NORMAL_EDIT", mode="RADIAL",
         offset=(0.0, 0.0, -0.5))  # fmt: skip
    body("Bevel", (-0.6, 0.6, 0.5), smooth_cube("Bevel"), "BEVEL", width=0.1, segments=2, harden_normals=True)
    body("Split", (0.6, 0.6, 0.5), stage.cylinder("Split", metal, radius=0.4, depth=0.8, segments=9), "EDGE_SPLIT",
         split_angle=0.6)  # fmt: skip
    body("Transfer", (1.8, 0.6, 0.5), smooth_cube("Transfer"), "DATA_TRANSFER", object=source, use_loop_data=True,
         data_types_loops={"CUSTOM_NORMAL"}, loop_mapping="POLYINTERP_NEAREST")  # fmt: skip
    body("Triangles", (-1.2, -0.7, 0.5), _patched("Triangles", leaf), "TRIANGULATE", keep_custom_normals=True)
    body("Mirror", (0.0, -0.7, 0.5), _patched("Mirror", leaf, segments=8), "MIRROR", use_axis=(True, False, False),
         use_bisect_axis=(True, False, False))  # fmt: skip
    body("Subdivided", (1.3, -0.7, 0.5), _patched("Subdivided", metal, segments=6), "SUBSURF", render_levels=1)
