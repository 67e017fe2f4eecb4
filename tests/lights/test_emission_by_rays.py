"""Emission that depends on the kind of ray: light sampling sees it as a ray of no kind does, like Cycles."""

from __future__ import annotations

import numpy as np
import pytest

import edgegrad
from edgegrad import expression as e
from tests.support.small_scenes import box, camera, glowing, matte, need, rectangle

need("native")

NOT_CAMERA = e.Math("SUBTRACT", 1.0, e.LightPath("CAMERA"))


def lit_floor(emission: e.Expression, floor: edgegrad.Material | None = None) -> edgegrad.Scene:
    """A floor under a lamp that the camera does not see, with a box that casts a shadow."""
    lamp = glowing(1.0)
    lamp.textures = {"emission": emission}
    return edgegrad.Scene(
        camera((0, 2.5, 2.5), (0, 0, 0), 16, 0.6),
        {"floor": rectangle((0, 0, 0), (0, 0, 3), (3, 0, 0), "floor"),
         "box": box((0.2, 0.3, 0), (0.2, 0.2, 0.2), "box"),
         "lamp": rectangle((0.1, 2.0, -1.5), (0.6, 0, 0), (0, 0.3, 0.6), "lamp")},
        {"floor": floor or matte(0.8, 0.8, 0.8), "box": matte(0.5, 0.6, 0.7), "lamp": lamp},
    )  # fmt: skip


def five_times(expression: e.Expression | float) -> e.Expression:
    return e.Math("MULTIPLY", 5.0, expression)


GLOSSY = edgegrad.Material(np.full(3, 0.8), kind="GLOSSY", roughness=0.6)


@pytest.mark.parametrize("floor", [None, GLOSSY])
def test_emission_for_the_camera_lights_nothing(floor: edgegrad.Material | None) -> None:
    renderer = edgegrad.Renderer(lit_floor(five_times(e.LightPath("CAMERA")), floor))
    assert not renderer.render(spp=64, max_depth=3, seed=2).any()


def test_light_samples_are_of_no_kind() -> None:
    """A Lambertian surface at a path's end takes light samples alone, which are no diffuse rays."""
    for kind in ("DIFFUSE", "GLOSSY", "TRANSMISSION", "SHADOW"):
        renderer = edgegrad.Renderer(lit_floor(five_times(e.LightPath(kind))))
        assert not renderer.render(spp=16, max_depth=2, seed=1).any(), kind


@pytest.mark.parametrize("floor", [None, GLOSSY])
@pytest.mark.parametrize("path", ["meshes.box.vertices", "meshes.lamp.vertices", "camera.to_world"])
def test_emission_hidden_from_the_camera_has_the_derivatives_of_plain_emission(
    floor: edgegrad.Material | None, path: str
) -> None:
    """Every part of the derivative looks the emission up at the same points as the plain one."""

    def derivative(scene: edgegrad.Scene) -> np.ndarray:
        old = scene.camera.to_world if path.startswith("camera") else scene.meshes[path.split(".")[1]].vertices
        tangent = np.zeros(old.shape)
        tangent[:3 if path.startswith("camera") else None, -1 if path.startswith("camera") else 0] = 1.0
        return edgegrad.Renderer(scene).render_forward({path: tangent}, spp=256, max_depth=3, seed=2)

    plain, hidden = (derivative(lit_floor(five_times(share), floor)) for share in (1.0, NOT_CAMERA))
    assert np.abs(plain).max() > 0.1
    np.testing.assert_allclose(hidden, plain, rtol=1e-4, atol=1e-4 * np.abs(plain).max())
