"""Blender's units: what is exported renders as Cycles renders it, with direct light only."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
from tests.support.scenes import blender_scenes as bs


@pytest.fixture(autouse=True)
def _scene() -> None:
    bs.empty()
    bs.camera()


def both(folder: Any, spp: Any = 256) -> Any:
    """Pictures by Edgegrad and by Cycles."""
    return edgegrad.render(bs.export().scene, spp=spp), bs.cycles(folder)


SETTINGS: dict[str, tuple[str, dict[str, Any]]] = {
    "area square": ("AREA", {"size": 1.5, "energy": 100.0}),
    "area rectangle": ("AREA", {"shape": "RECTANGLE", "size": 1.5, "size_y": 0.5, "energy": 100.0}),
    "area disk": ("AREA", {"shape": "DISK", "size": 1.5, "energy": 100.0}),
    "area ellipse": ("AREA", {"shape": "ELLIPSE", "size": 1.5, "size_y": 0.5, "energy": 100.0}),
    "area scaled": ("AREA", {"size": 1.0, "energy": 100.0, "scale": (2, 0.5, 3)}),
    "area mirrored": ("AREA", {"size": 1.0, "energy": 100.0, "scale": (-1, 1, 1)}),
    "point": ("POINT", {"energy": 1000.0, "color": (1, 0.5, 0.25)}),
    "point scaled": ("POINT", {"energy": 1000.0, "scale": (2, 2, 2)}),
    "sun": ("SUN", {"energy": 3.0, "scale": (2, 2, 2)}),
}


@pytest.mark.parametrize("name", SETTINGS)
def test_light_has_the_power_it_has_in_cycles(name: Any, tmp_path: Any) -> None:
    kind, settings = SETTINGS[name]
    bs.light(kind, location=(0.5, 0, 4), rotation=(0.1, 0.3, 0), **settings)
    bs.add("Ground", bs.plane("Ground", 20.0, bs.material("Grey")))
    ours, theirs = both(tmp_path)
    assert ours.mean(axis=(0, 1)) == pytest.approx(theirs.mean(axis=(0, 1)), rel=3e-3)
    assert np.abs(ours - theirs).mean() < 0.01 * theirs.mean()


@pytest.mark.skipif(bpy.app.version < (4, 5, 0), reason="lights have exposure and temperature from Blender 4.5 on")
@pytest.mark.parametrize("kind", ["AREA", "POINT", "SUN"])
@pytest.mark.parametrize("settings", [{"exposure": 1.5}, {"use_temperature": True, "temperature": 3000.0}])
def test_exposure_and_temperature(kind: Any, settings: Any, tmp_path: Any) -> None:
    bs.light(kind, location=(0.5, 0, 4), energy=30.0, **settings)
    bs.add("Ground", bs.plane("Ground", 20.0, bs.material("Grey")))
    ours, theirs = both(tmp_path)
    assert ours.mean(axis=(0, 1)) == pytest.approx(theirs.mean(axis=(0, 1)), rel=3e-3)


def test_area_light_is_neither_seen_nor_shadows_and_shines_one_way(tmp_path: Any) -> None:
    bs.light("AREA", "Between", location=(0, 0, 2), size=1.0, energy=50.0)
    bs.light("POINT", "Above", location=(0, 0, 4), energy=500.0)
    bs.light("AREA", "Upwards", location=(1, 0, 1), rotation=(np.pi, 0, 0), size=1.0, energy=50.0)
    bs.add("Ground", bs.plane("Ground", 20.0, bs.material("Grey")))
    ours, theirs = both(tmp_path)
    assert ours.mean() == pytest.approx(theirs.mean(), rel=3e-3)
    assert np.abs(ours - theirs).mean() < 0.02 * theirs.mean()


@pytest.mark.parametrize("turned", [False, True])
def test_emission_shines_on_both_sides(turned: Any, tmp_path: Any) -> None:
    emitter = bs.material("Lamp", (1, 0.5, 0.25), "ShaderNodeEmission", Strength=3.0)
    bs.add("Lamp", bs.plane("Lamp", 1.0, emitter), (0.4, 0, 1), (np.pi * turned, 0, 0))
    bs.add("Ground", bs.plane("Ground", 20.0, bs.material("Grey")))
    ours, theirs = both(tmp_path, 1024)
    assert ours.max(axis=(0, 1)) == pytest.approx(theirs.max(axis=(0, 1)), rel=1e-3)
    assert ours.mean(axis=(0, 1)) == pytest.approx(theirs.mean(axis=(0, 1)), rel=5e-3)


def test_principled_without_specular_is_diffuse(tmp_path: Any) -> None:
    bs.light("SUN", energy=3.0)
    made = bs.material("Plain", (0.2, 0.4, 0.6), "ShaderNodeBsdfPrincipled", **{"Specular IOR Level": 0.0})
    bs.add("Ground", bs.plane("Ground", 20.0, made))
    assert bs.export().report.lines == []
    ours, theirs = both(tmp_path)
    assert ours == pytest.approx(theirs, rel=1e-3)


def test_world_and_faces_without_material(tmp_path: Any) -> None:
    bs.world((0.1, 0.2, 0.3), 2.0)
    bs.add("Ground", bs.plane("Ground", 2.0))
    ours, theirs = both(tmp_path)
    assert ours[0, 0] == pytest.approx([0.2, 0.4, 0.6], rel=1e-5)
    assert np.abs(ours - theirs).mean() < 0.01 * theirs.mean()


def test_whole_scene_within_noise(tmp_path: Any) -> None:
    """Shadows, several materials, a world, a shifted camera and a mirrored object at once."""
    scene = bs.empty(64)
    ob = bs.camera((3, -5, 3), (1.1, 0, 0.5))
    ob.data.shift_x, ob.data.shift_y = 0.1, -0.05
    scene.render.resolution_x = 80
    bs.world((0.3, 0.4, 0.5), 0.5)
    bs.light("AREA", location=(2, -1, 4), rotation=(0.3, 0.4, 0), size=1.0, energy=200.0)
    bs.light("POINT", "Bulb", location=(-2, -2, 2), energy=100.0)
    bs.add("Ground", bs.plane("Ground", 20.0, bs.material("Grey")))
    bs.add("Cube", bs.cube("Cube", bs.material("Red", (0.7, 0.2, 0.1))), (0, 0, 1.2), (0.2, 0.3, 0.4), (-1, 0.8, 0.6))
    scene.cycles.samples = 256
    ours, theirs = both(tmp_path)
    blocks = (ours - theirs).reshape(8, 8, 10, 8, 3).mean(axis=(1, 3))
    assert np.abs(blocks).max() < 0.02 * theirs.mean() + 0.01
    assert ours.mean() == pytest.approx(theirs.mean(), rel=2e-3)
