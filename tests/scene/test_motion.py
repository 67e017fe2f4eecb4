"""Which meshes and lights move with which parameters, and the plan of engines that differentiate every table."""

from __future__ import annotations

import numpy as np
import pytest

from edgegrad import Scene, expression, plan
from edgegrad.planning.term import Term
from tests.support import shapes
from tests.support.rich_scene import everything

SCENE = everything()


def term(name: str, *wrt: str, scene: Scene = SCENE, max_depth: int = 4) -> Term:
    return next(t for t in plan(scene, wrt, max_depth=max_depth).terms if t.name == name)


@pytest.mark.parametrize(
    ("wrt", "reason", "meshes"),
    [
        (("meshes.still.vertices", "meshes.bare.transform"), "needed", {"still", "bare"}),
        (("camera.shift",), "needed", set()),
        (("camera.ortho_width",), "still", set()),  # of a perspective camera
        (("lights.sun.direction", "lights.area.size", "world.rotation"), "still", set()),
        (("meshes.still.normals", "materials.wood.roughness", "images.sky.pixels", "world.color",
          "meshes.still.attributes.UVMap", "materials.wood.textures.normal"), "still", set()),
    ],
)  # fmt: skip
def test_what_moves(wrt: tuple[str, ...], reason: str, meshes: set[str]) -> None:
    edges = {d.part: d for d in plan(SCENE, wrt, max_depth=4).decisions}["edges"]
    assert edges.reason == reason and {list(SCENE.meshes)[k] for k in edges.meshes} == meshes


def test_edges_of_all_meshes_move_with_the_camera() -> None:
    pose = term("primary", "camera.to_world")
    assert pose.of == pose.edges == 162
    assert any("kept: 6 edges inside of one plane" in words for words in pose.why)
    assert pose.why[0] == "the camera moves, and so do all edges on its picture"
    one = term("primary", "meshes.bare.transform")
    assert one.edges == 18 and one.of == pose.of
    plain = term("primary", "camera.shift", scene=shapes.scene(*shapes.cube()))
    assert plain.edges == 12 and plain.of == 18
    assert not term("primary", "lights.ball.position").computed
    assert term("shadow", "lights.ball.position").computed
    assert "no shadow moves" in term("shadow", "lights.ball.power").why[0]


def test_interior_names_every_parameter() -> None:
    why = term("interior", "camera.fov_x", "materials.wood.alpha", "meshes.still.transform", "lights.ball.radius",
               "materials.clay.roughness", "meshes.still.attributes.unread").why
    assert why == (
        "'camera.fov_x': the point that each pixel sees moves over surfaces and the environment",
        "'materials.wood.alpha': zero, since the picture does not depend on it",
        "'meshes.still.transform': the mesh's shading, or the light that it emits, changes as it moves",
        "'lights.ball.radius': changes radiance",
        "'materials.clay.roughness': changes radiance",
        "'meshes.still.attributes.unread': zero, since the picture does not depend on it",
        "besides: the directions beyond which lobes of wood, sum, clay, glow scatter no light",
        "the transmittance of wood, sum changes, on the way to lights and between surfaces",
        "noisy: where faces of wood, sum, clay, glow meet at concave corners or touch others, light between them has "
        "no finite variance, since these materials are transparent, mirror perfectly or have textures that jump",
        "noisy: light that narrow lobes of wood, sum, clay, glow throw on other surfaces, since samples of its "
        "derivative are larger than this light by one over the lobes' width; with perfect mirrors (roughness 0) or "
        "rougher lobes in their place, a fit has less noise",
    )


def test_textured_emission_changes_as_its_surface_moves() -> None:
    scene = shapes.scene(*shapes.cube())
    scene.materials["clay"].base_color = np.zeros(3)
    scene.materials["clay"].emission = np.ones(3)
    assert not term("interior", "meshes.object.vertices", scene=scene, max_depth=1).computed
    scene.materials["clay"].textures = {"emission": expression.Coordinates("POSITION")}  # type: ignore[misc]
    assert term("interior", "meshes.object.vertices", scene=scene, max_depth=1).computed


def test_parts_of_mixtures_are_used() -> None:
    scene = everything()
    scene.meshes = {"still": scene.meshes["still"]}  # of "sum" and "wood"; "clay" is a part of "sum"
    scene.lights = {name: light for name, light in scene.lights.items() if light.receivers is None}
    assert term("interior", "materials.clay.roughness", scene=scene).computed
    assert not term("interior", "materials.glow.roughness", scene=scene).computed


def test_boundaries_that_no_term_has_are_named() -> None:
    scene = everything()
    for smooth in (False, True):
        # Textures of its roughness alone make a mirror of a textured surface.
        found = plan(scene, ["meshes.still.vertices"], max_depth=4).missing
        for start in ("seen in mirrors and through smooth glass", "caustics"):
            assert any(sentence.startswith(start) for sentence in found) == smooth
        scene.materials["wood"].textures = {"roughness": expression.Coordinates("POSITION")}  # type: ignore[misc]
    assert plan(SCENE, ["world.color"], max_depth=4).missing == ()
    plain = shapes.scene(*shapes.cube())
    assert plan(plain, ["meshes.object.vertices"]).missing == ()
