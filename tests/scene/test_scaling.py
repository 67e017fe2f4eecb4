"""The cost of scenes of many objects grows in proportion to their number: calls and array sizes are counted."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import edgegrad
from edgegrad import Camera, Image, Material, Mesh, Mixture, Scene, SunLight, World
from edgegrad.derivatives.table_derivatives import ParameterMap, shapes
from edgegrad.expression import Attribute, Expression, ImageTexture, Math, nodes_of
from edgegrad.geometry import mesh_batches, topology
from edgegrad.rendering.taken_over import TakenOver
from edgegrad.scene import parameters
from edgegrad.tables.tables import flatten
from edgegrad.tables.textures.lowering import RULES
from edgegrad.tables.textures.program import compile_textures
from tests.support.shapes import ball, cube, sheet, split


def calls(function: Callable[[], Any]) -> int:
    """How many functions a call calls, in Python and below."""
    count = 0

    def profile(_frame: Any, event: str, _argument: Any) -> None:
        nonlocal count
        count += event in ("call", "c_call")

    sys.setprofile(profile)
    try:
        function()
    finally:
        sys.setprofile(None)
    return count


def boxes(count: int, gap: float = 3.0) -> Scene:
    """A row of cubes of size 2."""
    vertices, faces = cube()
    meshes = {f"box{k}": Mesh(vertices + [gap * k, 0.0, 0.0], faces, ("clay",)) for k in range(count)}
    pose = np.eye(4)
    pose[2, 3] = 50.0
    return Scene(Camera(to_world=pose, width=8, height=8), meshes, {"clay": Material(np.full(3, 0.8))},
                 {"sun": SunLight(np.array([0.1, 0.2, -1.0]))}, World(np.full(3, 0.2)))


def textured(expression: Expression) -> Scene:
    """A cube with attributes for the expression."""
    scene = boxes(1)
    sizes = {"values": 1, "UVMap": 2}
    scene.meshes["box0"].attributes = {name: np.ones((12, 3, size), np.float32) for name, size in sizes.items()}
    scene.materials = {"clay": Material(textures={"roughness": expression})}
    return scene


def chain(length: int) -> Expression:
    node: Expression = Attribute("values")
    for k in range(length):
        node = Math("ADD", node, 1.0 + k)
    return node


@pytest.mark.parametrize("gap", [3.0, 2.0, 1.5])
@pytest.mark.parametrize("which", ["one", "all", "camera"])
def test_plans_cost_a_fixed_number_of_calls_per_mesh(gap: float, which: str) -> None:
    def cost(count: int) -> int:
        scene = boxes(count, gap)
        every = [f"meshes.{name}.vertices" for name in scene.meshes]
        wrt = {"one": every[:1], "all": every, "camera": ["camera.to_world"]}[which]
        return calls(lambda: edgegrad.plan(scene, wrt, max_depth=3))

    cost(2)
    few, many, more = cost(10), cost(40), cost(70)
    assert more - many < 1.2 * (many - few)


def test_a_plan_after_a_gradient_makes_no_calls_per_parameter() -> None:
    def cost(count: int) -> int:
        scene = boxes(count)
        slots = [f"m{k}" for k in range(count)]
        scene.materials = {"clay": Material(), **{name: Material(np.full(3, 0.5)) for name in slots}}
        wrt = [f"meshes.{name}.vertices" for name in scene.meshes] + [f"materials.{name}.base_color" for name in slots]
        renderer = edgegrad.Renderer(scene, watched=False)
        renderer.render_backward(np.ones((8, 8, 3)), wrt, spp=1, max_depth=3)
        return calls(lambda: edgegrad.plan(renderer, wrt, max_depth=3))

    cost(100)
    # Caches that other tests have filled may cost a few calls; there are 400 more parameters.
    assert cost(400) - cost(200) < 100


def test_the_plan_of_many_meshes_names_few() -> None:
    scene = boxes(300, gap=1.5)
    for k, mesh in enumerate(scene.meshes.values()):
        mesh.vertices = mesh.vertices + [0.0, 0.3 * (k % 2), 0.2 * (k % 2)]
    made = edgegrad.plan(scene, [f"meshes.{name}.vertices" for name in scene.meshes], max_depth=3)
    text = str(made)
    assert len(text) < 20_000
    assert "290 other pairs of meshes pass through each other" in text
    assert "moving meshes: 300 of 300 (box0, box1" in text and "box8 and 291 others)" in text
    assert "and 200 other parameters, by 0 of which it is zero" in text
    with pytest.raises(ValueError, match=r"there is no 'none' in meshes \(known: 'box0'.*and 291 others\)"):
        parameters.get(scene, "meshes.none.vertices")


def test_a_fit_makes_its_plan_once(monkeypatch: pytest.MonkeyPatch) -> None:
    made = []
    module = sys.modules["edgegrad.planning.scene_plan"]
    original = module.picture_plan  # type: ignore[attr-defined]
    monkeypatch.setattr(module, "picture_plan", lambda *a: made.append(1) or original(*a))
    scene = boxes(1)
    scene.materials = {**scene.materials, "glow": Material(textures={"roughness": Attribute("a")})}
    scene.meshes["box0"].materials = ("clay", "glow")
    scene.meshes["box0"].attributes = {"a": np.ones((12, 3, 1), np.float32)}
    target = np.full((8, 8, 3), 0.5, np.float32)
    with pytest.warns(RuntimeWarning, match="no gradient for"):
        edgegrad.fit(scene, target, ["materials.clay.base_color", "materials.clay.alpha", "materials.clay.ior",
                                     "materials.clay.coat_ior"], iterations=2, spp=1)
    assert len(made) == 1


def test_meshes_are_welded_and_paired_by_themselves_in_batches(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(1)
    scene = boxes(0)
    uv = {"UVMap": rng.integers(0, 2, (12, 3, 2)).astype(np.float32)}
    vertices, faces = cube()
    parts = split(*cube())
    scene.materials = {"clay": Material(), "wood": Material(textures={"base_color": Attribute("UVMap")})}
    for k in range(6):
        slots = rng.integers(0, 2, 12).astype(np.int32)
        smoothing = np.where(rng.random((12, 3)) < 0.3, -1, faces).astype(np.int32)
        scene.meshes = {
            **scene.meshes, f"plain{k}": Mesh(vertices * (1.0 + k), faces, ("clay",)),
            f"split{k}": Mesh(parts[0] + k, parts[1], ("wood", "clay"), slots, attributes=uv),
            f"smooth{k}": Mesh(vertices, faces, ("wood",), None, smoothing, attributes=uv),
            f"custom{k}": Mesh(vertices, faces, ("clay",), None, smoothing, np.round(rng.random((8, 3))) + 0.5),
            f"near{k}": Mesh(np.concatenate([vertices, vertices + 1e-8 * rng.normal(size=(8, 3))]),
                             np.concatenate([faces[:6], faces[6:] + 8]), ("clay",)),
            f"sheet{k}": Mesh(*sheet(2, 1.0), ("wood",)), f"ball{k}": Mesh(*ball(1), ("clay",)),
        }
    tables = flatten(scene)
    together = tables.edges()
    monkeypatch.setattr(mesh_batches, "_SIZE", 1)  # each mesh by itself
    alone = tables.edges()
    for name in ("vertices", "face_first", "faces", "opposite"):
        np.testing.assert_array_equal(getattr(together, name), getattr(alone, name))
    near = scene.meshes["near0"]
    assert len(np.unique(topology.weld(near.vertices))) == 8


def test_pieces_of_one_material_do_not_look_at_the_others() -> None:
    def cost(count: int) -> int:
        scene = boxes(1)
        scene.materials = {"clay": Material(), **{f"m{k}": Material() for k in range(count)},
                           "mixed": Mixture(("clay", "m0"), np.array([0.5, 0.5]))}
        scene.lights = {f"l{k}": SunLight(np.array([0.0, 0.0, -1.0])) for k in range(count)}
        tables = flatten(scene)
        wrt = [f"materials.m{k}.roughness" for k in range(count)] + ["materials.mixed.weights"]
        gradients = {name: np.ones(shape) for name, shape in shapes(tables).items()}
        found = ParameterMap(scene, tables, wrt).pull_back(gradients)
        assert found["materials.m0.roughness"] == 2.0 and found["materials.m1.roughness"] == 1.0
        return calls(lambda: ParameterMap(scene, tables, wrt).pull_back(gradients))

    assert cost(160) < 4.5 * cost(40)


def test_gradients_of_images_are_not_copied() -> None:
    scene = textured(ImageTexture("image", Attribute("UVMap")))
    scene.images = {"image": Image(np.ones((8, 8, 3), np.float32))}
    tables = flatten(scene)
    assert tables.textures is not None
    gradients = {"texture_pixels": np.arange(float(len(tables.textures.pixels)))}
    found = ParameterMap(scene, tables, ["images.image.pixels"]).pull_back(gradients)["images.image.pixels"]
    assert np.shares_memory(found, gradients["texture_pixels"])
    np.testing.assert_array_equal(found.ravel(), np.arange(8.0 * 8.0 * 3.0))


def test_expressions_are_compiled_node_by_node(monkeypatch: pytest.MonkeyPatch) -> None:
    def cost(length: int) -> int:
        scene = textured(chain(length))
        return calls(lambda: compile_textures(scene))

    assert cost(160) < 4.5 * cost(40)
    length = 10_000
    scene = textured(chain(length))
    scene.validate()
    assert len(compile_textures(scene).code) == length + 2  # the attribute, the sums, the output
    shared: Expression = Attribute("values")
    for _ in range(50):
        shared = Math("MULTIPLY_ADD", shared, shared, 0.5)
    rule, compiled = RULES[Math], []
    monkeypatch.setitem(RULES, Math, lambda low, node: compiled.append(node) or rule(low, node))
    assert len(compile_textures(textured(shared)).code) <= 4 * 50 + 5
    assert len(compiled) == 50


def test_expressions_without_an_end_are_refused() -> None:
    inner = Math("ADD", Attribute("values"), 1.0)
    outer = Math("MULTIPLY", inner, 2.0)
    object.__setattr__(inner, "b", outer)
    with pytest.raises(ValueError, match=r"^expression Math is a part of itself"):
        nodes_of(outer)
    with pytest.raises(ValueError, match=r"'clay': textures\['roughness'\]: expression Math is a part of itself"):
        textured(outer).validate()
    mixed = boxes(1)
    mixed.materials = {**mixed.materials, "mixed": Mixture(("clay",), np.ones(1), {"0": outer})}
    with pytest.raises(ValueError, match=r"material 'mixed': textures\['0'\]: expression Math is a part of itself"):
        mixed.validate()


def test_objects_that_have_not_changed_cost_no_calls() -> None:
    def looked(count: int) -> int:
        scene = boxes(count)
        scene.validate()
        watched = TakenOver(scene)
        scene.meshes["box1"].vertices = scene.meshes["box1"].vertices + 1.0
        watched.note(scene, ["meshes.box1.vertices"])
        return calls(lambda: watched.check(scene))

    assert looked(200) == looked(4)
