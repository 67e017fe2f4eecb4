"""Wrong fields are refused in one sentence that names the field, the value and the cure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import edgegrad
from edgegrad import Field, Scene
from edgegrad.expression import Attribute, Coordinates
from edgegrad.scene import parameters
from tests.support.fields.splines import exact_sphere
from tests.support.small_scenes import camera, matte, need, rectangle


def scene(field: Field | None = None, **others: object) -> Scene:
    """A sphere in a white environment."""
    return Scene(**({"camera": camera(), "materials": {"clay": matte()}, "world": edgegrad.World(np.ones(3)),
                     "fields": {"ball": field or exact_sphere(0.5)}} | others))  # type: ignore[arg-type]


def changed(name: str, value: object) -> Field:
    """A sphere with one other value."""
    field = exact_sphere(0.5)
    setattr(field, name, value)
    return field


NAN = np.zeros((5, 5, 5), np.float32)
NAN[2, 3, 4] = np.nan


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("values", NAN, r"field 'ball': values has 1 non-finite values, the first at \(2, 3, 4\)"),
        ("values", np.full((5, 5, 5), 1e60), "field 'ball': values must not exceed 3.4e"),
        ("values", np.zeros((5, 3, 5)), "field 'ball': values must have 4 to 16,384 coefficients along each axis"),
        ("values", np.zeros((5, 5)), "field 'ball': values must have the shape"),
        ("values", "text", "field 'ball': values must be an array of real numbers"),
        ("material", 3, "field 'ball': material must be text"),
        ("material", "clya", "field 'ball': material 'clya' is not in the scene; did you mean 'clay'"),
        ("lower", np.ones(3), "field 'ball': lower must be below upper along each axis"),
        ("upper", np.array([1.0, 1.0, np.inf]), "field 'ball': upper has 1 non-finite"),
        ("transform", np.zeros((4, 4)), "field 'ball': transform flattens the box"),
        ("transform", np.diag([1e18, 1e18, 1e18, 1.0]) * 3, "field 'ball': transform must not exceed"),
        ("visible_to", {"cameras"}, "field 'ball': visible_to must be a set of camera"),
        ("attributes", {"paint": np.ones((2, 2, 3))}, r"field 'ball': attributes\['paint'\] must have the shape"),
        ("attributes", {"paint": np.ones((2, 0, 2, 3))}, r"field 'ball': attributes\['paint'\] must have the shape"),
        ("attributes", {"paint": np.ones((2, 2, 2, 5))}, r"field 'ball': attributes\['paint'\] must have the shape"),
        ("attributes", {"paint": np.full((1, 1, 1, 3), np.inf)}, r"attributes\['paint'\] has 3 non-finite values"),
        ("attributes", [np.ones((2, 2, 2, 3))], "field 'ball': attributes must be a"),
    ],
)
def test_wrong_values_are_refused(name: str, value: object, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        scene(changed(name, value)).validate()


@pytest.mark.parametrize(
    ("material", "message"),
    [
        (edgegrad.Material(emission=np.ones(3)), "emits light, which fields cannot do"),
        (edgegrad.Material(anisotropy=0.5), "has an anisotropy, whose direction needs a UV map"),
        (edgegrad.Material(textures={"normal": Coordinates("NORMAL")}), "has a normal map, which needs a UV map"),
    ],
)
def test_materials_that_fields_cannot_have_are_refused(material: edgegrad.Material, message: str) -> None:
    with pytest.raises(ValueError, match=f"field 'ball': .*{message}"):
        scene(materials={"clay": material}).validate()


def test_attributes_that_no_surface_has_are_refused() -> None:
    painted = {"clay": edgegrad.Material(textures={"base_color": Attribute("paint")})}
    with pytest.raises(ValueError, match="material 'clay': textures read the attribute 'paint', which is not in "
                                         "attributes of any mesh or field with the material; did you mean 'paints'"):
        scene(changed("attributes", {"paints": np.ones((2, 2, 2, 3))}), materials=painted).validate()
    scene(changed("attributes", {"paint": np.ones((2, 2, 2, 3))}), materials=painted).validate()


def test_paths_of_attributes() -> None:
    """The text behind the last ".attributes." is the name, dots and all; values are single-precision."""
    found = scene(changed("attributes", {"a.b": np.ones((2, 1, 2, 3))}))
    found.validate()
    path = "fields.ball.attributes.a.b"
    assert path in parameters.paths(found)
    parameters.put(found, path, np.zeros((2, 1, 2, 3)))
    assert not parameters.get(found, path).any() and parameters.get(found, path).dtype == np.float32
    with pytest.raises(ValueError, match=r"fields\.ball\.attributes\.c.*is not one of the fields"):
        parameters.get(found, "fields.ball.attributes.c")


def test_a_field_and_a_mesh_need_different_names() -> None:
    with pytest.raises(ValueError, match="field 'ball': a mesh has this name too; rename one of them"):
        scene(meshes={"ball": rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0), "clay")}).validate()


@pytest.mark.parametrize(("path", "value", "message"), [
    ("fields.ball.values", np.zeros((2, 2, 2)), "tangent of 'fields.ball.values'"),
    ("fields.ball.values", np.full((16, 16, 16), np.nan), "tangent of 'fields.ball.values'"),
    ("fields.bal.values", 0.0, "there is no 'bal' in fields .known: 'ball'"),
    ("fields.ball.value", 0.0, "'value' is not one of the fields"),
])
def test_wrong_tangents_are_refused(path: str, value: object, message: str) -> None:
    need("native")
    with pytest.raises(ValueError, match=message):
        edgegrad.render_forward(scene(), {path: value}, spp=1)


@pytest.mark.parametrize("path", ["fields.ball.values", "fields.ball.transform", "fields.ball.lower"])
def test_the_plan_names_what_derivatives_by_fields_lack(path: str) -> None:
    need("native")
    assert edgegrad.plan(scene(), [path]).missing == ()
    assert edgegrad.plan(scene(materials={"clay": replace(matte(), alpha=0.5)}), [path]).missing == ()


def test_paths_of_fields_are_listed_and_can_be_put() -> None:
    made = scene()
    assert "fields.ball.values" in parameters.paths(made)
    parameters.put(made, "fields.ball.values", made.fields["ball"].values + 1.0)
    assert made.fields["ball"].values.dtype == np.float32
    made.validate()


def test_the_reference_engine_refuses_fields() -> None:
    with pytest.raises(ValueError, match="the reference engine does not trace distance fields"):
        edgegrad.render(scene(), spp=1, engine="reference")


def test_simplified_scenes_say_that_fields_are_left_out() -> None:
    simple, notes = edgegrad.differentiable(scene())
    assert not simple.fields and "field 'ball': is left out" in notes


def test_updates_keep_the_size() -> None:
    need("native")
    made = scene()
    renderer = edgegrad.Renderer(made)
    made.fields["ball"].values = exact_sphere(0.5, 20).values
    with pytest.raises(ValueError, match="topology has changed"):
        renderer.update()
