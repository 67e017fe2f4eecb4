"""Numbers in expressions as parameters: each has a place in the tables, and changing it there has the same effect."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from edgegrad import expression as e
from edgegrad.derivatives.table_derivatives import ParameterMap, shapes, with_requested
from edgegrad.expression.numbers import numbers, with_numbers
from edgegrad.scene import parameters
from edgegrad.tables import tables
from edgegrad.tables.textures.program import compile_textures
from tests.support import node_cases
from tests.support.node_cases.texture_points import corner_points, evaluate, scene_of
from tests.support.rich_scene import everything

GROUPS = ("inputs", "shading", "math", "vector_math", "mapping", "mix", "colors", "ranges", "textures")
P = e.Attribute("P")
# Operations of two or three operands, all constant except the first.
CONSTANTS: dict[str, e.Expression] = {
    **{op: e.Math(op, P, 0.7, 0.4) for op in e.MATH_OPERATIONS},
    **{f"vector {op}": e.VectorMath(op, P, (0.7, -0.4, 0.2), (0.4, 0.1, 0.9), 0.8) for op in e.VECTOR_OPERATIONS},
    **{f"mix {blend}": e.Mix(0.3, P, (0.7, 0.4, 0.2), blend, clamp_result=True) for blend in e.BLENDS},
    "constant alone": e.Math("MULTIPLY", 0.5, 0.25),
}


def cases_of(group: str) -> dict[str, e.Expression]:
    """Expressions that have numbers."""
    cases = CONSTANTS if group == "constants" else {k: v for k, (_, v) in getattr(node_cases, group)().items()}
    return {name: expression for name, expression in cases.items() if len(numbers(expression))}


@pytest.mark.parametrize("group", GROUPS)
def test_expressions_are_rebuilt_from_their_numbers(group: str) -> None:
    for _, expression in getattr(node_cases, group)().values():
        values = numbers(expression)
        assert with_numbers(expression, values.tolist()) == expression
        np.testing.assert_array_equal(numbers(with_numbers(expression, 2.0 * values + 1.0)), 2.0 * values + 1.0)


def test_numbers_come_in_the_order_of_nodes_and_fields() -> None:
    ramp = e.Ramp(e.Math("ADD", P, 0.25), ((1.0, 2.0, 3.0, 4.0), (5.0, 6.0, 7.0, 8.0)))
    mixed = e.Mix(0.5, ramp, (9.0, 10.0, 11.0))
    assert numbers(mixed).tolist() == [0.25, 0.0, *range(1, 9), 0.5, 9.0, 10.0, 11.0]
    for count in (13, 15):
        with pytest.raises(ValueError, match="numbers than were given"):
            with_numbers(mixed, np.zeros(count))


def test_branches_stay_shared() -> None:
    shared = e.Math("ADD", P, 0.25)
    rebuilt = with_numbers(e.Mix(0.5, shared, shared), [0.75, 0.0, 0.5])
    assert isinstance(rebuilt, e.Mix) and rebuilt.a is rebuilt.b


@pytest.mark.parametrize("group", ["mapping", "colors", "ranges", "textures", "constants"])
def test_places_do_what_the_numbers_do(group: str) -> None:
    """Other numbers in the tables that were compiled for the old ones, and the expression with the other numbers."""
    rng = np.random.default_rng(7)
    where, meshes = corner_points(rng.uniform(-1.5, 1.5, (40, 3)), rng.uniform(-0.5, 1.5, (40, 3)))
    cases = cases_of(group)
    scene = scene_of(list(cases.values()), meshes)
    keys = [(name, "emission") for name in scene.materials]
    made = compile_textures(scene, requested=keys)
    plain = evaluate(scene, where)
    np.testing.assert_allclose(evaluate(scene, where, tables=made), plain, rtol=2e-4, atol=2e-4)
    moved = {}
    for name, material in scene.materials.items():
        expression = material.textures["emission"]
        values = numbers(expression)
        other = values + 0.01 * (np.abs(values) + 0.1) * rng.uniform(0.5, 1.0, values.shape)
        found = made.numbers[name, "emission"]
        for table, places in ((made.constants, found.constants), (made.lookups, found.lookups)):
            table[places[:, 1]] = other[places[:, 0]]
        moved[name] = replace(material, textures={"emission": with_numbers(expression, other)})
    changed = evaluate(replace(scene, materials=moved), where)[..., :3]
    got = evaluate(scene, where, tables=made)[..., :3]
    # For a few points a step falls on the other side, because of rounding.
    wrong = np.abs(got - changed) > 1e-3 * np.maximum(1.0, np.abs(changed))
    assert wrong.mean() < 0.002, [list(cases)[k] for k in np.flatnonzero(wrong.any(axis=(1, 2)))]
    assert (np.abs(changed - plain[..., :3]) > 1e-4).any(axis=(1, 2)).mean() > 0.5


def test_equal_numbers_of_different_expressions_have_different_places() -> None:
    scene = scene_of([e.Math("MULTIPLY", P, 0.5), e.Math("MULTIPLY", P, 0.5)], corner_points(np.zeros((1, 3)))[1])
    assert np.count_nonzero(compile_textures(scene).constants == np.float32(0.5)) == 1
    made = compile_textures(scene, requested=[("m0", "emission")])
    assert made.numbers["m0", "emission"].constants[:, 0].tolist() == [0]  # the third operand isn't read
    assert np.count_nonzero(made.constants == np.float32(0.5)) == 2


def test_pull_back_is_the_transpose_of_push_forward() -> None:
    scene = everything()
    for mesh in scene.meshes.values():
        mesh.attributes = {**mesh.attributes, "P": np.ones((len(mesh.faces), 3, 3), np.float32)}
    scene.materials["glow"].textures = {  # type: ignore[misc]
        "roughness": e.Ramp(P, ((0.1, 0.2, 0.3, 1.0), (0.5, 0.6, 0.7, 1.0))), "metallic": e.Math("SINE", 0.3),
    }
    flat = tables.flatten(scene)
    wrt = [path for path in parameters.paths(scene) if ".textures." in path]
    assert {"materials.wood.textures.specular_tint", "materials.glow.textures.roughness"} <= set(wrt)
    with pytest.raises(RuntimeError, match="compiled without the numbers of material 'wood'"):
        ParameterMap(scene, flat, wrt)
    asked = with_requested(scene, flat, wrt)
    rng = np.random.default_rng(8)
    gradients = {name: rng.normal(size=shape) for name, shape in shapes(asked).items()}
    pulled = ParameterMap(scene, asked, wrt).pull_back(gradients)
    for path in wrt:
        direction = rng.normal(size=parameters.get(scene, path).shape)
        derivative = ParameterMap(scene, asked, [path])
        pushed = derivative.push_forward({path: direction})
        assert set(pushed) == set(derivative.requested)
        forward = sum(float(np.vdot(part, gradients[name])) for name, part in pushed.items())
        assert forward == pytest.approx(float(np.vdot(direction, pulled[path])), rel=1e-12, abs=1e-12)
    derivative = ParameterMap(scene, asked, ["materials.glow.textures.roughness"])
    assert set(derivative.requested) == {"texture_lookups"}


def test_numbers_are_put_into_the_expression() -> None:
    scene = everything()
    path = "materials.wood.textures.specular_tint"
    before = scene.materials["wood"].textures
    parameters.put(scene, path, parameters.get(scene, path) + 0.5)
    assert scene.materials["wood"].textures is not before
    np.testing.assert_array_equal(parameters.get(scene, path), numbers(before["specular_tint"]) + 0.5)
