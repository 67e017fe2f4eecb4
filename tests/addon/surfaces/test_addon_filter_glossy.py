"""Cycles' Filter Glossy: its value travels, and what is not read of it is told where it can matter."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

from edgegrad_addon.export.surroundings.settings import read_settings, render_export
from tests.support.scenes import blender_scenes as bs

METAL: dict[str, Any] = {"node": "ShaderNodeBsdfPrincipled", "Metallic": 1.0}


@pytest.fixture(name="scene", autouse=True)
def _scene() -> Any:
    scene = bs.empty()
    bs.camera()
    cycles = scene.cycles
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = 2
    return scene


def told() -> bool:
    made = bs.export()
    assert made.report.lines == []
    return any("'Filter Glossy'" in line for line in made.report.readings)


def show(**inputs: Any) -> Any:
    made = bs.material("M", **inputs)
    bs.add("Ball", bs.cube("Ball", made))
    return made


def test_the_value_is_exported(scene: Any) -> None:
    assert bs.export().settings.bounces.filter_glossy == 1.0  # of new files
    scene.cycles.blur_glossy = 0.3
    assert bs.export().settings.bounces.filter_glossy == pytest.approx(0.3)
    scene.cycles.blur_glossy = 0.0
    assert bs.export().settings.bounces.filter_glossy == 0.0
    assert read_settings(SimpleNamespace()).bounces.filter_glossy == 1.0  # Blender's default


def test_pictures_of_an_export_are_filtered(scene: Any) -> None:
    """A mirror throws the light of a lamp without size on the floor only where it is blurred."""
    bs.add("Floor", bs.plane("Floor", 20.0, bs.material("Floor")))
    mirror = bs.material("Mirror", (0.9, 0.9, 0.9), "ShaderNodeBsdfAnisotropic", Roughness=0.0)
    bs.add("Mirror", bs.plane("Mirror", 20.0, mirror), (-2.2, 0, 0), (0, np.pi / 2, 0))
    bs.light("POINT", energy=50.0, location=(0, 0, 2))

    def mean() -> float:
        made = bs.export()
        return float(render_export(made.scene, made.settings, 64).mean())

    blurred = mean()
    scene.cycles.blur_glossy = 0.0
    assert blurred > 1.05 * mean()


@pytest.mark.parametrize(
    ("inputs", "expected"),
    [({}, False),  # diffuse
     ({**METAL, "Roughness": 0.5}, True), ({**METAL, "Roughness": 0.1}, False), ({**METAL, "Roughness": 0.9}, False),
     ({"node": "ShaderNodeBsdfPrincipled", "Roughness": 0.5}, False),  # weak gloss
     ({"node": "ShaderNodeBsdfPrincipled", "Transmission Weight": 1.0, "Roughness": 0.3}, True),
     ({"node": "ShaderNodeBsdfGlass", "Roughness": 0.0}, False),
     ({"node": "ShaderNodeBsdfGlass", "Roughness": 0.4}, True),
     ({"node": "ShaderNodeBsdfRefraction", "Roughness": 0.4}, True),
     ({"node": "ShaderNodeBsdfAnisotropic", "Roughness": 0.3}, True)],
)  # fmt: skip
def test_rough_gloss_is_told(inputs: dict[str, Any], expected: bool) -> None:
    show(**inputs)
    assert told() == expected


def test_textured_roughness_is_told() -> None:
    made = show(**METAL, Roughness=0.1)
    tree = made.node_tree
    tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs[0], bs.shader(made).inputs["Roughness"])
    assert told()


def test_wide_lobes_are_told_where_they_see_narrow_ones() -> None:
    """Cycles leaves lobes alone that are wider than it would make them."""
    show(**METAL, Roughness=0.9)
    assert not told()
    coated = bs.material("Coated", node="ShaderNodeBsdfPrincipled", Roughness=1.0, **{"Coat Weight": 1.0})
    bs.add("Coated", bs.cube("Coated", coated), (5, 0, 0))
    assert told()


@pytest.mark.parametrize("setting", ["blur_glossy", "max_bounces", "glossy_bounces"])
def test_nothing_is_told_where_nothing_is_blurred(setting: str, scene: Any) -> None:
    show(**METAL, Roughness=0.5)
    assert told()
    setattr(scene.cycles, setting, 0)
    assert not told()


def test_a_small_value_blurs_behind_rougher_lobes_only(scene: Any) -> None:
    """Cycles blurs behind directions of a density below the value."""
    roughness = bs.shader(show(**METAL, Roughness=0.3)).inputs["Roughness"]
    assert told()
    scene.cycles.blur_glossy = 0.01
    assert not told()
    roughness.default_value = 0.6
    assert told()
