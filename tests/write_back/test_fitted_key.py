"""The shape key of fitted vertices: further fits change it, and it is relative to the active key."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

from edgegrad_addon.export.geometry.mesh import positions
from edgegrad_addon.write_back.fitted_key import points_of
from edgegrad_addon.write_back.vertices import write_move
from tests.support.scenes import blender_scenes as bs


@pytest.fixture
def cube() -> Any:
    bs.empty()
    return bs.add("Cube", bs.cube("Cube"))


def moves(seed: int) -> Any:
    return np.random.default_rng(seed).normal(0.0, 0.3, (8, 3))


def shown(ob: Any) -> Any:
    bpy.context.view_layer.update()
    return positions(ob.evaluated_get(bpy.context.evaluated_depsgraph_get()).data)


def names(ob: Any) -> list[str]:
    return [key.name for key in ob.data.shape_keys.key_blocks]


def test_further_fits_change_the_same_key(cube: Any) -> None:
    start = positions(cube.data)
    for seed in range(3):
        before = shown(cube)
        write_move(cube, moves(seed), in_place=False)
        assert shown(cube) == pytest.approx(before + moves(seed), abs=1e-6)
    assert names(cube) == ["Basis", "Edgegrad"]
    assert np.array_equal(points_of(cube.data.shape_keys.key_blocks["Basis"]), start)
    # A key at half its value moves twice as far.
    cube.data.shape_keys.key_blocks["Edgegrad"].value = 0.5
    before = shown(cube)
    write_move(cube, moves(7), in_place=False)
    assert shown(cube) == pytest.approx(before + moves(7), abs=1e-6) and names(cube) == ["Basis", "Edgegrad"]


@pytest.mark.parametrize("off", [{"value": 0.0}, {"mute": True}, {"vertex_group": "Some"}])
def test_a_key_that_is_switched_off_is_left_alone(cube: Any, off: dict[str, Any]) -> None:
    cube.vertex_groups.new(name="Some").add([0, 1], 1.0, "REPLACE")
    write_move(cube, moves(0), in_place=False)
    first = cube.data.shape_keys.key_blocks["Edgegrad"]
    for name, value in off.items():
        setattr(first, name, value)
    before, points = shown(cube), points_of(first)
    write_move(cube, moves(1), in_place=False)
    assert names(cube) == ["Basis", "Edgegrad", "Edgegrad.001"] and np.array_equal(points_of(first), points)
    assert shown(cube) == pytest.approx(before + moves(1), abs=1e-6)
    write_move(cube, moves(2), in_place=False)
    assert len(names(cube)) == 3 and np.array_equal(points_of(first), points)


def test_a_new_key_is_relative_to_the_active_one(cube: Any) -> None:
    cube.shape_key_add(name="Basis")
    smile = cube.shape_key_add(name="Smile")
    smile.points[3].co.x += 0.7
    smile.value = 0.6
    cube.active_shape_key_index = 1
    before = shown(cube)
    write_move(cube, moves(0), in_place=False)
    key = cube.data.shape_keys.key_blocks["Edgegrad"]
    assert key.relative_key == smile and points_of(key) == pytest.approx(points_of(smile) + moves(0), abs=1e-6)
    assert shown(cube) == pytest.approx(before + moves(0), abs=1e-6)


def test_in_place_moves_all_keys(cube: Any) -> None:
    write_move(cube, moves(0), in_place=False)
    before = shown(cube)
    write_move(cube, moves(1), in_place=True)
    assert shown(cube) == pytest.approx(before + moves(1), abs=1e-6) and names(cube) == ["Basis", "Edgegrad"]
