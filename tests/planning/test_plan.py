"""The plan: the words of each decision, and that skipped terms are exactly zero."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import edgegrad
from edgegrad import TERMS, AreaLight, Camera, Material, Mesh, Mixture, Renderer, Scene, SunLight, World
from edgegrad.expression import Coordinates
from edgegrad.planning.scene_plan import Plan, plan
from edgegrad.planning.term import Term
from edgegrad.scene import parameters
from tests.support import shapes

VERTICES = "meshes.object.vertices"


def box() -> Scene:
    return shapes.scene(*shapes.cube())


def bent() -> Scene:
    """A sheet with a fold: it can shade itself."""
    vertices, faces = shapes.sheet(5)
    vertices[:, 2] = np.abs(vertices[:, 0])
    return shapes.scene(vertices, faces)


def with_floor(scene: Scene) -> Scene:
    vertices, faces = shapes.sheet(3, 10.0)
    scene.meshes = {**scene.meshes, "floor": Mesh(vertices - [0.0, 0.0, 1.0], faces, ("clay",))}
    return scene


def beside(scene: Scene) -> Scene:
    """Another object like the first, next to it."""
    like = scene.meshes["object"]
    scene.meshes = {**scene.meshes, "beside": Mesh(like.vertices + [3.0, 0.3, 0.2], like.faces, ("clay",))}
    return scene


def with_neighbour(scene: Scene) -> Scene:
    """A floor, and another object beside the first, which hides parts of it from the floor."""
    return beside(with_floor(scene))


def within_room(scene: Scene) -> Scene:
    """Closed walls around the object and the camera, which sees the light of the object on the walls."""
    like = scene.meshes["object"]
    scene.meshes = {**scene.meshes, "room": Mesh(20.0 * like.vertices, like.faces, ("clay",))}
    return scene


def veiled(scene: Scene) -> Scene:
    """Every second face of the object is partly transparent."""
    scene.materials["veil"] = replace(scene.materials["clay"], alpha=0.3)
    mesh = scene.meshes["object"]
    mesh.vertices = 0.6 * mesh.vertices + [0.0, 0.0, 0.5]
    mesh.materials = ("clay", "veil")
    mesh.face_material = np.arange(len(mesh.faces), dtype=np.int32) % 2
    return scene


def term(made: Plan, name: str) -> Term:
    return next(t for t in made.terms if t.name == name)


def largest(scene: Scene, wrt: Sequence[str], name: str, max_depth: int = 2) -> float:
    """The largest pixel of one term of the derivative along a random tangent of some parameters."""
    rng = np.random.default_rng(0)
    tangent = {path: rng.normal(size=np.shape(parameters.get(scene, path))) for path in wrt}
    image = Renderer(scene).render_forward(tangent, spp=32, terms=[name], max_depth=max_depth)
    return float(np.abs(image).max())


def black(scene: Scene) -> Scene:
    scene.materials["clay"].base_color = np.zeros(3)
    return scene


def glowing(scene: Scene) -> Scene:
    scene.materials["clay"].emission = np.ones(3)
    return black(scene)


ZERO: dict[str, tuple[Scene, list[str], str, int, str]] = {
    "still meshes move no edge": (box(), ["materials.clay.base_color"], "primary", 2, "camera stands still"),
    "still meshes move no shadow": (with_floor(box()), ["lights.lamp.power"], "shadow", 2, "no shadow moves"),
    "convex and alone": (box(), [VERTICES], "shadow", 2, "'object' is alone and convex"),
    "flat and alone": (shapes.scene(*shapes.sheet(4)), [VERTICES], "shadow", 2, "alone and convex"),
    "black surfaces show no shadow": (black(with_floor(box())), [VERTICES], "shadow", 2, "every surface is black"),
    "no shadows in emission": (with_floor(glowing(box())), [VERTICES], "shadow", 1, "only light seen directly"),
    "emission stays": (glowing(box()), [VERTICES], "interior", 2, "no surface reflects light that it emits"),
    "black stays": (black(box()), [VERTICES], "interior", 2, "it reflects no light"),
    "no shading at depth 1": (box(), [VERTICES], "interior", 1, "only light seen directly"),
    "reflectance at depth 1": (box(), ["materials.clay.base_color"], "interior", 1, "only light seen directly"),
    "no light between surfaces at depth 2": (with_floor(box()), [VERTICES], "indirect", 2, "is not rendered"),
    "still meshes see the same": (with_floor(box()), ["lights.lamp.power"], "indirect", 3, "stays"),
    "black surfaces pass nothing on": (black(with_floor(box())), [VERTICES], "indirect", 4, "every surface is black"),
    "convex and alone lights nothing": (box(), [VERTICES], "indirect", 4, "'object' is alone and convex"),
    "lights on black": (black(box()), ["lights.lamp.power"], "interior", 2, "every surface is black"),
}


@pytest.mark.parametrize("rule", ZERO)
def test_what_is_skipped_is_zero(rule: str) -> None:
    scene, wrt, name, depth, reason = ZERO[rule]
    made = plan(scene, wrt, max_depth=depth)
    assert not term(made, name).computed and name not in made.needed
    assert any(reason in why for why in term(made, name).why), term(made, name).why
    assert largest(scene, wrt, name, depth) == pytest.approx(0.0, abs=1e-12)


def test_borders_count_where_nothing_is_between() -> None:
    scene = with_floor(box())
    indirect = term(plan(scene, [VERTICES], max_depth=4), "indirect")
    assert any("'object' and 'floor' are convex and apart" in why for why in indirect.why), indirect.why
    assert any("where surfaces nearly touch" in why for why in indirect.why), indirect.why
    assert indirect.computed and largest(scene, [VERTICES], "indirect", 4) > 0.0


def test_a_smooth_body_seen_from_inside_may_hide_light_from_itself() -> None:
    scene = box()
    mesh = scene.meshes["object"]
    mesh.smoothing = mesh.faces
    scene.camera.to_world[:3, 3] = 0.0
    scene.lights["lamp"].position = np.array([0.2, 0.1, 0.3])
    made = plan(scene, [VERTICES], max_depth=4)
    assert largest(scene, [VERTICES], "indirect", 4) > 0.0
    assert term(made, "indirect").computed and "indirect" in made.needed


@pytest.mark.parametrize(("scene", "depth"), [(box(), 1), (black(box()), 2)])
def test_a_lamp_that_the_camera_sees_counts_without_what_it_lights(scene: Scene, depth: int) -> None:
    scene.lights["lamp"] = edgegrad.PointLight(np.array([1.2, -2.0, 0.5]), 60.0, 0.3, visible_to=frozenset({"camera"}))
    made = plan(scene, ["lights.lamp.power"], max_depth=depth)
    assert largest(scene, ["lights.lamp.power"], "interior", depth) > 0.0
    assert term(made, "interior").computed


def coated() -> Scene:
    """A coat transmits less of the emission towards grazing directions."""
    scene = glowing(box())
    scene.materials["clay"].coat_weight = 1.0
    return scene


def mixed() -> Scene:
    """The weight of the emission differs from place to place."""
    scene = glowing(box())
    scene.materials["glow"] = scene.materials["clay"]
    weight = Coordinates("POSITION")
    scene.materials["clay"] = Mixture(("glow",), np.ones(1), {"0": weight})
    return scene


@pytest.mark.parametrize("scene", [coated(), mixed()])
def test_emission_seen_directly_may_change_as_its_surface_moves(scene: Scene) -> None:
    assert term(plan(scene, [VERTICES], max_depth=1), "interior").computed
    assert largest(scene, [VERTICES], "interior", 1) > 1e-4


def over_clay() -> Scene:
    """A black box that emits light onto a floor."""
    scene = with_floor(box())
    scene.materials["lamp"] = edgegrad.Material(np.zeros(3), emission=np.ones(3))
    scene.meshes["object"].materials = ("lamp",)
    return scene


NOT_ZERO: dict[str, tuple[Scene, list[str], str]] = {
    "moving edges": (box(), [VERTICES], "primary"),
    "moving shading": (box(), [VERTICES], "interior"),
    "moving colours": (box(), ["materials.clay.base_color"], "interior"),
    "the light of a moving lamp": (over_clay(), [VERTICES], "interior"),
    "a shadow on the floor": (with_floor(box()), [VERTICES], "shadow"),
    "a shadow on a moving floor": (with_floor(box()), ["meshes.floor.vertices"], "shadow"),
    "its own shadow": (bent(), [VERTICES], "shadow"),
    "emissive edges": (glowing(box()), [VERTICES], "primary"),
    "light between surfaces": (with_neighbour(box()), [VERTICES], "indirect"),
    "a body within a room": (within_room(box()), [VERTICES], "indirect"),
    "light through a body's far side": (veiled(box()), [VERTICES], "shadow"),
    "veils over a floor": (veiled(with_floor(box())), [VERTICES], "indirect"),
}


@pytest.mark.parametrize("rule", NOT_ZERO)
def test_what_is_computed_is_not_zero(rule: str) -> None:
    """The same scenes without the reason to skip, so that no decision skips too much."""
    scene, wrt, name = NOT_ZERO[rule]
    depth = 3 if name == "indirect" else 2
    assert term(plan(scene, wrt, max_depth=depth), name).computed
    assert largest(scene, wrt, name, depth) > 1e-4


@pytest.mark.parametrize(("roughness", "aimed"), [(0.6, True), (0.75, False)])
def test_sharp_lobes_are_named(roughness: float, aimed: bool) -> None:
    scene = with_neighbour(box())
    scene.materials["metal"] = edgegrad.Material(np.full(3, 0.9), kind="GLOSSY", roughness=roughness)
    neighbour = next(name for name in scene.meshes if name != "object")
    scene.meshes[neighbour].materials = ("metal",)
    why = term(plan(scene, [VERTICES], max_depth=3), "indirect").why
    assert any("sharp lobes (metal)" in words for words in why) == aimed, why


def test_edges_are_counted() -> None:
    made = plan(with_floor(box()), [VERTICES])
    primary = term(made, "primary")
    assert primary.of == 18 + 16 and primary.edges == 12  # the cube's 6 diagonals are flat
    assert any("16 edges of meshes that stand still" in why for why in primary.why)
    assert any("6 edges between two faces of one plane and one material" in why for why in primary.why)
    assert "moving meshes: 1 of 2 (object)" in primary.why
    assert term(made, "shadow").edges == 12 + 8  # and the floor's border


def test_flat_seams_between_materials_are_candidates() -> None:
    scene = box()
    scene.materials = {**scene.materials, "paint": Material(np.zeros(3))}
    scene.meshes["object"].materials = ("clay", "paint")
    scene.meshes["object"].face_material = np.array([0, 1] * 6, np.int32)
    assert term(plan(scene, [VERTICES]), "primary").edges == 18


def test_split_vertices_have_the_same_plan() -> None:
    assert str(plan(shapes.scene(*shapes.split(*shapes.ball(2))), [VERTICES])) == str(
        plan(shapes.scene(*shapes.ball(2)), [VERTICES])
    )


def test_absent_kinds_of_light_are_named() -> None:
    scene = with_floor(box())
    why = term(plan(scene, [VERTICES]), "shadow").why
    assert "no shadows of area lights, spots, suns, emissive meshes: there are none" in why
    scene.lights = {"sun": SunLight(np.array([0.0, 0.0, -1.0])), "area": AreaLight(np.eye(4))}
    scene.world = World()
    why = term(plan(scene, [VERTICES]), "shadow").why
    assert "no shadows of point lights, spots, environment, emissive meshes: there are none" in why


def test_unused_materials_are_named() -> None:
    scene = box()
    scene.materials = {**scene.materials, "spare": Material()}
    made = plan(scene, ["materials.spare.base_color"])
    assert term(made, "interior").why[0].startswith("'materials.spare.base_color': zero, since no face has this")
    assert made.needed == ()


def test_what_is_not_computed_is_said() -> None:
    scene = with_floor(box())
    assert not any("pass through each other" in words for words in plan(scene, [VERTICES]).missing), "it stands on it"
    scene.meshes["object"].vertices[:, 2] -= 0.1
    words = "besides edges: the lines where 'object' and 'floor' pass through each other"
    assert words in term(plan(scene, [VERTICES], max_depth=3), "indirect").why
    assert plan(scene, [VERTICES]).missing == ()
    assert not any("indirect boundary" in words for words in plan(scene, [VERTICES], max_depth=3).missing)
    scene.meshes["floor"].visible_to = frozenset({"camera", "diffuse", "shadow"})
    assert any("indirect boundary" in words for words in plan(scene, [VERTICES], max_depth=3).missing)
    assert plan(glowing(box()), [VERTICES]).missing == ()


def test_densities_that_pictures_depend_on_are_named() -> None:
    """A mesh hides the sky from scattered rays and not from shadow rays: their shares depend on the sky's pixels."""
    scene = with_floor(box())
    scene.images = {"sky": edgegrad.Image(np.random.default_rng(1).random((4, 8, 3), np.float32))}
    scene.world = edgegrad.World(np.ones(3), 1.0, "sky")
    told = "shadows of object, which only some kinds of rays can hit"
    assert not any(told in words for words in plan(scene, ["images.sky.pixels"]).missing)
    scene.meshes["object"].visible_to = frozenset({"camera", "diffuse", "glossy", "transmission"})
    assert any(told in words for words in plan(scene, ["images.sky.pixels"]).missing)
    assert not any(told in words for words in plan(scene, ["world.color"]).missing)


def test_shading_of_a_convex_body_under_an_even_sky_is_constant() -> None:
    """The rule, and that what it skips is exactly zero: derivatives by a colour too are computed, and have no more."""
    scene = shapes.scene(*shapes.cube(), world=1.0)
    scene.lights = {}
    assert not term(plan(scene, [VERTICES, "camera.to_world"]), "interior").computed
    renderer = edgegrad.Renderer(scene)
    adjoint = np.random.default_rng(1).normal(size=renderer.render(spp=1).shape)
    color = "materials.clay.base_color"
    skipped = renderer.render_backward(adjoint, [VERTICES], spp=8, terms=("interior",))[VERTICES]
    computed = renderer.render_backward(adjoint, [VERTICES, color], spp=8, terms=("interior",))
    assert not skipped.any() and not computed[VERTICES].any() and computed[color].any()
    scene.lights = {"sun": SunLight(np.array([0.0, 0.0, -1.0]))}
    assert term(plan(scene, [VERTICES]), "interior").computed


def test_words() -> None:
    text = str(plan(with_floor(box()), [VERTICES, "materials.clay.base_color"]))
    assert "Primary boundary (edges that the camera sees): 12 of 34 edges" in text
    text = str(plan(glowing(box()), ["materials.clay.emission"]))
    assert "skipped, it is zero" in text and "Everything that can contribute in this scene is computed" in text
    assert [t.name for t in plan(box(), ["world.color"]).terms] == list(TERMS)


def test_bad_input_is_refused() -> None:
    for wrt, message in ((VERTICES, "must be a list"), (["camera.clip_end"], "no derivative"), (["a.b"], "unknown")):
        with pytest.raises(ValueError, match=message):
            plan(box(), wrt)
    with pytest.raises(ValueError, match="max_depth"):
        plan(box(), [VERTICES], max_depth=0)
    with pytest.raises(ValueError, match="no camera"):
        plan(Scene(None, {}, {}, {}, World(np.ones(3))), [])  # type: ignore[arg-type]
    assert isinstance(box().camera, Camera)


def convex(mesh: Mesh) -> bool:
    """Whether the engine finds that a mesh hides no light from itself."""
    scene = shapes.scene(mesh.vertices, mesh.faces)
    scene.camera.to_world[:3, 3] = [0.0, 0.0, 50.0]
    return "is alone and convex" in term(plan(scene, [VERTICES]), "shadow").why[0]


def crossing(*meshes: Mesh) -> bool:
    """Whether it finds lines where meshes pass through each other."""
    scene = box()
    scene.meshes = {f"mesh{k}": mesh for k, mesh in enumerate(meshes)}
    why = term(plan(scene, [f"meshes.mesh{k}.vertices" for k in range(len(meshes))]), "primary").why
    return any("pass through each other" in words for words in why)


def test_convex() -> None:
    def mesh(arrays: shapes.Arrays, keep: slice = slice(None)) -> Mesh:
        return Mesh(arrays[0], arrays[1][keep], ("clay",))

    angle = np.arange(30) * (2.0 * np.pi / 30)
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros(30)], axis=1)
    here, there, up, down = np.arange(30), (np.arange(30) + 1) % 30, np.full(30, 30), np.full(30, 31)
    top = np.concatenate([ring, [[0, 0, 1.0], [0.1, 0, -0.5]]])
    faces = np.concatenate([np.stack([here, there, up], 1), np.stack([there, here, down], 1)]).astype(np.int32)
    assert convex(Mesh(top, faces, ("clay",))) and convex(Mesh(top, faces[:, ::-1].copy(), ("clay",)))
    for body in (shapes.cube(), shapes.sheet(5), shapes.split(*shapes.cube())):
        assert convex(mesh(body))
    assert not convex(mesh(shapes.cube(), slice(0, 10))), "a box without lid shades its inside"
    dented = top.copy()
    dented[7] *= 0.97
    assert not convex(Mesh(dented, faces, ("clay",)))
    assert not convex(bent().meshes["object"])


def test_a_small_ball_of_flat_quads_in_a_large_scene_is_convex() -> None:
    """Rounding to the scene's coordinates moves the corners of its quads out of their planes."""
    rings, sectors = 16, 32
    polar, around = np.meshgrid(np.linspace(0.1, np.pi - 0.1, rings), 2.0 * np.pi * np.arange(sectors) / sectors)
    ball = np.stack([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], axis=-1)
    vertices = np.concatenate([ball.reshape(-1, 3), [[0, 0, np.cos(0.1)], [0, 0, -np.cos(0.1)]]])
    k, j = np.meshgrid(np.arange(rings - 1), np.arange(sectors), indexing="ij")
    a, b = (j * rings + k).ravel(), ((j + 1) % sectors * rings + k).ravel()
    near, far = np.arange(sectors) * rings, np.roll(np.arange(sectors), -1) * rings
    faces = np.concatenate([np.stack(f, 1) for f in (
        (a, a + 1, b + 1), (a, b + 1, b), (near, far, np.full(sectors, rings * sectors)),
        (far + rings - 1, near + rings - 1, np.full(sectors, rings * sectors + 1)))]).astype(np.int32)  # fmt: skip

    def apart(vertices: NDArray[np.float64]) -> bool:
        scene = with_floor(box())
        scene.meshes["object"] = Mesh(0.02 * vertices + [1.7, -2.1, 3.3], faces, ("clay",))
        return "are convex and apart" in term(plan(scene, [VERTICES], max_depth=4), "indirect").why[0]

    assert apart(vertices)
    vertices[40] *= 0.99
    assert not apart(vertices)


def test_meshes_that_pass_through_each_other_are_found() -> None:
    cube, faces = shapes.cube()

    def moved(x: float, y: float, z: float) -> Mesh:
        return Mesh(cube + np.array([x, y, z]), faces, ("clay",))

    still = moved(0, 0, 0)
    assert crossing(still, moved(1.9, 1.9, 1.9)) and crossing(still, moved(0.5, 0.1, 0.2))
    assert not crossing(still, moved(2.0, 0, 0)), "they touch"
    assert not crossing(still, moved(5.0, 0, 0))
    flat, squares = shapes.sheet(2, 10.0)
    tilt = np.array([[1, 0, 0], [0, 0.6, -0.8], [0, 0.8, 0.6]])
    assert crossing(still, Mesh(flat @ tilt.T, squares, ("clay",)))
    beside = Mesh(flat @ tilt.T + np.array([0, 0, 4.0]), squares, ("clay",))
    assert not crossing(still, beside), "a plane beside it whose box overlaps"


def test_crossings_of_copies_are_told_by_pairs_of_meshes() -> None:
    scene = box()
    scene.meshes["object"].instances = np.tile(np.eye(4), (2, 1, 1))
    scene.meshes["object"].instances[1, :3, 3] = [0.7, 0.2, 0.1]
    wrt = ["meshes.object.instances"]
    words = "besides edges: the lines where instances of 'object' pass through each other"
    assert words in term(plan(scene, wrt), "primary").why
    scene.meshes["object"].instances[1, 0, 3] = 3.0
    assert words not in term(plan(scene, wrt), "primary").why
