"""The Wireframe node: how much of a square its lines cover, in metres and in pixels."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
from tests.support.scenes import blender_scenes as bs

PIXELS = 32
# Radius of the circle in a right triangle with legs of 2: half the square from -1 to 1.
INRADIUS = 2.0 - np.sqrt(2.0)


def square(size: float, pixels: bool, **place: Any) -> Any:
    """A square of edge 2 whose lines glow, and a camera whose picture it fills if it lies flat."""
    scene = bs.empty(PIXELS)
    camera = bs.camera()
    camera.data.type, camera.data.ortho_scale = "ORTHO", 2.0
    glow = bs.material("Lines", (1.0, 1.0, 1.0), "ShaderNodeEmission")
    tree = glow.node_tree
    wire = tree.nodes.new("ShaderNodeWireframe")
    wire.use_pixel_size, wire.inputs["Size"].default_value = pixels, size
    tree.links.new(wire.outputs[0], bs.shader(glow).inputs["Strength"])
    return scene, bs.add("Square", bs.plane("Square", 2.0, glow), **place)


def covered() -> tuple[float, list[str]]:
    """Share of the picture that glows, and the lines of the export's report."""
    made = bs.export()
    picture = edgegrad.Renderer(made.scene).render(spp=1024, seed=1, max_depth=1)
    return float(picture.mean()), made.report.lines


def share(width: float, inradius: float = INRADIUS) -> float:
    """What lines of this width cover of triangles with this inscribed circle: they leave a similar triangle free."""
    return 1.0 - (1.0 - 0.5 * width / inradius) ** 2


def near(found: float, expected: float) -> bool:
    # Sobol' points in a pixel: an error like that of the lines' length in pixels over the root of samples per pixel.
    return abs(found - expected) < 1e-3


def test_lines_in_metres() -> None:
    square(0.2, False)
    found, lines = covered()
    assert near(found, share(0.2)) and not any("Wireframe" in line for line in lines)


def test_lines_in_metres_do_not_scale_with_the_object() -> None:
    scene, _ = square(0.2, False, scale=(0.5, 0.5, 0.5))
    scene.camera.data.ortho_scale = 1.0
    assert near(covered()[0], share(0.2, 0.5 * INRADIUS))


def test_uneven_scale_is_named() -> None:
    square(0.1, False, scale=(1.0, 0.5, 1.0))
    assert any("'Square', whose scale differs between axes" in line for line in covered()[1])


def test_lines_in_pixels() -> None:
    square(3.0, True)
    found, lines = covered()
    assert near(found, share(3.0 * 2.0 / PIXELS))
    assert any("as wide as their distance from the camera" in line for line in lines)


def test_lines_in_pixels_on_tilted_faces() -> None:
    """Cycles measures a pixel by two vectors of its size along the face, seen from the camera."""
    tilt = 1.1
    square(3.0, True, rotation=(tilt, 0.0, 0.0))
    normal, view = np.array([0.0, -np.sin(tilt), np.cos(tilt)]), np.array([0.0, 0.0, 1.0])
    first = np.cross((1.0, 1.0, 1.0), normal)
    first /= np.linalg.norm(first)
    along = np.array([first @ view, np.cross(normal, first) @ view])
    width = 3.0 * 2.0 / PIXELS * np.sqrt(1.0 - along**2).mean()
    assert near(covered()[0], np.cos(tilt) * share(width))


def test_strands_have_no_lines() -> None:
    """The node is 0 on hair, as in Cycles."""
    square(0.2, False)
    glow = bpy.data.materials["Lines"]
    bpy.data.objects.remove(bpy.data.objects["Square"])
    data = bpy.data.hair_curves.new("Hair")
    data.add_curves([2])
    data.attributes["position"].data.foreach_set("vector", [-0.9, 0.0, 0.0, 0.9, 0.0, 0.0])
    data.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", [0.3, 0.3])
    data.materials.append(glow)
    bs.add("Hair", data)
    assert covered()[0] == 0.0
