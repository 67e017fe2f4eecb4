"""Bodies with a scale of zero along an axis, as in Cycles: unseen, or black where faces lie exactly on each other."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
from tests.support.scenes import blender_scenes as bs


def body(shape: str, rotation: tuple[float, float, float] = (0.0, 0.0, 0.0), **inputs: Any) -> Any:
    """A body that is flattened along its z axis, at an odd height, from above in an even sky."""
    scene = bs.empty(24)
    scene.cycles.samples = 16
    scene.cycles.max_bounces = 2
    bs.camera((0.0, 0.0, 6.37))
    bs.world((1.0, 1.0, 1.0))
    paint = bs.material("Paint", (0.8, 0.5, 0.3), **inputs)
    if shape == "ball":
        bpy.ops.mesh.primitive_uv_sphere_add(segments=12, ring_count=6)
        data = bpy.context.object.data
        bpy.data.objects.remove(bpy.context.object)
        data.materials.append(paint)
    elif shape == "box":  # without a lid
        cube = bs.cube("Cube")
        lidless = [tuple(face.vertices) for face in cube.polygons if face.normal.z < 0.5]
        data = bs.mesh("Body", [tuple(v.co) for v in cube.vertices], lidless, paint)
    else:
        data = bs.cube("Body", paint) if shape == "cube" else bs.plane("Body", 2.0, paint)
    return bs.add("Body", data, (0.1, 0.2, 1.37), rotation, (0.8, 0.8, 0.0))


def middle(picture: Any) -> float:
    return float(picture[10:14, 10:14].mean())


def ours() -> tuple[float, str]:
    made = bs.export()
    picture = edgegrad.Renderer(made.scene).render(spp=64, max_depth=made.settings.max_depth)
    return middle(picture), " ".join(made.report.lines)


@pytest.mark.parametrize("shape", ["cube", "ball"])
@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_closed_bodies_across_an_axis_are_black(shape: str, turn: float, tmp_path: Path) -> None:
    body(shape, (0.0, 0.0, turn))
    found, lines = ours()
    assert found == 0.0 and "it is black, since they shadow each other" in lines
    assert middle(bs.cycles(tmp_path)) == 0.0


def test_rounding_decides_about_tilted_bodies(tmp_path: Path) -> None:
    body("cube", (0.5, 0.3, 0.0))
    found, lines = ours()
    assert found > 0.3 and "rounding decides which of them is seen" in lines
    assert 0.01 < middle(bs.cycles(tmp_path)) < 0.5


def test_sheets_have_no_other_side(tmp_path: Path) -> None:
    body("sheet")
    found, lines = ours()
    assert "scale of zero" not in lines
    np.testing.assert_allclose(found, middle(bs.cycles(tmp_path)), rtol=0.02)


def test_open_bodies_may_have_a_single_layer(tmp_path: Path) -> None:
    body("box")
    found, lines = ours()
    assert "rounding decides" in lines
    np.testing.assert_allclose(found, middle(bs.cycles(tmp_path)), rtol=0.02)


def test_what_lets_light_through_is_not_black() -> None:
    body("cube", node="ShaderNodeBsdfTransparent")
    found, lines = ours()
    assert found > 0.3 and "rounding decides" in lines


def test_emission_is_kept() -> None:
    body("cube", node="ShaderNodeEmission")
    assert ours()[0] > 0.3


@pytest.mark.parametrize("shape", ["cube", "sheet"])
def test_flattened_bodies_that_share_their_mesh_are_not_seen(shape: str, tmp_path: Path) -> None:
    ob = body(shape)
    ob.rotation_euler = (0.3, 0.2, 0.0)
    bs.add("Twin", ob.data, (50.0, 0.0, 0.0))
    found, lines = ours()
    assert "object 'Body': has a scale of zero along an axis" in lines and "does not show it" in lines
    np.testing.assert_allclose((found, middle(bs.cycles(tmp_path))), 1.0, rtol=1e-3)
    bpy.data.objects["Twin"].hide_render = True
    assert ours()[0] < 0.95
