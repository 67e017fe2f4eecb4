"""Every node that the export reads, with each of its settings and outputs, has the value that Cycles computes."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

from edgegrad_addon.export.nodes.expressions import READERS, Reader
from tests.support.node_cases.blender_nodes import Nodes, render_nodes
from tests.support.node_cases.texture_points import at_values
from tests.support.scenes import blender_scenes as bs

# Nodes whose values come from the mesh, the object, an image, the ray or the camera; scenes beside Cycles test them.
OF_SURFACE = {
    "TexImage", "TexEnvironment", "Attribute", "VertexColor", "UVMap", "TexCoord", "NewGeometry", "ObjectInfo",
    "LightPath", "CameraData", "VectorTransform", "Wireframe", "Script", "HairInfo", "PointInfo", "ParticleInfo",
    "VolumeInfo",    "Fresnel", "LayerWeight", "Bump", "NormalMap", "Bevel", "Tangent", "Displacement",
    "VectorDisplacement",
}  # fmt: skip
# Inputs that are also tried with these constant values, by node.
ANGLES = {"Location": (0.3, -0.7, 1.1), "Rotation": (0.4, -0.8, 1.3), "Center": (0.2, 0.1, -0.3),
          "Axis": (0.5, 1.0, -0.7), "Angle": 0.8}  # fmt: skip
CONSTANT = {
    "Mapping": (ANGLES | {"Scale": (1.5, 0.5, -2.0)}, ANGLES, {"Scale": (0.0, 0.5, -2.0)}),
    "VectorRotate": (ANGLES, {"Axis": (0.0, 0.0, 0.0)}, {"Center": ANGLES["Center"], "Angle": 0.8}),
    "MapRange": ({"From Min": 0.5, "From Max": 0.5}, {"From Min": (0.5,) * 3, "From Max": (0.5,) * 3}),
}
# Noise is looked up some hundreds away from the origin for its further colours, where coordinates are rounded.
TOLERANCE = {"TexNoise": 2e-4, "TexVoronoi": 2e-4, "TexWave": 2e-4, "TexMagic": 2e-4, "TexBrick": 2e-4,
             "Blackbody": 1e-3}  # fmt: skip
# Settings of the tables of nodes.
EXTEND = [{"extend": "HORIZONTAL"}]
TABLES: dict[str, list[dict[str, Any]]] = {
    "ValToRGB": [{"interpolation": kind} for kind in ("CONSTANT", "EASE", "CARDINAL", "B_SPLINE")]
    + [{"color_mode": "HSV", "hue_interpolation": kind} for kind in ("NEAR", "FAR", "CW", "CCW")]
    + [{"color_mode": "HSL"}],
    "RGBCurve": EXTEND, "VectorCurve": EXTEND, "FloatCurve": EXTEND,
}  # fmt: skip
UNLIKE = {"texture_mapping", "color_mapping", "color_ramp", "mapping"}


def settings(kind: str) -> Iterator[dict[str, Any]]:
    """Yield the settings of a node, one of which differs from its default at a time."""
    node = Nodes(bpy.data.materials["scratch"].node_tree).node(kind)
    base = bpy.types.ShaderNode.bl_rna.properties.keys()
    yield {}
    yield from TABLES.get(kind, [])
    for prop in node.bl_rna.properties:
        if prop.identifier in base or prop.identifier in UNLIKE or prop.is_readonly:
            continue
        if prop.type == "ENUM":
            values = [item.identifier for item in prop.enum_items if item.identifier]
        elif prop.type == "BOOLEAN":
            values = [False, True]
        elif prop.type == "INT":
            values = [1, 3]
        elif prop.type == "FLOAT" and not prop.is_array:
            values = [0.3, 1.4]
        else:
            continue
        for value in values:
            if value != getattr(node, prop.identifier):
                yield {prop.identifier: value}


def build(kind: str, given: dict[str, Any], output: str, constants: dict[str, Any], n: Nodes) -> Any:
    """Add a node whose inputs vary, but for the constants, and return its output."""
    node = n.node(kind, **({} if kind in TABLES else given))
    vectors = [n.p, n.q]
    for k, socket in enumerate(one for one in node.inputs if one.enabled):
        if isinstance(constants.get(socket.name), tuple if socket.type == "VECTOR" else float):
            socket.default_value = constants[socket.name]
        elif socket.type in ("VECTOR", "RGBA"):
            n.tree.links.new(vectors[k % 2], socket)
        elif socket.name == "Temperature":
            kelvin = n.node("Math", {0: n.component(n.q, 0), 1: 8000.0, 2: 600.0}, operation="MULTIPLY_ADD")
            n.tree.links.new(kelvin.outputs[0], socket)
        elif socket.type == "VALUE":
            n.tree.links.new(n.component(vectors[k % 2], k % 3), socket)
    if kind == "ValToRGB":
        bend_ramp(node.color_ramp, given)
    elif kind.endswith("Curve"):
        for k, curve in enumerate(node.mapping.curves):
            curve.points.new(0.3 + 0.1 * k, 0.7 - 0.2 * k)
        node.mapping.extend = given.get("extend", "EXTRAPOLATED")
        node.mapping.update()
    elif kind == "Value":
        node.outputs[0].default_value = 0.37
    elif kind == "RGB":
        node.outputs[0].default_value = (0.2, 0.5, 0.9, 1.0)
    return next(one for one in node.outputs if one.identifier == output)


def bend_ramp(ramp: Any, given: dict[str, Any]) -> None:
    """Give a ramp three stops."""
    stops = [(0.1, (0.2, 0.8, 0.1, 1.0)), (0.35, (1.0, 0.0, 0.5, 0.3)), (0.8, (0.0, 0.4, 0.9, 0.7))]
    ramp.elements.new(0.5)
    for element, (position, color) in zip(ramp.elements, stops, strict=True):
        element.position, element.color = position, color
    for key, value in given.items():
        setattr(ramp, key, value)


def cases(kind: str) -> dict[str, Any]:
    """The cases of one kind of node: each setting with each of its outputs."""
    found = {}
    for given in settings(kind):
        n = Nodes(bpy.data.materials["scratch"].node_tree)
        try:
            made = n.node(kind, **({} if kind in TABLES else given))
        except TypeError:  # a choice of another kind of node tree
            continue
        if kind == "Mix" and made.data_type == "ROTATION":
            continue
        for output in made.outputs:
            if output.enabled and output.type in ("VALUE", "VECTOR", "RGBA"):
                for constants in ({}, *CONSTANT.get(kind, ())):
                    name = f"{given} {output.identifier} {constants or ''}"
                    found[name] = partial(build, kind, given, output.identifier, constants)
    return found


def kinds() -> list[str]:
    """The kinds of nodes that have a reader, by the names of their classes without prefix."""
    tree = bpy.data.materials.new("scratch").node_tree
    found = []
    for name in dir(bpy.types):
        if name.startswith("ShaderNode"):
            try:
                node = tree.nodes.new(name)
            except RuntimeError:
                continue
            if node.type in READERS and name.removeprefix("ShaderNode") not in OF_SURFACE:
                found.append(name.removeprefix("ShaderNode"))
    return found


@pytest.mark.parametrize("kind", kinds() if bpy.app.version >= (5, 0, 0) else [])
def test_values_are_those_of_cycles(kind: str, tmp_path: Path) -> None:
    bs.empty()
    bpy.data.materials.new("scratch")
    rng = np.random.default_rng(0)
    p, q = rng.uniform(-1.2, 1.2, (40, 3)), rng.uniform(0.1, 1.5, (40, 3))
    made = cases(kind)
    readable = {}
    for name, case in made.items():
        n = Nodes(bpy.data.materials["scratch"].node_tree)
        readable[name] = Reader().output(case(n), ())
    rows = list(made.values())
    rows += rows[:1] * (4 - len(rows))  # Blender renders no fewer rows
    theirs = render_nodes(rows, p, q, tmp_path)
    wrong = {}
    for name, value, b in zip(made, readable.values(), theirs[: len(made)], strict=True):
        a = value_at(value, p, q)
        error = np.abs(a - b[:, :3]) / np.maximum(1.0, np.abs(b[:, :3]))
        if not error.max() < TOLERANCE.get(kind, 1e-5):
            at = int(error.max(axis=1).argmax())
            wrong[name] = (p[at], q[at], a[at], b[at, :3])
    assert not wrong


def value_at(value: Any, p: Any, q: Any) -> Any:
    """(n, 3) a read value where the attributes are p and q."""
    if isinstance(value, (int, float)):
        return np.full((len(p), 3), float(value))
    if isinstance(value, tuple):
        return np.tile(np.array(value[:3]), (len(p), 1))
    return at_values([value], p, q)[0][:, :3]
