"""Thin films of the shaders that have them: numbers and textures, and none where the thickness is 0."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

from tests.support.scenes import blender_scenes as bs


@pytest.mark.parametrize("kind", ["Principled", "Glass", "Metallic"])
def test_thin_films(kind: str) -> None:
    bs.empty()
    bs.camera()
    coated = bs.material("M", node=f"ShaderNodeBsdf{kind}")
    bs.add("Cube", bs.cube("Cube", coated))
    shader, tree = bs.shader(coated), coated.node_tree
    if "Thin Film IOR" not in shader.inputs:
        assert bpy.app.version < (5, 0, 0) and kind != "Principled"
        pytest.skip("glass and metal have thin films from Blender 5.0 on")
    shader.inputs["Thin Film IOR"].default_value = 1.6
    m = bs.export().scene.materials["M"]
    assert m.thin_film_thickness == 0.0 and m.textures == {}
    shader.inputs["Thin Film Thickness"].default_value = 450.0
    made = bs.export()
    m = made.scene.materials["M"]
    assert (m.thin_film_thickness, m.thin_film_ior) == pytest.approx((450.0, 1.6))
    assert not any("film" in line for line in made.report.lines)
    checker = tree.nodes.new("ShaderNodeTexChecker")
    tree.links.new(checker.outputs["Fac"], shader.inputs["Thin Film Thickness"])
    assert set(bs.export().scene.materials["M"].textures) == {"thin_film_thickness"}
