"""Values of nodes that Blender or Cycles computes in a way of their own, beside Cycles: constants, back sides."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
from tests.benchmarks.cycles_scenes import stage
from tests.support.scenes import blender_scenes as bs

Value = Callable[[Any], Any]


def node(tree: Any, kind: str, inputs: Any = None, **settings: Any) -> Any:
    return stage.node(tree, f"ShaderNode{kind}", inputs, **settings)


def coordinates(tree: Any, output: str = "UV") -> Any:
    return node(tree, "TexCoord").outputs[output]


def grouped(kind: str, inside: Value, source: str = "") -> Value:
    """The value of a group with an output of this kind; `inside` gets the group's tree, with an input of `source`."""

    def value(tree: Any) -> Any:
        group = bpy.data.node_groups.new("G", "ShaderNodeTree")
        group.interface.new_socket("Out", in_out="OUTPUT", socket_type=f"NodeSocket{kind}")
        if source:
            group.interface.new_socket("In", in_out="INPUT", socket_type=f"NodeSocket{source}")
        end = group.nodes.new("NodeGroupOutput")
        group.links.new(inside(group), end.inputs[0])
        used = tree.nodes.new("ShaderNodeGroup")
        used.node_tree = group
        if source:
            used.inputs[0].default_value = (0.3, 0.5, 0.9, 1.0)[: 4 if source == "Color" else 3]
        return used.outputs[0]

    return value


def vector(tree: Any) -> Any:
    return node(tree, "CombineXYZ", {0: 0.3, 1: 0.9, 2: 0.6}).outputs[0]


def number(tree: Any) -> Any:
    made = node(tree, "Value")
    made.outputs[0].default_value = 1.7
    return made.outputs[0]


def rgb(tree: Any) -> Any:
    made = node(tree, "RGB")
    made.outputs[0].default_value = (0.3, 0.5, 0.9, 1.0)
    return made.outputs[0]


def received(tree: Any) -> Any:
    return tree.nodes.new("NodeGroupInput").outputs[0]


def direction(tree: Any) -> Any:
    made = node(tree, "Normal")
    made.outputs[0].default_value = (0.1, 0.2, 0.3)
    return made.outputs[0]


def without_scale(varies: bool) -> Value:
    def value(tree: Any) -> Any:
        place = coordinates(tree) if varies else (0.4, 0.5, 0.6)
        return node(tree, "Mapping", {"Vector": place, "Location": (0.3, 0.5, 0.2), "Scale": (0, 0, 0)}).outputs[0]

    return value


def picture(tree: Any, output: str = "Color", place: str = "UV", **settings: Any) -> Any:
    """An image whose alpha Cycles ignores, and of no symmetry."""
    image = stage.image("I", np.random.default_rng(1).random((4, 4, 4)).astype(np.float32), "Non-Color")
    image.alpha_mode = "NONE"
    return node(tree, "TexImage", {0: coordinates(tree, place)}, image=image, **settings).outputs[output]


def clipped(tree: Any) -> Any:
    place = node(tree, "Mapping", {"Vector": coordinates(tree), "Scale": (3, 3, 1), "Location": (-1, -1, 0)}).outputs[0]
    alpha = picture(tree, "Alpha", extension="CLIP")
    tree.links.new(place, alpha.node.inputs[0])
    return alpha


def missing(tree: Any) -> Any:
    return node(tree, "TexImage", {0: coordinates(tree)}, extension="CLIP").outputs["Color"]


def of_world(tree: Any) -> Any:
    bpy.context.scene.world["tone"] = 0.7
    return node(tree, "Attribute", attribute_type="VIEW_LAYER", attribute_name="tone").outputs["Color"]


def overshooting(tree: Any) -> Any:
    made = node(tree, "FloatCurve", {"Value": 0.36, "Factor": 0.5})
    curve = made.mapping.curves[0]
    for place in ((0.576, 0.04), (0.617, 0.46)):
        curve.points.new(*place)
    made.mapping.update()
    return made.outputs[0]


def beyond(tree: Any) -> Any:
    """Curves that end with another slope than that of their table's last row."""
    made = node(tree, "RGBCurve", {"Color": number(tree)})
    made.mapping.curves[0].points.new(0.9995, 0.5)
    made.mapping.update()
    return made.outputs[0]


def between_stops(source: Value) -> Value:
    def value(tree: Any) -> Any:
        made = node(tree, "ValToRGB", {0: node(tree, "Math", {0: source(tree), 1: 0.4848}, operation="MULTIPLY")})
        first, second = made.color_ramp.elements
        first.position, second.position = 0.2327, 0.2337
        return made.outputs[0]

    return value


def bent(height: Value, strength: float = 1.0, normal: Value | None = None) -> Value:
    def value(tree: Any) -> Any:
        made = node(tree, "Bump", {"Height": height(tree), "Strength": strength, "Distance": 2.0, "Filter Width": 1.0})
        if normal is not None:
            tree.links.new(normal(tree), made.inputs["Normal"])
        return node(tree, "VectorMath", {0: made.outputs[0]}, operation="ABSOLUTE").outputs[0]

    return value


# Name: what glows, and whether the plane is seen from behind.
CASES: dict[str, tuple[Value, bool]] = {
    "vector to number": (grouped("Float", vector), False),
    "number to whole": (grouped("Int", number), False),
    "number to truth": (grouped("Bool", number), False),
    "vector to truth": (grouped("Bool", vector), False),
    "color to number": (grouped("Float", received, "Color"), False),
    "vector input to number": (grouped("Float", received, "Vector"), False),
    "color node to number": (grouped("Float", rgb), False),
    "direction": (direction, False),
    "no scale": (without_scale(True), False),
    "no scale, constant": (without_scale(False), False),
    "box": (lambda tree: picture(tree, projection="BOX", place="Object"), False),
    "box, back": (lambda tree: picture(tree, projection="BOX", place="Object"), True),
    "clipped alpha": (clipped, False),
    "missing image, clipped": (missing, False),
    "world": (of_world, False),
    "pair": (lambda tree: node(tree, "Attribute", attribute_name="UVMap").outputs["Fac"], False),
    "number": (lambda tree: node(tree, "Attribute", attribute_name="Number").outputs["Fac"], False),
    "alpha of colors": (lambda tree: node(tree, "VertexColor", layer_name="Tone").outputs["Alpha"], False),
    "curve": (overshooting, False),
    "curve beyond its end": (beyond, False),
    "ramp": (between_stops(lambda tree: node(tree, "Math", {0: 0.481, 1: 0.0}, operation="ADD").outputs[0]), False),
    "depth bumps": (bent(lambda tree: node(tree, "CameraData").outputs["View Distance"]), False),
    "flat bump": (bent(coordinates, 0.0, lambda tree: coordinates(tree, "Object")), False),
    "tangent bumps": (bent(lambda tree: node(tree, "Tangent").outputs[0]), False),
}


@pytest.mark.skipif(bpy.app.version < (5, 0, 0), reason="Cycles computes constants there in earlier versions")
@pytest.mark.parametrize("case", CASES)
def test_values_are_those_of_cycles(case: str, tmp_path: Path) -> None:
    value, back = CASES[case]
    scene = bs.empty(16)
    scene.cycles.samples = 16
    bs.camera((0.3, -0.2, 3.0), (0.0, 0.0, 0.0))
    bs.world((0.0, 0.0, 0.0))
    stage.lamp("POINT", "Lamp", 1.0, (0.0, 0.0, 9.0))  # some values are black
    made = bs.material("M", node="ShaderNodeEmission")
    mesh = stage.plane("Plane", made, size=4.0)
    mesh.attributes.new("Number", "FLOAT", "POINT").data.foreach_set("value", np.full(4, 0.4, np.float32))
    mesh.color_attributes.new("Tone", "FLOAT_COLOR", "POINT").data.foreach_set("color", np.full(16, 0.3, np.float32))
    bs.add("Plane", mesh, (0.1, 0.2, 0.0), (0.5 + np.pi * back, 0.3, 0.2))
    made.node_tree.links.new(value(made.node_tree), bs.shader(made).inputs["Color"])
    export = bs.export()
    ours = edgegrad.Renderer(export.scene).render(spp=16, max_depth=1)
    theirs = bs.cycles(tmp_path)[..., :3]
    apart = np.abs(ours - theirs).max(axis=2) > 0.06 * (theirs.mean() + theirs.max(axis=2))
    assert apart.mean() < 0.1, (ours.mean(axis=(0, 1)), theirs.mean(axis=(0, 1)))
    assert all(case.startswith("missing") and "has no image" in line for line in export.report.lines)


def test_constant_emission_may_be_negative(tmp_path: Path) -> None:
    """Beside positive emission, from which it is subtracted."""
    scene = bs.empty(16)
    scene.cycles.samples = 16
    bs.camera((0.0, 0.0, 3.0), (0.0, 0.0, 0.0))
    stage.lamp("POINT", "Lamp", 1.0, (0.0, 0.0, 9.0))

    def surface(tree: Any) -> Any:
        less = node(tree, "Emission", {"Color": (0.3, 0.1, 0.2), "Strength": -1.0})
        more = node(tree, "Emission", {"Color": (0.8, 0.7, 0.9)})
        dark = node(tree, "Value")
        dark.outputs[0].default_value = -0.15
        half = node(tree, "MixShader", {0: 0.5, 1: dark, 2: less})
        return node(tree, "AddShader", {0: half, 1: more})

    bs.add("Plane", stage.plane("Plane", stage.material("M", surface), size=4.0))
    export = bs.export()
    ours = edgegrad.Renderer(export.scene).render(spp=16, max_depth=1)
    wanted = np.array([0.8, 0.7, 0.9]) - 0.5 * np.array([0.3, 0.1, 0.2]) - 0.5 * 0.15
    assert np.allclose(ours, wanted, atol=1e-4)
    assert np.allclose(bs.cycles(tmp_path)[..., :3], wanted, atol=1e-3)
    assert export.report.lines == []


@pytest.mark.parametrize(
    ("color", "strength"), [((0.8, 0.7, 0.9), -1.0), ((-0.5, 0.0, -0.1), 1.0), ((0.5, -0.4, 0.3), 1.0)]
)
def test_emission_of_principled_surfaces_that_is_not_positive(color: Any, strength: float, tmp_path: Path) -> None:
    """Cycles drops it unless the strength and a channel of the colour are positive. A lamp lights the surface."""
    scene = bs.empty(16)
    scene.cycles.samples = 16
    bs.camera((0.0, 0.0, 3.0), (0.0, 0.0, 0.0))
    stage.lamp("SUN", "Lamp", 3.0, (0.0, 0.0, 9.0))
    glow = {"Emission Color": color, "Emission Strength": strength, "Base Color": (0.8, 0.8, 0.8)}
    bs.add("Plane", stage.plane("Plane", stage.simple("M", "ShaderNodeBsdfPrincipled", glow), size=4.0))
    ours = edgegrad.Renderer(bs.export().scene).render(spp=16, max_depth=2)
    assert np.allclose(ours, bs.cycles(tmp_path)[..., :3], atol=0.05)


def test_lines_as_heights_are_named() -> None:
    bs.empty(16)
    bs.camera((0.0, 0.0, 3.0), (0.0, 0.0, 0.0))
    bs.world((1.0, 1.0, 1.0))
    made = bs.material("M", node="ShaderNodeEmission")
    bs.add("Plane", bs.plane("Plane", 4.0, made))
    value = bent(lambda tree: node(tree, "Wireframe").outputs[0])(made.node_tree)
    made.node_tree.links.new(value, bs.shader(made).inputs["Color"])
    assert any("'Wireframe' are steps of another slope" in line for line in bs.export().report.lines)


@pytest.mark.parametrize(("detail", "distortion", "named"), [(-1.0, 2.0, True), (-0.5, 2.0, False), (-1.0, 0.0, False)])
def test_waves_without_a_value_in_cycles_are_named(
    detail: float, distortion: float, named: bool, tmp_path: Path
) -> None:
    bs.empty(16)
    bs.camera((0.0, 0.0, 3.0), (0.0, 0.0, 0.0))
    bs.world((1.0, 1.0, 1.0))
    made = stage.material("M", lambda tree: node(tree, "Emission", {"Color": node(tree, "TexWave", {
        0: coordinates(tree, "Object"), "Detail": detail, "Distortion": distortion}).outputs["Color"]}))  # fmt: skip
    bs.add("Plane", bs.plane("Plane", 4.0, made))
    assert any("has no value in Cycles" in line for line in bs.export().report.lines) == named
    assert (bs.cycles(tmp_path)[..., :3].max() == 0.0) == named
