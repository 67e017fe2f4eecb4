"""Export of shading normals, attributes, instances and the camera's settings beyond its projection."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import edgegrad
from edgegrad import _native

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

from edgegrad_addon.export.geometry import attributes
from edgegrad_addon.export.geometry.mesh import read_mesh, triangle_corners
from edgegrad_addon.export.geometry.normals import corner_normals
from edgegrad_addon.export.geometry.splits import SPLITS
from edgegrad_addon.look.derivative import derivative_of_names
from edgegrad_addon.look.plan import planned
from edgegrad_addon.parameters import Names
from edgegrad_addon.session import Picture, Request, Session
from tests.support.scenes import blender_scenes as bs

pytestmark = pytest.mark.usefixtures("lit_scene")


def exported(name: Any = "Thing") -> Any:
    made = bs.export()
    made.scene.validate()
    return made.scene.meshes[name]


def smooth(data: Any, sharp: Any = ()) -> Any:
    data.shade_smooth()
    for edge in sharp:
        data.edges[edge].use_edge_sharp = True
    return data


def normals_of(mesh: Any) -> Any:
    """(m, 3, 3) shading normals at the corners, as they are rendered."""
    corner = mesh.vertices[mesh.faces]
    flat = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    out = np.repeat(flat[:, None], 3, axis=1)
    if mesh.smoothing is not None:
        normals = mesh.normals
        if normals is None:
            normals = _native.angle_weighted_normals(mesh.vertices, mesh.faces, mesh.smoothing,
                                                     mesh.smoothing.max() + 1)  # fmt: skip
        out[mesh.smoothing >= 0] = normals[mesh.smoothing[mesh.smoothing >= 0]]
    return out


def blenders_normals(ob: Any) -> Any:
    """The same as Blender has them, in the world."""
    data = ob.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    found = corner_normals(data)[read_mesh(data).corners] @ np.linalg.inv(np.array(ob.matrix_world)[:3, :3])
    return found / np.linalg.norm(found, axis=2, keepdims=True)


def test_flat_smooth_and_sharp() -> None:
    ob = bs.add("Thing", bs.cube("Thing"))
    ob.data.shade_flat()
    assert exported().smoothing is None
    smooth(ob.data)
    mesh = exported()
    assert mesh.normals is None and len(np.unique(mesh.smoothing)) == 8
    for edge in ob.data.edges:
        edge.use_edge_sharp = edge.index < 4
    mesh = exported()
    assert len(np.unique(mesh.smoothing)) > 8
    assert normals_of(mesh) == pytest.approx(blenders_normals(ob), abs=3e-3)
    ob.data.polygons[0].use_smooth = False
    mesh = exported()
    assert (mesh.smoothing[:2] == -1).all() and (mesh.smoothing[2:] >= 0).all()


@pytest.mark.parametrize("sharp", [False, True])
def test_flat_faces_beside_smooth_ones_shade_as_in_cycles(sharp: bool) -> None:
    """Without sharp edges, flat faces bend the normals of their vertices; else bent flat faces have one normal."""
    data = smooth(bs.cube("Thing"))
    generator = np.random.default_rng(1)
    for vertex in data.vertices:
        vertex.co += type(vertex.co)(generator.normal(0, 0.2, 3))
    data.polygons[0].use_smooth = False
    for edge in data.edges:
        edge.use_edge_sharp = sharp and edge.index < 2
    ob = bs.add("Thing", data)
    mesh = exported()
    if sharp:
        assert normals_of(mesh) == pytest.approx(blenders_normals(ob), abs=3e-3)
        return
    assert (mesh.smoothing[:2] == -1).all()
    of_vertex = np.array([vertex.normal for vertex in ob.data.vertices])
    assert normals_of(mesh)[2:] == pytest.approx(of_vertex[mesh.faces[2:]], abs=3e-3)


@pytest.mark.parametrize("scale", [(1, 1, 1), (1, -2, 0.5), (3, 3, 3)])
def test_normals_of_curved_and_stretched_meshes(scale: Any) -> None:
    data = bs.cube("Thing")
    generator = np.random.default_rng(1)
    for vertex in data.vertices:  # quads that aren't flat
        vertex.co += type(vertex.co)(generator.normal(0, 0.2, 3))
    ob = bs.add("Thing", smooth(data), (1, 2, 3), (0.3, 0.4, 0.5), scale)
    mesh = exported()
    wanted = blenders_normals(ob)
    if np.prod(scale) < 0:  # the front stays outside
        wanted = wanted[:, ::-1]
    assert normals_of(mesh) == pytest.approx(wanted, abs=3e-3)
    center = mesh.vertices.mean(axis=0)
    corner = mesh.vertices[mesh.faces]
    outwards = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    assert ((corner.mean(axis=1) - center) * outwards).sum(axis=1).min() > 0.0


@pytest.mark.parametrize("domain", ["POINT", "FACE", "CORNER"])
def test_free_normals(domain: str) -> None:
    """As in Cycles: those of faces are averaged at the vertices, and only those of corners override flat faces."""
    data = smooth(bs.cube("Thing"))
    bs.add("Thing", data)
    data.polygons[0].use_smooth = False
    free = data.attributes.new("custom_normal", "FLOAT_VECTOR", domain)
    free.data.foreach_set("vector", np.tile(np.float32([0.0, 0.6, 0.8]), len(free.data)))
    mesh = exported()
    is_flat = (mesh.smoothing < 0).all(axis=1)
    assert is_flat.sum() == (0 if domain == "CORNER" else 2)
    assert normals_of(mesh)[~is_flat] == pytest.approx(np.tile([0.0, 0.6, 0.8], ((~is_flat).sum(), 3, 1)), abs=1e-4)


@pytest.mark.skipif(not SPLITS, reason="Cycles has normals of corners from Blender 5.1 on")
def test_free_normals_of_corners_are_shared_unless_edges_are_sharp() -> None:
    data = smooth(bs.cube("Thing"))
    bs.add("Thing", data)
    free = data.attributes.new("custom_normal", "FLOAT_VECTOR", "CORNER")
    own = np.random.default_rng(1).normal(size=(24, 3)).astype(np.float32)
    free.data.foreach_set("vector", own.ravel())
    assert len(np.unique(normals_of(exported()).reshape(-1, 3).round(3), axis=0)) == 8
    data.polygons[0].use_smooth = False  # its corners part from the others
    assert len(np.unique(normals_of(exported()).reshape(-1, 3).round(3), axis=0)) == 12


def test_custom_normals() -> None:
    ob = bs.add("Thing", smooth(bs.cube("Thing")))
    ob.data.normals_split_custom_set_from_vertices([(0.6, 0.0, 0.8)] * 8)
    mesh = exported()
    assert mesh.normals is not None
    assert normals_of(mesh) == pytest.approx(np.broadcast_to([0.6, 0.0, 0.8], (12, 3, 3)), abs=2e-3)


@pytest.mark.parametrize("domain", ["POINT", "CORNER"])
@pytest.mark.parametrize("kind", ["FLOAT_COLOR", "BYTE_COLOR"])
def test_color_attributes(domain: Any, kind: Any) -> None:
    made = bs.material("M")
    node = made.node_tree.nodes.new("ShaderNodeVertexColor")
    node.layer_name = "Paint"
    made.node_tree.links.new(node.outputs["Color"], bs.shader(made).inputs["Color"])
    ob = bs.add("Thing", bs.cube("Thing", made))
    layer = ob.data.color_attributes.new("Paint", kind, domain)
    values = np.random.default_rng(2).uniform(0, 1, (len(layer.data), 4)).astype(np.float32)
    layer.data.foreach_set("color", values.ravel())
    mesh = exported()
    arrays = read_mesh(ob.data)
    wanted = values[arrays.faces if domain == "POINT" else arrays.corners]
    assert mesh.attributes["Paint"] == pytest.approx(wanted, abs=1e-6 if kind == "FLOAT_COLOR" else 5e-3)
    assert list(mesh.attributes) == ["Paint"]  # attributes that no material reads are not exported


def test_attributes_of_edges_are_means_at_vertices() -> None:
    made = bs.material("M")
    node = made.node_tree.nodes.new("ShaderNodeAttribute")
    node.attribute_name = "Wear"
    made.node_tree.links.new(node.outputs["Fac"], bs.shader(made).inputs["Color"])
    ob = bs.add("Thing", bs.cube("Thing", made))
    values = np.random.default_rng(2).uniform(0, 1, len(ob.data.edges)).astype(np.float32)
    ob.data.attributes.new("Wear", "FLOAT", "EDGE").data.foreach_set("value", values)
    mesh = exported()
    ends = np.array([tuple(edge.vertices) for edge in ob.data.edges])
    wanted = np.array([values[(ends == vertex).any(axis=1)].mean() for vertex in range(8)])
    assert mesh.attributes["Wear"][..., 0] == pytest.approx(wanted[read_mesh(ob.data).faces], abs=1e-6)


@pytest.mark.parametrize("apart", [False, True])
def test_corners_of_triangles_are_blenders(apart: bool) -> None:
    """Of polygons of any size, and also where the addresses of triangles are not those of one array."""
    data = bs.mesh("Thing", [(np.cos(k), np.sin(k), 0.0) for k in range(6)] + [(0.0, 0.0, 1.0)],
                   [(0, 1, 2, 3, 4, 5), (0, 1, 6), (2, 3, 4, 6)])  # fmt: skip
    data.calc_loop_triangles()
    triangles: Any = data.loop_triangles
    wanted = [tuple(one.loops) for one in triangles]
    if apart:

        class Apart(list[Any]):
            def foreach_get(self, name: str, out: Any) -> None:
                data.loop_triangles.foreach_get(name, out)

        triangles = Apart(triangles[k] for k in (1, 0, *range(2, len(wanted))))
    assert len(wanted) == 7 and [tuple(one) for one in triangle_corners(triangles).tolist()] == wanted


def test_corners_of_no_triangles() -> None:
    data = bs.mesh("Thing", [(0.0, 0.0, 0.0)], [])
    data.calc_loop_triangles()
    assert triangle_corners(data.loop_triangles).shape == (0, 3)


def test_generated_and_object_coordinates() -> None:
    made = bs.material("M")
    node = made.node_tree.nodes.new("ShaderNodeTexCoord")
    mix = made.node_tree.nodes.new("ShaderNodeVectorMath")
    made.node_tree.links.new(node.outputs["Generated"], mix.inputs[0])
    made.node_tree.links.new(node.outputs["Object"], mix.inputs[1])
    made.node_tree.links.new(mix.outputs[0], bs.shader(made).inputs["Color"])
    bs.add("Thing", bs.cube("Thing", made), (5, 6, 7))
    mesh = exported()
    local = mesh.vertices[mesh.faces] - (5, 6, 7)
    assert mesh.attributes[attributes.OBJECT] == pytest.approx(local, abs=1e-6)
    assert mesh.attributes[attributes.GENERATED] == pytest.approx(0.5 + 0.5 * local, abs=1e-6)


def test_tangents_follow_u() -> None:
    """On a plane whose UV map is turned by 30 degrees and mirrored."""
    data = bs.plane("Thing", 2.0)
    layer = data.uv_layers.new(name="UVMap")
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    arrays = read_mesh(data)
    for loop in data.loops:
        x, y, _ = data.vertices[loop.vertex_index].co
        layer.uv[loop.index].vector = (c * x + s * y, s * x - c * y)
    uv = np.empty((4, 2), np.float32)
    layer.uv.foreach_get("vector", uv.ravel())
    found = attributes.tangents(arrays, uv[arrays.corners])
    assert found == pytest.approx(np.broadcast_to([c, s, 0.0, -1.0], (2, 3, 4)), abs=1e-6)


@pytest.mark.parametrize("collapsed", [False, True])
@pytest.mark.parametrize("smooth", [True, False])
def test_tangents_are_those_of_blender(smooth: bool, collapsed: bool) -> None:
    """On a wavy surface whose UV map is sheared, mirrored at a line of vertices, and squeezed to lines."""
    x, y = np.meshgrid(np.linspace(-1.0, 1.0, 9), np.linspace(-1.0, 1.0, 7), indexing="ij")
    points = np.stack([x, y, 0.2 * np.sin(3.0 * x + y) * np.cos(4.0 * y)], axis=-1).reshape(-1, 3)
    quads = (np.arange(8)[:, None] * 7 + np.arange(6)).reshape(-1, 1) + (0, 7, 8, 1)
    data = bs.mesh("Thing", points, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]))
    (data.shade_smooth if smooth else data.shade_flat)()
    layer = data.uv_layers.new(name="UVMap")
    for loop in data.loops:
        x, y, _ = data.vertices[loop.vertex_index].co
        layer.uv[loop.index].vector = (max(abs(x), 0.3) + 0.3 * y, y) if collapsed else (abs(x) + 0.3 * y, y)
    arrays = read_mesh(data)
    uv, own = np.empty((len(data.loops), 2), np.float32), np.empty((len(data.loops), 4), np.float32)
    layer.uv.foreach_get("vector", uv.ravel())
    data.calc_tangents(uvmap="UVMap")
    for loop, row in zip(data.loops, own, strict=True):
        row[:] = (*loop.tangent, loop.bitangent_sign)
    assert set(own[:, 3]) == {-1.0, 1.0}
    assert attributes.tangents(arrays, uv[arrays.corners]) == pytest.approx(own[arrays.corners], abs=1e-5)


def test_linked_duplicates_become_instances_unless_they_look_different() -> None:
    data = bs.cube("Thing", bs.material("A"))
    for k in range(4):
        bs.add(f"Copy {k}", data, (3 * k, 0, 0))
    bpy.data.objects["Copy 1"].visible_camera = False
    other = bpy.data.objects["Copy 2"]
    other.material_slots[0].link = "OBJECT"
    other.material_slots[0].material = bs.material("B")
    meshes = bs.export().scene.meshes
    assert {name: None if m.instances is None else len(m.instances) for name, m in meshes.items()} == {
        "Copy 0": 2, "Copy 1": None, "Copy 2": None}  # fmt: skip
    assert "camera" not in meshes["Copy 1"].visible_to and meshes["Copy 2"].materials == ("B",)


def test_terminator_offset_and_holdouts() -> None:
    ob = bs.add("Thing", bs.cube("Thing"))
    owner = ob if hasattr(ob, "shadow_terminator_geometry_offset") else ob.cycles
    owner.shadow_terminator_geometry_offset = 0.3
    bs.offset_shading(ob, 0.6)
    ob.is_holdout = True
    made = bs.export()
    assert made.scene.meshes["Thing"].terminator_offset == pytest.approx(0.3)
    assert made.scene.meshes["Thing"].terminator_shading == pytest.approx(0.6)
    assert any("holdout" in line for line in made.report.lines)


def test_depth_of_field() -> None:
    ob = bpy.context.scene.camera
    target = bs.add("Target", None, (1.0, 0.0, 2.0))
    dof = ob.data.dof
    ob.data.lens, dof.use_dof, dof.aperture_fstop, dof.focus_object = 50.0, True, 2.0, target
    dof.aperture_blades, dof.aperture_rotation, dof.aperture_ratio = 5, 0.3, 2.0
    camera = bs.export().scene.camera
    assert (camera.aperture_radius, camera.focus_distance) == pytest.approx((0.0125, 3.0))
    assert (camera.aperture_blades, camera.aperture_rotation, camera.aperture_ratio) == pytest.approx((5, 0.3, 2.0))
    dof.focus_object, dof.focus_distance, ob.data.type = None, 7.0, "ORTHO"
    camera = bs.export().scene.camera
    assert (camera.aperture_radius, camera.focus_distance) == pytest.approx((0.25, 7.0))


def test_orthographic_and_pixel_aspect() -> None:
    scene, lens = bpy.context.scene, bpy.context.scene.camera.data
    scene.render.resolution_x, scene.render.resolution_y = 40, 30
    scene.render.pixel_aspect_y = 2.0
    lens.type, lens.ortho_scale = "ORTHO", 6.0
    camera = bs.export().scene.camera
    # 30 rows of twice the width make the picture higher than wide.
    assert (camera.kind, camera.pixel_aspect) == ("ORTHOGRAPHIC", 2.0)
    assert camera.ortho_width == pytest.approx(6.0 * 40 / 60)


def test_panorama_region_and_filter() -> None:
    scene, lens = bpy.context.scene, bpy.context.scene.camera.data
    lens.type = "PANO"
    panorama = lens if hasattr(lens, "panorama_type") else lens.cycles
    panorama.panorama_type = "EQUIRECTANGULAR"
    panorama.longitude_min, panorama.latitude_max = -1.0, 0.5
    scene.render.use_border = scene.render.use_crop_to_border = True
    scene.render.border_min_x, scene.render.border_max_x = 0.25, 0.75
    scene.render.border_min_y, scene.render.border_max_y = 0.5, 1.0
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BLACKMAN_HARRIS", 1.5
    made = bs.export()
    camera = made.scene.camera
    assert camera.kind == "EQUIRECTANGULAR"
    assert camera.longitude == pytest.approx([-1.0, np.pi]) and camera.latitude == pytest.approx([-np.pi / 2, 0.5])
    assert camera.crop == (8, 0, 24, 16)
    assert (camera.filter, camera.filter_width) == ("BLACKMAN_HARRIS", 3.0)  # Cycles' window is twice as wide
    assert made.report.lines == []


def test_light_path_limits() -> None:
    cycles = bpy.context.scene.cycles
    cycles.max_bounces, cycles.diffuse_bounces, cycles.glossy_bounces = 7, 1, 2
    cycles.transmission_bounces, cycles.transparent_max_bounces, cycles.sample_clamp_indirect = 3, 4, 10.0
    made = bs.export()
    bounces = made.settings.bounces
    assert made.settings.max_depth == 9
    assert (bounces.diffuse, bounces.glossy, bounces.transmission, bounces.transparent) == (1, 2, 3, 4)
    assert any("clamps it to 10" in line for line in made.report.readings)


def test_emissive_meshes_with_normal_maps_under_uneven_scale_are_told() -> None:
    bs.empty()
    bs.camera()
    made = bs.normal_mapped(1.0, "ShaderNodeBsdfPrincipled", **{"Emission Strength": 1.0})
    bs.shader(made).inputs["Emission Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    ob = bs.add("Cube", bs.cube("Cube", made), scale=(1.0, 2.0, 1.0))
    ob.data.uv_layers.new()
    bpy.context.view_layer.update()
    assert any("apply its scale" in line for line in bs.export().report.lines)
    ob.scale = (2.0, 2.0, 2.0)
    bpy.context.view_layer.update()
    assert not any("apply its scale" in line for line in bs.export().report.lines)


def bumpy_quads(size: int = 40) -> tuple[Any, Any, Any]:
    """A smooth sheet of quads that are not planar, wider than the view, its object and the places of its vertices."""
    x, y = (a.ravel() for a in np.meshgrid(*2 * [np.linspace(-3.0, 3.0, size)], indexing="ij"))
    points = np.stack([x, y, 0.3 * np.sin(2.0 * x + 1.0) * np.cos(1.5 * y)], axis=1)
    at = np.arange(size * size).reshape(size, size)
    quads = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], axis=-1).reshape(-1, 4)
    data = smooth(bs.mesh("Thing", points.tolist(), quads.tolist(), bs.material("Clay")))
    return bs.add("Thing", data), data, points


def test_smooth_normals_of_quads_follow_vertices_that_are_fitted(tmp_path: Path) -> None:
    _, data, points = bumpy_quads()
    assert exported().normals is not None  # Blender's normals are not those of the triangles
    target = str(tmp_path / "target.exr")
    edgegrad.images.write_image(target, np.full((bpy.context.scene.render.resolution_y,
                                                 bpy.context.scene.render.resolution_x, 3), 0.1, np.float32))
    session = Session.prepare(bpy.context, Request([Picture("Camera", target)], Names(vertices=("Thing",))))
    move = np.zeros_like(points)
    move[:, 2] = np.sin(3.0 * points[:, 0]) * np.sin(2.0 * points[:, 1] + 0.5)

    def picture(amount: float) -> Any:
        data.vertices.foreach_set("co", (points + amount * move).astype(np.float32).ravel())
        data.update()
        return edgegrad.render(bs.export().scene, spp=64, max_depth=2).astype(np.float64)

    quotient = (picture(1e-2) - picture(-1e-2)) / 2e-2
    picture(0.0)
    own = edgegrad.render_forward(session.export.scene, {session.wrt[0]: move}, spp=64, max_depth=2)
    # What is left is how the normals of polygons differ from those of their triangles as the sheet bends
    assert np.linalg.norm(own - quotient) < 0.06 * np.linalg.norm(quotient)
    shown = derivative_of_names(bpy.context, Names(vertices=("Thing",)), "Z").export
    plan, _ = planned(bpy.context, Names(vertices=("Thing",)), ())
    assert shown.scene.meshes["Thing"].normals is None and plan.scene.meshes["Thing"].normals is None


def test_custom_normals_stay_and_are_named() -> None:
    _, data, points = bumpy_quads(6)
    data.normals_split_custom_set_from_vertices([(0.0, 0.6, 0.8)] * len(points))
    derivative = derivative_of_names(bpy.context, Names(vertices=("Thing",)), "Z")
    assert derivative.export.scene.meshes["Thing"].normals is not None
    assert any("object 'Thing': has custom normals" in note for note in derivative.notes)
