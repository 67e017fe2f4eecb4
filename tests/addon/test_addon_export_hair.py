"""Export of hair, curves and point clouds as meshes; no object is left out in silence."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

from edgegrad_addon.export.geometry import hair, object_types, points
from edgegrad_addon.export.geometry.strands import Strands, lengths, prisms, resampled, straight, subdivided, usable
from edgegrad_addon.parameters import Names
from edgegrad_addon.problem import Problem
from tests.support.scenes import blender_scenes as bs

pytestmark = pytest.mark.usefixtures("lit_scene")


def two_strands() -> Strands:
    """A bent strand of four points and a straight one of two."""
    p = np.array([[0, 0, 0], [0, 0, 1], [0, 1, 2], [0, 3, 2], [5, 0, 0], [5, 0, 2.0]])
    return Strands(p, np.array([0.2, 0.2, 0.1, 0.1, 0.3, 0.0]), np.array([0, 4, 6]))


def area(arrays: Any) -> float:
    p = arrays.positions[arrays.faces].astype(np.float64)
    return 0.5 * float(np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1).sum())


# ------------------------------------------------------------------------------------------------ strands
@pytest.mark.parametrize("sides", [3, 5, 16])
def test_prisms_have_the_mean_width_of_tubes(sides: int) -> None:
    tube = Strands(np.array([[0, 0, 0], [0, 0, 2.0]]), np.array([0.1, 0.1]), np.array([0, 2]))
    arrays, point = prisms(tube, sides, smooth=False)
    assert area(arrays) == pytest.approx(2.0 * np.pi * 0.1 * 2.0, rel=1e-6)
    directions = np.stack([np.cos(t := np.linspace(0.0, np.pi, 721)[:-1]), np.sin(t), 0 * t], axis=1)
    width = np.ptp(arrays.positions.astype(np.float64) @ directions.T, axis=0)
    assert np.mean(width) == pytest.approx(0.2, rel=1e-3)
    assert np.array_equal(point, np.repeat([0, 1], sides))
    faces = arrays.positions[arrays.faces]
    outward = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    assert np.all(np.einsum("nk,nk->n", outward[:, :2], faces.mean(axis=1)[:, :2]) > 0.0)


def test_tips_of_no_radius_have_no_flat_faces() -> None:
    arrays, _ = prisms(two_strands(), 5, smooth=False)
    assert len(arrays.faces) == 3 * 10 + 5
    p = arrays.positions[arrays.faces]
    assert np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1).min() > 1e-4


def test_splines_pass_through_their_points_and_are_catmull_rom() -> None:
    strands = two_strands()
    strands.along["x"] = np.arange(6.0)[:, None]
    fine = subdivided(strands, 4)
    assert np.array_equal(fine.counts, [13, 5])
    assert np.allclose(fine.points[:13:4], strands.points[:4])
    # The middle of a section: (9 (b + c) - a - d) / 16.
    a, b, c, d = strands.points[:4]
    assert np.allclose(fine.points[6], (9.0 * (b + c) - a - d) / 16.0)
    assert np.allclose(fine.along["x"][:13, 0], np.arange(13) / 4.0)


def test_straight_strands_lose_points_that_their_radii_do_not_need() -> None:
    t = np.linspace(0.0, 1.0, 9)
    line = np.stack([0 * t, 0 * t, t], axis=1)
    even = Strands(line, 0.01 * (1.0 - t), np.array([0, 9]))
    assert resampled(even, 1e-3).counts == [2]
    closed = Strands(line, np.where(t < 1.0, 0.01, 0.0), np.array([0, 9]))
    assert resampled(closed, 1e-3).counts[0] >= 9


def test_wide_strands_follow_their_splines_closely() -> None:
    """Within a part of a pixel, however thick they are; thin ones within a part of their radius."""
    t = np.linspace(0.0, 3.0, 6)
    bent = Strands(np.stack([np.sin(t), 0 * t, np.cos(t)], axis=1), np.full(6, 0.2), np.array([0, 6]))
    assert resampled(bent, 1e-2).counts == [6]
    assert resampled(bent, 1e-2, wide=True).counts == [21]


def test_kinks_are_mitred() -> None:
    bent = Strands(np.array([[0, 0, 0], [1, 0, 0], [1, 1.0, 0]]), np.full(3, 0.1), np.array([0, 3]))
    out = straight(bent)
    assert np.array_equal(out.counts, [2, 2])
    assert np.allclose(out.points, [[0, 0, 0], [1.1, 0, 0], [1, -0.1, 0], [1, 1, 0]])


def test_strands_without_length_or_with_bad_points_are_left_out() -> None:
    p = np.array([[0, 0, 0], [0, 0, 0], [1, 0, 0], [1, 0, np.nan], [2, 0, 0], [2, 0, 1], [3, 0, 0.0]])
    kept = usable(Strands(p, np.ones(7), np.array([0, 2, 4, 6, 7])))
    assert np.array_equal(kept.points, [[2, 0, 0], [2, 0, 1]])
    assert np.array_equal(lengths(kept)[1], [1.0])


# ------------------------------------------------------------------------------------------------ particle systems
def hairy(name: str = "Head", count: int = 20, **settings: Any) -> Any:
    mesh = bs.plane(name)
    mesh.materials.append(bs.material("Skin"))
    mesh.materials.append(bs.material("Fur"))
    ob = bs.add(name, mesh)
    ob.modifiers.new("Hair", "PARTICLE_SYSTEM")
    made = ob.particle_systems[0].settings
    made.type, made.count, made.hair_length, made.display_step = "HAIR", count, 0.5, made.render_step
    made.child_percent, made.display_percentage = made.rendered_child_count, 100
    for key, value in settings.items():
        setattr(made, key, value)
    return ob


def roots(mesh: Any) -> NDArray[np.float64]:
    used = mesh.vertices[np.unique(mesh.faces)]
    return np.asarray(used[np.abs(used[:, 2]) < 0.02])


def test_particle_hair_is_a_mesh_of_its_own() -> None:
    hairy(material=2, radius_scale=0.04, root_radius=1.0, tip_radius=0.5, use_close_tip=False)
    export = bs.export()
    export.scene.validate()
    mesh = export.scene.meshes["Head (hair Hair)"]
    assert mesh.materials == ("Fur",)
    assert "Head" in export.scene.meshes
    assert mesh.vertices[:, 2].max() == pytest.approx(0.5, abs=0.03)
    # The radius is half of root_radius times radius_scale; vertices lie within 1.21 of it.
    bottom = roots(mesh)
    centre = bottom.reshape(20, -1, 3).mean(axis=1)
    reach = np.linalg.norm(bottom.reshape(20, -1, 3) - centre[:, None], axis=2)
    assert 0.02 <= reach.max() <= 0.0245
    assert not export.report.lines


@pytest.mark.parametrize(("scale", "shape", "named"), [(0.2, "RIBBONS", True), (0.2, "THICK", False),
                                                       (0.02, "RIBBONS", False)])  # fmt: skip
def test_strands_that_are_thick_for_their_length_are_named_as_ribbons(scale: float, shape: str, named: bool) -> None:
    bpy.context.scene.render.resolution_x = bpy.context.scene.render.resolution_y = 16
    bpy.context.scene.cycles_curves.shape = shape
    hairy(radius_scale=scale, root_radius=1.0, tip_radius=0.5, use_close_tip=False)
    assert any("Cycles' ribbons" in line for line in bs.export().report.lines) == named


def test_a_hidden_emitter_keeps_its_hair() -> None:
    hairy().show_instancer_for_render = False
    assert set(bs.export().scene.meshes) == {"Head (hair Hair)"}


def test_hair_that_is_not_rendered() -> None:
    ob = hairy()
    ob.particle_systems[0].settings.render_type = "NONE"
    assert set(bs.export().scene.meshes) == {"Head"}
    ob.particle_systems[0].settings.render_type = "PATH"
    bpy.context.view_layer.use_strand = False
    assert set(bs.export().scene.meshes) == {"Head"}


def test_children_hide_their_parents() -> None:
    hairy(child_type="SIMPLE", rendered_child_count=3, child_percent=3)
    mesh = bs.export().scene.meshes["Head (hair Hair)"]
    tips = np.unique(mesh.vertices[mesh.vertices[:, 2] > 0.4], axis=0)
    assert len(tips) == 60  # strands end in points


def test_numbers_are_those_of_a_render() -> None:
    ob = hairy(child_type="SIMPLE", rendered_child_count=30, child_percent=3, display_step=1, tip_radius=1.0,
               use_close_tip=False)  # fmt: skip
    ob.particle_systems[0].settings.display_percentage = 50
    export = bs.export()
    assert len(export.scene.meshes["Head (hair Hair)"].faces) == 20 * 30 * 6
    assert not export.report.lines


def test_values_along_strands() -> None:
    ob = hairy(use_close_tip=False)
    fur = ob.data.materials[0]
    tree = fur.node_tree
    info = tree.nodes.new("ShaderNodeHairInfo")
    tree.links.new(info.outputs["Intercept"], bs.shader(fur).inputs["Color"])
    mesh = bs.export().scene.meshes["Head (hair Hair)"]
    height = mesh.vertices[mesh.faces][..., 2]
    assert np.allclose(mesh.attributes["(strand intercept)"][..., 0], height / height.max(), atol=0.05)


def test_strands_that_let_light_through_are_ribbons() -> None:
    ob = hairy(count=20, use_close_tip=False, tip_radius=1.0)
    assert len(bs.export().scene.meshes["Head (hair Hair)"].faces) == 20 * 6
    ob.data.materials[0] = bs.material("Clear", node="ShaderNodeBsdfTransparent")
    assert len(bs.export().scene.meshes["Head (hair Hair)"].faces) == 20 * 2


def test_ribbons_have_half_the_area_of_tubes() -> None:
    tube = Strands(np.array([[0, 0, 0], [0, 0, 2.0]]), np.array([0.1, 0.1]), np.array([0, 2]))
    assert area(prisms(tube, 2, smooth=False)[0]) == pytest.approx(np.pi * 0.1 * 2.0, rel=1e-6)


def test_neighbouring_strands_are_turned_differently() -> None:
    line = np.array([[0, 0, 0], [0, 0, 1.0]])
    many = Strands(np.tile(line, (20, 1)), np.full(40, 0.1), 2 * np.arange(21))
    arrays, _ = prisms(many, 2, smooth=False)
    p = arrays.positions[arrays.faces[::2]]
    normal = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    angle = np.sort(np.arctan2(normal[:, 1], normal[:, 0]) % np.pi)
    assert np.diff(angle).max() < 0.4


def test_too_many_strands_are_thinned_out_and_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hair, "MOST_TRIANGLES", 200)
    hairy(count=100)
    export = bs.export()
    mesh = export.scene.meshes["Head (hair Hair)"]
    assert 90 <= len(mesh.faces) <= 200
    assert any("of its 100 strands are rendered, each" in line for line in export.report.lines)


def test_hair_does_not_follow_fitted_vertices() -> None:
    hairy()
    with pytest.raises(Problem, match="has hair"):
        Names(vertices=("Head",)).paths(bs.export())


# ------------------------------------------------------------------------------------------------ curves and points
def curves(radius: Any = None, kind: str = "CATMULL_ROM") -> Any:
    data = bpy.data.hair_curves.new("Curves")
    data.add_curves([3, 3])
    where = np.array([[0, 0, 0], [0, 0, 1], [0, 0, 2], [1, 0, 0], [1, 0.5, 1], [1, 0, 2]], np.float32)
    data.attributes["position"].data.foreach_set("vector", where.ravel())
    if radius is not None:
        data.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", np.full(6, radius, np.float32))
    data.set_types(type=kind)
    data.materials.append(bs.material("Curve"))
    return bs.add("Curves", data)


@pytest.mark.parametrize("radius", [None, 0.1])
@pytest.mark.parametrize("kind", ["CATMULL_ROM", "POLY"])
def test_curves_objects(radius: Any, kind: str) -> None:
    curves(radius, kind)
    mesh = bs.export().scene.meshes["Curves"]
    expected = 0.005 if radius is None else radius
    first = mesh.vertices[np.abs(mesh.vertices[:, 0]) < 0.4]
    assert np.linalg.norm(first[:, :2], axis=1).max() == pytest.approx(expected, rel=0.25)
    assert mesh.materials == ("Curve",)


@pytest.mark.parametrize("shape", ["RIBBONS", "THICK"])
def test_true_normals_of_ribbons_are_named(shape: str) -> None:
    bpy.context.scene.cycles_curves.shape = shape
    material = curves(0.1).data.materials[0]
    geometry = material.node_tree.nodes.new("ShaderNodeNewGeometry")
    material.node_tree.links.new(geometry.outputs["True Normal"], bs.shader(material).inputs["Color"])
    named = [line for line in bs.export().report.lines if "true normal" in line and "object 'Curves'" in line]
    assert len(named) == (shape == "RIBBONS")


def test_curves_without_a_curve_show_nothing() -> None:
    """Geometry nodes may delete them all."""
    bs.add("Curves", bpy.data.hair_curves.new("Curves"))
    made = bs.export()
    assert not made.scene.meshes and not made.report.lines


def point_cloud() -> Any:
    """Four points, at the corners of a plane."""
    tree = bpy.data.node_groups.new("Points", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    start, made, end = (tree.nodes.new(kind) for kind in ("NodeGroupInput", "GeometryNodeMeshToPoints",
                                                          "NodeGroupOutput"))  # fmt: skip
    made.inputs["Radius"].default_value = 0.25
    tree.links.new(start.outputs[0], made.inputs["Mesh"])
    tree.links.new(made.outputs[0], end.inputs[0])
    ob = bs.add("Points", bs.plane("Points"))
    ob.modifiers.new("Points", "NODES").node_group = tree
    return ob


def test_points_are_spheres() -> None:
    point_cloud()
    export = bs.export()
    (mesh,) = export.scene.meshes.values()
    assert not export.report.lines
    p = mesh.vertices[mesh.faces]
    total = 0.5 * np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1).sum()
    assert total == pytest.approx(4 * 4.0 * np.pi * 0.25**2, rel=1e-5)


@pytest.mark.parametrize(
    ("output", "uneven", "named"),
    [("True Normal", True, True), ("Backfacing", True, True), ("True Normal", False, False), ("Normal", True, False)],
)
def test_sides_of_ellipsoids_are_named(output: str, uneven: bool, named: bool) -> None:
    """Cycles' points have the normals of spheres, also where the scale of their object makes them ellipsoids."""
    ob = point_cloud()
    ob.scale.z = 0.5 if uneven else 1.0
    made = bs.material("Sides")
    geometry = made.node_tree.nodes.new("ShaderNodeNewGeometry")
    made.node_tree.links.new(geometry.outputs[output], bs.shader(made).inputs["Color"])
    tree = ob.modifiers[0].node_group
    paint, end = tree.nodes.new("GeometryNodeSetMaterial"), tree.nodes["Group Output"]
    paint.inputs["Material"].default_value = made
    tree.links.new(tree.nodes["Mesh to Points"].outputs[0], paint.inputs["Geometry"])
    tree.links.new(paint.outputs[0], end.inputs[0])
    assert any("in Cycles those of spheres" in line for line in bs.export().report.lines) is named


def test_too_many_points_are_thinned_out_and_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(points, "MOST_TRIANGLES", 40)
    point_cloud()
    assert any("only 2 of its 4 points are rendered" in line for line in bs.export().report.lines)


# ------------------------------------------------------------------------------------------------ all types
def test_every_type_of_object_is_rendered_or_named() -> None:
    types = {item.identifier for item in bpy.types.Object.bl_rna.properties["type"].enum_items}
    known = {*object_types.RENDERED, *object_types.INVISIBLE, *object_types.LEFT_OUT}
    assert types <= known


def test_volumes_are_named() -> None:
    bs.add("Smoke", bpy.data.volumes.new("Smoke"))
    assert bs.export().report.lines == ["object 'Smoke': is a volume, which can't be rendered; it is left out"]
