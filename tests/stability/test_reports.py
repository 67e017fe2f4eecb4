"""Reports of samples and results that are not finite; zero losses give exactly zero gradients."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import edgegrad
from edgegrad import Renderer, Scene
from edgegrad import expression as e
from edgegrad.rendering.non_finite import warn_of_gradients, warn_of_picture, warn_of_samples
from tests.stability.soups import paths_of
from tests.support.fields.splines import exact_sphere
from tests.support.picture_differences import need_every_table
from tests.support.rich_scene import everything
from tests.support.small_scenes import FLOOR, box, camera, floating_box, matte, rectangle

# Near the largest number that a float holds, so that products don't fit.
HUGE = 1e38


def lamps() -> Scene:
    """An emissive box before a dark floor."""
    return Scene(
        camera((0.3, 1.0, 4.0)),
        {"floor": rectangle(**FLOOR, material="clay"),
         "glowing box": box((0.0, 1.0, 0.0), (0.4, 0.3, 0.5), "lamp", 0.3)},
        {"clay": matte(), "lamp": edgegrad.Material(np.zeros(3), np.full(3, HUGE))},
    )


def shadowed() -> Scene:
    """A box over a floor under a sun as bright as that."""
    scene = lamps()
    scene.materials = {"clay": matte(), "lamp": matte()}
    scene.lights = {"sun": edgegrad.SunLight(np.array([0.2, -1.0, 0.1]), HUGE)}
    return scene


def sentences(run: Callable[[], Any]) -> list[str]:
    """The warnings of a call."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        run()
    assert all(w.category is RuntimeWarning for w in caught)
    return [str(w.message) for w in caught]


def both_modes(scene: Scene, path: str, term: str) -> tuple[list[str], list[str]]:
    """Warnings of the derivative by a mesh's vertices, forward and backward."""
    renderer = Renderer(scene)
    moved = {path: np.broadcast_to([1e-6, 2e-6, 0.0], scene.meshes[path.split(".")[1]].vertices.shape)}
    forward = sentences(lambda: renderer.render_forward(moved, spp=4, terms=(term,)))
    adjoint = np.full((32, 32, 3), 1e-6)
    return forward, sentences(lambda: renderer.render_backward(adjoint, [path], spp=4, terms=(term,)))


def test_samples_of_edges_that_are_left_out_are_told() -> None:
    need_every_table()
    for scene, term in ((lamps(), "primary"), (shadowed(), "shadow")):
        forward, backward = both_modes(scene, "meshes.glowing box.vertices", term)
        assert len(forward) == len(backward) == 1
        for sentence in (forward[0], backward[0]):
            assert f"the {term} term leaves out" in sentence
            assert "at the edge between the vertices" in sentence and "of mesh 'glowing box'" in sentence


def test_samples_of_shading_that_are_left_out_are_told() -> None:
    need_every_table()
    scene = lamps()
    scene.materials = {**scene.materials, "clay": edgegrad.Material(np.ones(3), np.full(3, 3.0 * HUGE))}
    scene.world = edgegrad.World(np.ones(3), 3.0 * HUGE)
    forward, backward = both_modes(scene, "meshes.floor.vertices", "interior")
    assert len(forward) == len(backward) == 1 and forward == backward
    assert "the interior term leaves out" in forward[0] and "in row" in forward[0] and "of mesh '" in forward[0]


@pytest.mark.parametrize(("kind", "field"), [("DIFFUSE", "base_color"), ("GLOSSY", "roughness")])
def test_derivatives_that_no_float_holds_are_left_out_and_told(kind: str, field: str) -> None:
    """The picture is finite. Its adjoint and the change of the value are so large that products with them are not."""
    need_every_table()
    scene = lamps()
    scene.materials = {"clay": edgegrad.Material(np.full(3, 0.5), kind=kind, roughness=0.5),
                       "lamp": edgegrad.Material(np.zeros(3), np.full(3, 1e-8 * HUGE))}  # fmt: skip
    path, large = f"materials.clay.{field}", 1e20
    value = np.asarray(getattr(scene.materials["clay"], field), np.float64)
    renderer, options = Renderer(scene), {"spp": 4, "terms": ("interior",)}
    assert np.isfinite(renderer.render(spp=4)).all()
    found: dict[str, Any] = {}
    forward = sentences(lambda: found.update(picture=renderer.render_forward({path: large + 0.0 * value}, **options)))
    adjoint = np.full((32, 32, 3), large)
    backward = sentences(lambda: found.update(renderer.render_backward(adjoint, [path], **options)))
    for told, result in ((forward, found["picture"]), (backward, found[path])):
        assert len(told) == 1 and "the interior term leaves out" in told[0]
        assert np.isfinite(result).all()



def test_pictures_are_finite_and_tell_what_they_leave_out() -> None:
    """Light that no float holds is left out; the rest of its paths stays."""
    need_every_table()
    scene = lamps()
    too_large = e.Math("EXPONENT", 1000.0)
    scene.materials = {"clay": edgegrad.Material(textures={"base_color": too_large}),
                       "lamp": edgegrad.Material(np.zeros(3), np.full(3, 10.0))}
    pictures: list[NDArray[np.float32]] = []
    for threads in (1, 3):
        told = sentences(lambda n=threads: pictures.append(Renderer(scene, threads=n).render(spp=4)))
        assert len(told) == 1 and "render: the picture leaves out" in told[0] and "the first in row" in told[0]
    assert np.isfinite(pictures[0]).all() and pictures[0].max() == 10.0
    assert pictures[0].tobytes() == pictures[1].tobytes()


def test_the_mean_of_samples_is_finite_where_their_sum_is_not() -> None:
    need_every_table()
    scene = lamps()
    scene.materials["lamp"] = edgegrad.Material(np.zeros(3), np.full(3, 3.0 * HUGE))
    picture = Renderer(scene).render(spp=16, max_depth=1)
    assert picture.max() == pytest.approx(3.0 * HUGE)


def test_tangents_whose_products_no_float_holds_are_left_out_and_told() -> None:
    need_every_table()
    renderer = Renderer(shadowed())
    tangent = {"lights.sun.color": np.full(3, HUGE)}  # the sun is as bright
    found: list[NDArray[np.float32]] = []
    told = sentences(lambda: found.append(renderer.render_forward(tangent, spp=1)))
    assert any("the interior term leaves out" in sentence for sentence in told)
    assert np.isfinite(found[0]).all()


def test_words_of_reports() -> None:
    picture = np.zeros((3, 4, 3), np.float32)
    assert sentences(lambda: warn_of_picture(picture, "render")) == []
    picture[1, 2, 0] = np.nan
    assert sentences(lambda: warn_of_picture(picture, "render_forward", ["primary"])) == [
        "render_forward: 1 of 12 pixels are not finite by the primary term, the first in row 1, column 2"
    ]
    gradients = {"meshes.a.vertices": np.zeros((2, 3)), "lights.b.power": np.array(np.inf)}
    gradients["meshes.a.vertices"][1] = np.nan
    assert sentences(lambda: warn_of_gradients(gradients, lambda path: ["interior", "shadow"])) == [
        "render_backward: the gradient of 'meshes.a.vertices' is not finite at 3 of 6 values by the interior and "
        "shadow terms, the first at index (1, 0)",
        "render_backward: the gradient of 'lights.b.power' is not finite at 1 of 1 values by the interior and shadow "
        "terms, the first at index (0)",
    ]
    tables = Renderer(lamps())._tables
    assert sentences(lambda: warn_of_samples(tables, [
        ("primary", 1, -1, (-1, -1), (1, 3)), ("interior", 2, 33, (-1, -1), (-1, -1)),
        ("shadow", 5, -1, (4, 6), (2, -1)),
    ])) == [
        "derivative: the primary term leaves out one sample where face 1 of mesh 'floor' and face 1 of mesh "
        "'glowing box' intersect, since the value is not finite",
        "derivative: the interior term leaves out 2 samples, of which the first is in row 1, column 1, at the world, "
        "since the value is not finite",
        "derivative: the shadow term leaves out 5 samples, of which the first is at the edge between the vertices 0 "
        "and 2 of mesh 'glowing box', since the value is not finite",
    ]  # fmt: skip


def test_words_of_reports_name_fields_and_area_lights() -> None:
    scene = lamps()
    scene.fields = {"drop": exact_sphere(0.5)}
    scene.lights = {**scene.lights, "window": edgegrad.AreaLight(np.eye(4))}
    tables = Renderer(scene)._tables
    first = tables.mesh_first_face
    of_field, of_light = int(first[len(tables.mesh_names)]), int(first[len(tables.mesh_names) + 1])
    assert sentences(lambda: warn_of_samples(tables, [
        ("interior", 1, 33, (-1, -1), (of_field, -1)), ("primary", 1, -1, (-1, -1), (0, of_light)),
        ("shadow", 1, -1, (4, 6), (of_field, -1)),
    ])) == [
        "derivative: the interior term leaves out one sample in row 1, column 1, at field 'drop', since the value is "
        "not finite",
        "derivative: the primary term leaves out one sample where face 0 of mesh 'floor' and an area light intersect, "
        "since the value is not finite",
        "derivative: the shadow term leaves out one sample at the border of field 'drop', since the value is not "
        "finite",
    ]  # fmt: skip


def test_edges_of_glowing_glass_have_finite_samples() -> None:
    """Light of the other face of an edge comes from within its plane, which has no solid angle from there."""
    need_every_table()
    scene = lamps()
    glass = edgegrad.Material(np.full(3, 0.5), np.full(3, 0.1), transmission=0.5)
    scene.materials = {**scene.materials, "lamp": glass}
    scene.meshes["glowing box"] = box((0.0, 1.0, 0.0), (0.5, 0.5, 0.5), "lamp")
    assert both_modes(scene, "meshes.glowing box.vertices", "primary") == ([], [])


@pytest.mark.parametrize("make", [everything, floating_box])
def test_zero_losses_have_zero_gradients(make: Callable[[], Scene]) -> None:
    need_every_table()
    scene = make()
    adjoint = np.zeros((*scene.camera.size, 3))
    gradients = Renderer(scene).render_backward(adjoint, paths_of(scene), spp=4, max_depth=3)
    assert not any(gradient.any() for gradient in gradients.values())
