"""Vertex groups, locked axes and symmetry of the vertices of objects: rules, refusals, fits."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

from edgegrad_addon.export.geometry.mesh import positions
from edgegrad_addon.parameters import Names
from edgegrad_addon.problem import Problem
from edgegrad_addon.session import Picture, Request, Session
from edgegrad_addon.vertex_options import VertexOptions
from tests.support.animated import scenes as zoo


def monkey() -> Any:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_monkey_add()
    return bpy.context.object


def test_groups_become_weights() -> None:
    ob = monkey()
    ob.vertex_groups.new(name="Other").add([0], 1.0, "REPLACE")
    ob.vertex_groups.new(name="Ear").add([3, 5], 0.25, "REPLACE")
    rules = VertexOptions("Ear", "XZ", "").rules(ob, np.eye(4))
    assert rules is not None and rules.weights is not None
    assert np.flatnonzero(rules.weights).tolist() == [3, 5] and rules.weights[3] == 0.25
    assert rules.locked == (True, False, True)
    assert VertexOptions().rules(ob, np.eye(4)) is None


def test_one_side_of_a_monkey_may_be_changed() -> None:
    ob = monkey()
    start = positions(ob.data).copy()
    true = VertexOptions(symmetry="X").rules(ob, np.eye(4))
    side = start[:, 0] > 0.7  # an ear
    ob.data.vertices.foreach_set("co", (start + 0.07 * side[:, None] * np.sin(9.0 * start)).ravel())
    found = VertexOptions(symmetry="X").rules(ob, np.eye(4))
    assert true is not None and found is not None and found.partners is not None
    assert np.array_equal(found.partners, true.partners)


@pytest.mark.parametrize(("options", "message"), [
    (VertexOptions("Nose"), r"has no vertex group 'Nose' \(it has: 'Ear'\)"),
    (VertexOptions("Ear"), "no vertex has a weight in the vertex group 'Ear'"),
    (VertexOptions(locked="XYZ"), "X, Y and Z are locked"),
    (VertexOptions(symmetry="Z"), r"138 of 507 vertices, such as 0, have no partner across Z; use Mesh > Symmetrize"),
])  # fmt: skip
def test_what_does_not_fit_is_refused(options: VertexOptions, message: str) -> None:
    ob = monkey()
    ob.vertex_groups.new(name="Ear")
    with pytest.raises(Problem, match=message):
        options.rules(ob, np.eye(4))


@pytest.mark.parametrize("modifiers", [False, True], ids=["mesh", "under modifiers"])
def test_fits_obey_the_options(modifiers: bool, tmp_path: Path) -> None:
    ob = zoo.stage(16)
    if modifiers:
        zoo.subdivided(ob)
    target = tmp_path / "target.exr"
    bpy.context.scene.render.filepath = str(target)
    bpy.ops.render.render(write_still=True)
    start = positions(ob.data).copy()
    start[:, 0] *= np.float32(1.1)
    ob.data.vertices.foreach_set("co", start.ravel())
    ob.data.update()
    ob.rotation_euler[2] = 0.3
    top = [k for k, point in enumerate(start) if point[2] > 0.0]
    ob.vertex_groups.new(name="Top").add(top, 1.0, "REPLACE")
    bpy.context.view_layer.update()
    request = Request([Picture("Camera", str(target))], Names(vertices=("Cube",)), iterations=4, samples=4,
                      in_place=True, vertex_options={"Cube": VertexOptions("Top", "Y", "X")})  # fmt: skip
    session = Session.prepare(bpy.context, request)
    result = session.run()
    assert any("one view does not determine depth" in note for note in result.notes)
    assert session.write(result)
    move = positions(ob.data) - start
    assert np.abs(move[top]).max() > 1e-3
    assert np.abs(move[start[:, 2] < 0.0]).max() < 1e-6 and np.abs(move[:, 1]).max() < 1e-5
    order = {tuple(np.round(point, 4)): k for k, point in enumerate(start)}
    pairs = [order[(-x, y, z)] for x, y, z in (tuple(np.round(point, 4)) for point in start)]
    np.testing.assert_allclose(move[pairs] * (-1.0, 1.0, 1.0), move, atol=1e-5)
