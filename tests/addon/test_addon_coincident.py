"""Faces and lights that lie exactly on faces are reported with their share of the picture."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

from edgegrad_addon.export.coincident_faces import coincident, overlaps
from tests.support.scenes import blender_scenes as bs


@pytest.fixture(autouse=True)
def _scene() -> None:
    bs.empty()
    bs.camera((0, 0, 5))
    bs.light("POINT")


def floor(*materials: Any) -> Any:
    return bs.add("Floor", bs.plane("Floor", 20.0, *(materials or (bs.material("Grey"),))))


def reported() -> list[str]:
    return [line for line in bs.export().report.lines if "exactly" in line or "twice" in line]


@pytest.mark.parametrize("turn", [0.0, np.pi, 0.4])
def test_a_decal_is_named_with_its_share(turn: float) -> None:
    floor()
    # The picture shows a square of 3.6 metres.
    width = 2.0 * 5.0 * np.tan(0.5 * bpy.context.scene.camera.data.angle)
    bs.add("Decal", bs.plane("Decal", 0.5 * width, bs.material("Red")), (0, 0, 0), (turn if turn > 1 else 0, 0, turn))
    (line,) = reported()
    assert line.startswith("faces of object 'Decal', material 'Red': lie exactly on faces of object 'Floor', material "
                           "'Grey', on 25.0% of the picture")  # fmt: skip


def test_faces_that_are_near_or_hidden_are_not_named() -> None:
    floor()
    bs.add("Above", bs.plane("Above", 1.0, bs.material("Red")), (0, 0, 1e-4))
    bs.add("Box", bs.cube("Box", bs.material("Blue")), (2.5, 0, 1.0))
    assert not reported()


def test_neighbours_in_one_plane_are_not_named() -> None:
    for k in range(3):
        bs.add(f"Tile {k}", bs.plane(f"Tile {k}", 1.0, bs.material(f"Tile {k}")), (k - 1.0, 0, 0))
    assert not reported()


def test_planes_far_from_the_origin() -> None:
    bpy.context.scene.camera.location = (3000.0, 0, 5)
    bs.add("Floor", bs.plane("Floor", 20.0, bs.material("Grey")), (3000.0, 0, 0))
    bs.add("Decal", bs.plane("Decal", 1.0, bs.material("Red")), (3000.3, 0.1, 0), (0, 0, 0.3))
    assert len(reported()) == 1


def test_one_mesh_that_lies_on_itself() -> None:
    points = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    twice = bs.mesh("Twice", points * 2, [(0, 1, 2, 3), (4, 5, 6, 7)], bs.material("Red"), bs.material("Blue"))
    bs.add("Twice", twice)
    assert "material 'Red': lie twice at the same place" in reported()[0]
    twice.polygons[1].material_index = 1
    assert "material 'Blue': lie exactly on faces of material 'Red'" in reported()[0]


@pytest.mark.parametrize(("offset", "found"), [(0.8, True), (1.0, False), (1.2, False)])
@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_copies_of_an_array_that_overlap(offset: float, found: bool, turn: float) -> None:
    """Sides of bodies that are longer than their distance lie on each other in part."""
    ob = bs.add("Row", bs.cube("Row", bs.material("Grey")), (-0.5, 0.0, 0.0), (turn, 0.3, turn), (0.4, 0.4, 0.4))
    array = ob.modifiers.new("Array", "ARRAY")
    array.count, array.relative_offset_displace = 2, (offset, 0.0, 0.0)
    lines = reported()
    assert [("'Row'" in line and "lie twice" in line) for line in lines] == [True] * found


def test_flat_faces_of_many_triangles_are_none_that_overlap() -> None:
    """A grid, a disk of slivers around its middle, and a plate whose parts meet at corners of others."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=40, y_subdivisions=30, size=1.0, location=(0.6, 0.6, 0.0))
    bpy.ops.mesh.primitive_circle_add(vertices=64, radius=0.5, fill_type="TRIFAN", location=(-0.6, 0.6, 0.0))
    points = [(-1, -1, 0), (0, -1, 0), (1, -1, 0), (1, 0, 0), (-1, 0, 0)]
    bs.add("Plate", bs.mesh("Plate", points, [(0, 1, 4), (1, 3, 4), (1, 2, 3)]), (0, -0.1, 0), (0.2, 0.1, 0.0))
    assert not reported()


def test_a_copy_that_was_left_in_place() -> None:
    for k in range(2):
        bs.add(f"Cube {k}", bs.cube(f"Cube {k}", bs.material("Red") if k == 0 else bpy.data.materials["Red"]))
    assert len(reported()) == 1


def test_emitters_are_named_where_nobody_sees_them() -> None:
    bs.add("Ceiling", bs.plane("Ceiling", 4.0, bs.material("Grey")), (0, 0, 7))
    bs.add("Panel", bs.plane("Panel", 1.0, bs.material("Panel", (1, 1, 1), "ShaderNodeEmission")), (0, 0, 7))
    assert "where they emit light" in reported()[0]


@pytest.mark.parametrize(("height", "found"), [(2.4, True), (2.3999, False)])
def test_a_lamp_on_the_ceiling(height: float, found: bool) -> None:
    bs.add("Ceiling", bs.plane("Ceiling", 4.0, bs.material("Grey")), (0, 0, 2.4))
    bs.light("AREA", "Lamp", (0, 0, height), size=1.0)
    lines = reported()
    assert bool(lines) == found
    if found:
        assert lines[0].startswith("light 'Lamp': lies exactly on object 'Ceiling' with 100% of its area")


@pytest.mark.parametrize("search", [coincident, overlaps])
def test_scenes_with_too_many_triangles_are_told(search: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(search, "MOST_TRIANGLES", 1)
    floor()
    assert any("aren't looked for" in line for line in bs.export().report.readings)


def test_work_grows_as_the_number_of_planes_not_of_pairs(monkeypatch: pytest.MonkeyPatch) -> None:
    compared = []
    contains = coincident.contains

    def counted(corners: Any, *more: Any) -> Any:
        compared.append(len(corners))
        return contains(corners, *more)

    monkeypatch.setattr(coincident, "contains", counted)
    paints = [bs.material(f"Paint {k}") for k in range(2)]
    for k in range(100):
        bs.add(f"Tile {k}", bs.plane(f"Tile {k}", 0.2, paints[k % 2]), (0.2 * (k % 10) - 0.9, 0.2 * (k // 10) - 0.9, 0))
    assert not reported()
    assert sum(compared) < 2000


def test_a_mesh_that_lies_twice_at_the_same_place_but_for_rounding_is_named() -> None:
    points = np.array([(-1.0, -1.0, 0.0), (1.0, -1.0, 0.1), (0.3, 1.0, 0.2)])
    again = (points[::-1] * (1.0 + 2e-7)).tolist()
    bs.add("Twice", bs.mesh("Twice", [*points.tolist(), *again], [(0, 1, 2), (3, 4, 5)], bs.material("Grey")))
    (line,) = reported()
    assert "'Twice'" in line and "lie twice" in line


def test_a_body_that_is_flattened_by_its_scale_is_named_and_a_plane_is_not() -> None:
    bs.add("Plane", bs.plane("Plane", 1.0, bs.material("Grey")), (2, 0, 0), scale=(1, 1, 0))
    assert not bs.export().report.lines
    bs.add("Cube", bs.cube("Cube", bs.material("Red")), scale=(1, 1, 0))
    assert any("'Cube'" in line and "scale of zero" in line for line in bs.export().report.lines)
