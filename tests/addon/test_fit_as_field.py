"""Objects are fitted as distance fields: a new object is made, the old one is hidden, and errors say what helps."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
import edgegrad_addon
from edgegrad import distance_fields, images
from edgegrad_addon import command_line
from edgegrad_addon.export.geometry.mesh import positions
from edgegrad_addon.field_fit import FieldRequest, start_shapes
from edgegrad_addon.parameters import Names
from edgegrad_addon.problem import Problem
from edgegrad_addon.session import Picture, Request, Session
from edgegrad_addon.status import STATUS
from edgegrad_addon.write_back import kept
from tests.support.scenes import blender_scenes as bs

SIZE = 32
PARENT = (0.3, -0.1, 0.2)


@pytest.fixture
def target(tmp_path: Path) -> Path:
    """A scene with a turned, scaled cube that has a parent, and the picture of a smaller one."""
    bs.empty(SIZE)
    bs.camera((0, 0, 6), name="Front")
    bs.light("SUN", "Sun", rotation=(0.3, 0.4, 0), energy=3.0)
    bs.world((0.4, 0.4, 0.4))
    parent = bs.add("Parent", None, PARENT, (0.1, 0.0, 0.4))
    clay = bs.material("Clay", (0.6, 0.3, 0.2))
    ob = bs.add("Cube", bs.cube("Cube", clay), rotation=(0.4, 0.3, 0), scale=(0.7, 1, 1))
    ob.parent = parent
    bpy.context.view_layer.update()
    ob.scale = (0.45, 0.7, 0.7)
    bpy.context.view_layer.update()
    images.write_image(tmp_path / "target.exr", edgegrad.render(bs.export().scene, spp=64))
    ob.scale = (0.7, 1, 1)
    bpy.context.view_layer.update()
    return tmp_path / "target.exr"


def request(target: Path, name: str = "Cube", iterations: int = 2, **options: Any) -> Request:
    return Request([Picture("Front", str(target))], Names(), iterations=iterations, samples=4,
                   field=FieldRequest(name, **{"resolution": 16, **options}))  # fmt: skip


def prepare(target: Path, name: str = "Cube", **options: Any) -> Session:
    return Session.prepare(bpy.context, request(target, name, **options))


def in_world(ob: Any) -> Any:
    matrix = np.array(ob.matrix_world, np.float64)
    return positions(ob.data) @ matrix[:3, :3].T + matrix[:3, 3]


def test_a_cube_shrinks_towards_its_picture(target: Path) -> None:
    session = prepare(target, iterations=12)
    assert session.wrt == ["fields.Cube.values"] and "Cube" not in session.export.scene.meshes
    result = session.run()
    assert result.losses[result.best] < 0.5 * result.losses[0]
    assert session.write(result)
    old, made = bpy.data.objects["Cube"], bpy.data.objects["Cube (field)"]
    assert old.hide_render and old.hide_viewport and len(old.data.vertices) == 8
    assert not made.hide_render and made.parent is bpy.data.objects["Parent"]
    assert made.data.materials[0] is bpy.data.materials["Clay"]
    assert np.allclose(np.array(made.matrix_world), np.array(old.matrix_world), atol=1e-6)
    found = bs.export().scene.meshes["Cube (field)"]
    assert distance_fields.topology(found).is_closed_manifold
    assert np.ptp(in_world(made), axis=0).max() < np.ptp(in_world(old), axis=0).max()
    # What is rendered now is the surface that was fitted.
    surface = distance_fields.to_mesh(session.export.scene.fields["Cube"])
    assert distance_fields.chamfer_distance(surface, found) < 1e-5


@pytest.mark.parametrize("removed", [True, False])
def test_a_result_that_has_no_place_is_kept_until_it_can_be_written(target: Path, removed: bool) -> None:
    session = prepare(target)
    result, old = session.run(), bpy.data.objects["Cube"]
    expected = session.field.mesh(result.values["fields.Cube.values"]).vertices if session.field else np.zeros(0)
    if removed:
        bpy.data.objects.remove(old)
    else:
        bpy.context.view_layer.objects.active = old
        bpy.ops.object.mode_set(mode="EDIT")
    assert not session.write(result)
    assert "Cube" in session.unwritten[0] and kept.TEXT in session.unwritten[0]
    assert "Cube (field)" not in bpy.data.objects
    if not removed:
        bpy.ops.object.mode_set(mode="OBJECT")
    assert kept.write_kept() == (["object 'Cube'"], [])
    assert np.allclose(in_world(bpy.data.objects["Cube (field)"]), expected, atol=1e-5)
    assert kept.TEXT not in bpy.data.texts


def test_the_start_is_the_objects_shape_in_the_world(target: Path) -> None:
    expected = bs.export().scene.meshes["Cube"]
    session = prepare(target, resolution=40)
    assert session.field is not None
    surface = session.field.mesh(session.field.start.values)
    cell = (session.field.start.upper - session.field.start.lower)[0] / session.field.start.cells[0]
    assert distance_fields.chamfer_distance(surface, expected) < 0.2 * cell


def test_an_empty_is_a_box_in_which_the_shape_begins_as_a_ball(target: Path) -> None:
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    box = bs.add("Box", None, (0.5, 0, 0), (0, 0, 0.3), (1, 0.5, 0.5))
    box.empty_display_type, box.empty_display_size = "CUBE", 0.8
    bpy.context.view_layer.update()
    session = prepare(target, "Box")
    assert session.field is not None
    surface = session.field.mesh(session.field.start.values)
    own = (surface.vertices - (0.5, 0, 0)) @ np.array(box.matrix_world.to_3x3().normalized())
    assert np.abs(own).max(axis=0) == pytest.approx(start_shapes.BALL * np.array([0.8, 0.4, 0.4]), rel=0.06)
    session.write(session.run())
    made = bpy.data.objects["Box (field)"]
    assert not box.hide_viewport and len(made.data.polygons) > 50 and not made.data.materials


def test_a_ball_may_replace_the_shape(target: Path) -> None:
    session = prepare(target, start="BALL", resolution=32)
    assert session.field is not None and session.field.steps.coarser == 2
    surface = session.field.mesh(session.field.start.values)
    centre = bs.export().scene.meshes["Cube"].vertices.mean(axis=0)
    assert np.abs(surface.vertices.mean(axis=0) - centre).max() < 0.05


def test_materials_uv_maps_and_colours_are_carried_over(target: Path) -> None:
    mesh = bpy.data.objects["Cube"].data
    mesh.materials.append(bs.material("Paint", (0.1, 0.2, 0.7)))
    upper = [k for k, face in enumerate(mesh.polygons) if face.normal.z > 0.9]
    mesh.polygons[upper[0]].material_index = 1
    layer = mesh.uv_layers.new(name="Map")
    colors = mesh.color_attributes.new("Tone", "FLOAT_COLOR", "POINT")
    for loop in mesh.loops:
        layer.data[loop.index].uv = mesh.vertices[loop.vertex_index].co[:2]
    for vertex in mesh.vertices:
        colors.data[vertex.index].color = (*(0.5 + 0.5 * np.array(vertex.co)), 1.0)
    session = prepare(target, resolution=32)
    assert any("a field has one material; the fit uses 'Clay'" in note for note in session.notes)
    assert session.field is not None
    session.field.write(session.field.start.values, session.field.start.values)
    made = bpy.data.objects["Cube (field)"]
    assert [slot.material.name for slot in made.material_slots] == ["Clay", "Paint"]
    place = positions(made.data)
    for face in made.data.polygons:
        middle = place[list(face.vertices)].mean(axis=0)
        if np.sort(np.abs(middle))[-2] < 0.75:  # away from the edges of the cube
            assert face.material_index == (1 if middle[2] > 0.9 else 0)
    tone, uv = made.data.color_attributes["Tone"].data, made.data.uv_layers["Map"].data
    for loop in made.data.loops:
        expected = np.clip(place[loop.vertex_index], -1.0, 1.0)
        if np.sort(np.abs(expected))[-2] < 0.75:
            assert np.array(tone[loop.vertex_index].color[:3]) == pytest.approx(0.5 + 0.5 * expected, abs=0.05)
            assert np.array(uv[loop.index].uv) == pytest.approx(expected[:2], abs=0.1)


def principled(color: tuple[float, float, float] = (0.5, 0.5, 0.5)) -> Any:
    """Give the cube a material with one Principled BSDF."""
    material = bpy.data.materials.new("Paint")
    if material.node_tree is None:
        material.use_nodes = True
    shader = material.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*color, 1.0)
    bpy.data.objects["Cube"].data.materials[0] = material
    return material


def test_colours_are_fitted_and_written(target: Path) -> None:
    """A grey cube takes the colours of its picture; the new material reads them, and the old one stays."""
    material = principled()
    session = prepare(target, iterations=24, values=("base_color", "roughness"))
    color, rough = (f"fields.Cube.attributes.Fitted {name}" for name in ("Color", "Roughness"))
    assert session.wrt == ["fields.Cube.values", color, rough]
    result = session.run()
    assert session.write(result) and not session.unwritten
    made = bpy.data.objects["Cube (field)"]
    [paint] = made.data.materials
    assert paint.name == "Paint (fitted)"
    assert not material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].is_linked
    assert bpy.data.objects["Cube"].data.materials[0] is material
    red, green, blue = np.mean([one.color[:3] for one in made.data.color_attributes["Fitted Color"].data], axis=0)
    assert red > green + 0.1 and green > blue + 0.02  # the picture's cube is (0.6, 0.3, 0.2)
    # What Blender renders now is what was fitted. Normals of so coarse a mesh are Blender's own.
    fitted, written = session.export.scene, bs.export().scene
    mesh = distance_fields.to_mesh(fitted.fields["Cube"])
    made_mesh = written.meshes["Cube (field)"]
    np.testing.assert_allclose(made_mesh.vertices, mesh.vertices, atol=1e-5)
    as_fitted = replace(made_mesh, materials=mesh.materials, attributes=mesh.attributes)
    found = edgegrad.render(written, spp=16)
    wanted = edgegrad.render(replace(fitted, fields={}, meshes={"Cube": as_fitted}), spp=16)
    assert np.linalg.norm(found - wanted) < 1e-4 * np.linalg.norm(wanted)


def test_colours_that_have_no_place_are_kept(target: Path) -> None:
    principled()
    session = prepare(target, values=("base_color", "metallic"))
    result = session.run()
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    assert not session.write(result)
    assert kept.write_kept() == (["object 'Cube'"], [])
    data = bpy.data.objects["Cube (field)"].data
    assert {"Fitted Color", "Fitted Metallic"} <= {one.name for one in data.attributes}
    assert data.materials[0].name == "Paint (fitted)"


def test_colours_of_an_empty_make_a_new_material(target: Path) -> None:
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    box = bs.add("Box", None)
    box.empty_display_type, box.empty_display_size = "CUBE", 1.2
    bpy.context.view_layer.update()
    session = prepare(target, "Box", values=("base_color",))
    assert session.write(session.run())
    [paint] = bpy.data.objects["Box (field)"].data.materials
    assert paint.node_tree.nodes["Principled BSDF"].inputs["Base Color"].is_linked


def test_colours_of_other_shaders_are_refused(target: Path) -> None:
    with pytest.raises(Problem, match="object 'Cube': values of its material can be fitted only where that has one "
                                      "Principled BSDF and no other shader, unlike 'Clay'"):
        prepare(target, values=("base_color",))


def test_a_uv_mapped_colour_is_a_mean_while_the_object_is_a_field(target: Path) -> None:
    made = bpy.data.materials["Clay"]
    image = bpy.data.images.new("Halves", 4, 4, float_buffer=True)
    image.pixels.foreach_set(np.tile([0.1, 0.2, 0.3, 1.0, 0.3, 0.4, 0.5, 1.0], 8).astype(np.float32))
    node = made.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    made.node_tree.links.new(node.outputs["Color"], bs.shader(made).inputs["Color"])
    bpy.data.objects["Cube"].data.uv_layers.new(name="Map")
    session = prepare(target)
    assert any("'Clay' is simplified: its base color is the mean of its texture" in note for note in session.notes)
    used = session.export.scene.fields["Cube"].material
    assert session.export.scene.materials[used].base_color == pytest.approx([0.2, 0.3, 0.4], abs=2e-3)
    session.run()


def test_the_command_line_saves_the_new_object(target: Path, tmp_path: Path) -> None:
    start, saved = tmp_path / "start.blend", tmp_path / "fitted.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(start))
    arguments = ["fit", str(start), "--target", f"Front={target}", "--samples", "4", "--iterations", "2"]
    assert command_line.main([*arguments, "--field", "Cube", "--resolution", "16", "--save", str(saved)]) == 0
    bpy.ops.wm.open_mainfile(filepath=str(saved))
    assert bpy.data.objects["Cube"].hide_render and len(bpy.data.objects["Cube (field)"].data.polygons) > 50
    assert command_line.main([*arguments, "--vertices", "Cube", "--resolution", "16", "--out", str(tmp_path)]) == 1
    assert command_line.main([*arguments, "--vertices", "Cube", "--field", "Cube", "--out", str(tmp_path)]) == 1
    assert command_line.main([*arguments, "--vertices", "Cube", "--field-values", "color", "--out", str(tmp_path)]) == 1


def test_the_command_line_fits_colours(target: Path, tmp_path: Path) -> None:
    principled()
    start, saved = tmp_path / "scene.blend", tmp_path / "saved.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(start))
    arguments = ["fit", str(start), "--target", f"Front={target}", "--samples", "4", "--iterations", "2"]
    values = ["--field", "Cube", "--resolution", "16", "--field-values", "color", "metallic"]
    assert command_line.main([*arguments, *values, "--save", str(saved)]) == 0
    bpy.ops.wm.open_mainfile(filepath=str(saved))
    names = {one.name for one in bpy.data.objects["Cube (field)"].data.attributes}
    assert {"Fitted Color", "Fitted Metallic"} <= names and "Fitted Roughness" not in names


@pytest.fixture
def registered(target: Path) -> Iterator[Path]:
    edgegrad_addon.register()
    yield target
    edgegrad_addon.unregister()


def test_the_operator_fits_the_active_object(registered: Path) -> None:
    settings = bpy.context.scene.edgegrad
    item = settings.targets.add()
    item.camera, item.image = bpy.data.objects["Front"], str(registered)
    settings.iterations, settings.samples, settings.field_resolution = 2, 4, 16
    bpy.context.view_layer.objects.active = bpy.data.objects["Cube"]
    STATUS.forget()
    assert bpy.ops.edgegrad.fit_as_field() == {"FINISHED"}
    assert "Cube (field)" in bpy.data.objects
    assert STATUS.cost == 0.0, "a fit as field says nothing of the time of other fits"
    settings.targets.clear()
    with pytest.raises(RuntimeError, match="There is no target; add a camera"):
        bpy.ops.edgegrad.fit_as_field()


def hidden(ob: Any) -> None:
    ob.hide_render = True


def open_sheet(ob: Any) -> None:
    ob.data = bs.plane("Sheet", 2.0)


def instanced(ob: Any) -> None:
    bs.add("Other", ob.data, (1, 0, 0))


def glowing(ob: Any) -> None:
    ob.data.materials[0] = bs.material("Lamp", (1, 1, 1), "ShaderNodeEmission")


def turned_in(ob: Any) -> None:
    ob.data.flip_normals()


WRONG = {
    hidden: "object 'Cube': has no surface that is rendered",
    open_sheet: "object 'Cube': has no distance field: the mesh encloses nothing",
    turned_in: "object 'Cube': has no distance field: the mesh encloses nothing",
    instanced: "object 'Cube': is instanced or shares its mesh",
    glowing: "field 'Cube': its material 'Lamp' emits light, which fields cannot do",
}


@pytest.mark.parametrize("change", WRONG, ids=lambda change: change.__name__)
def test_objects_that_cannot_be_fields_are_refused(target: Path, change: Any) -> None:
    change(bpy.data.objects["Cube"])
    bpy.context.view_layer.update()
    with pytest.raises((Problem, ValueError), match=WRONG[change]):
        prepare(target)


def test_objects_without_thickness_are_refused_before_the_fit(target: Path) -> None:
    """A ball in their box would be fitted, but not be written."""
    bpy.data.objects["Cube"].scale.z = 0.0
    bpy.context.view_layer.update()
    with pytest.raises(Problem, match="object 'Cube': is scaled to zero"):
        prepare(target, start="BALL")


def test_a_name_that_is_not_there_is_refused(target: Path) -> None:
    with pytest.raises(Problem, match="object 'Ball': there is no such object in scene 'Scene'"):
        prepare(target, "Ball")


def test_an_empty_that_shows_no_box_is_refused(target: Path) -> None:
    with pytest.raises(Problem, match="object 'Parent': is an empty that does not show a box; set Display As to Cube"):
        prepare(target, "Parent")


def test_a_grid_that_is_too_fine_is_refused_before_it_is_made(target: Path) -> None:
    with pytest.raises(Problem, match=r"its field of \d+ x \d+ x \d+ cells needs about [\d.]+ GB, more than 4 GB"):
        prepare(target, resolution=400)


def test_animated_properties_are_refused_beside_a_field(target: Path) -> None:
    from edgegrad_addon.animated.parameter import Wanted

    wanted = request(target)
    wanted.animated = (Wanted.parse('objects["Cube"].location'),)
    with pytest.raises(Problem, match="can't be fitted as a field together with animatable properties"):
        Session.prepare(bpy.context, wanted)


def test_surfaces_for_the_viewport_are_made_now_and_then(target: Path) -> None:
    session = prepare(target, iterations=7)
    assert session.field is not None
    session.field.live = True
    made: list[Any] = []

    def tell(step: Any) -> None:
        if session.field is not None and not any(one is session.field.newest for one in made):
            made.append(session.field.newest)

    before = set(bpy.data.objects), set(bpy.data.meshes)
    session.run(callback=tell)
    assert len(made) == 2 and all(distance_fields.topology(one).is_closed_manifold for one in made)
    assert (set(bpy.data.objects), set(bpy.data.meshes)) == before
