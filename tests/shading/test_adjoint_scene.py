"""Derivatives of shading code that reads the scene: surfaces, normal maps, camera, environment and lights."""

from __future__ import annotations

import pytest

from edgegrad.tables.lights import LINEAR_CONE, SMOOTH_CONE, SPREAD
from tests.support.scene_probe import (
    BENT_NORMAL,
    CAMERA,
    ENVIRONMENT,
    EQUIRECTANGULAR,
    EQUISOLID,
    LIGHT,
    ORTHOGRAPHIC,
    PERSPECTIVE,
    POLYNOMIAL,
    SURFACE,
    Probe,
)


@pytest.mark.parametrize("instances", [False, True])
def test_surfaces(instances: bool) -> None:
    where = ("vertices", "normals", "a") + (("instance_to_world",) if instances else ())
    Probe(SURFACE, instances=instances).check(where)
    Probe(SURFACE, smooth=False, instances=instances).check(tuple(name for name in where if name != "normals"))


@pytest.mark.parametrize("tangents", [False, True])
@pytest.mark.parametrize("instances", [False, True])
def test_normal_maps(tangents: bool, instances: bool) -> None:
    where = ("normals", "attributes", "a", "b") + (("vertices",) if not tangents else ())
    Probe(BENT_NORMAL, tangents=tangents, instances=instances).check(
        where + (("instance_to_world",) if instances else ())
    )


@pytest.mark.parametrize("blades", [0, 5])
@pytest.mark.parametrize("lens", [0.0, 0.2])
@pytest.mark.parametrize("camera", [PERSPECTIVE, ORTHOGRAPHIC, EQUIRECTANGULAR, EQUISOLID, POLYNOMIAL])
def test_cameras(camera: int, lens: float, blades: int) -> None:
    names = ("camera", "a", "b") if lens and camera in (PERSPECTIVE, ORTHOGRAPHIC) else ("camera", "a")
    Probe(CAMERA, camera=camera, lens=lens, blades=blades).check(names, step=2e-3)


def test_environments() -> None:
    Probe(ENVIRONMENT).check(("environment_pixels", "environment", "environment_rotation", "b"))
    Probe(ENVIRONMENT, image=False).check(("environment",))


@pytest.mark.parametrize("flags", [0, SMOOTH_CONE, LINEAR_CONE, SPREAD])
def test_lights(flags: int) -> None:
    Probe(LIGHT, flags=flags).check(("light_params", "a", "b") if flags else ("light_params", "a"))
