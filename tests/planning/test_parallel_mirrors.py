"""Suns in flat mirrors that parallel rays see: the picture jumps at single values of the parameters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from edgegrad import Camera, Material, Renderer, Scene, SunLight, plan
from tests.support import shapes
from tests.support.picture_differences import need_every_table
from tests.support.small_scenes import camera, matte, rectangle

SUN = "lights.sun.direction"


def scene(tilt: float = 0.0, roughness: float = 0.0, kind: str = "ORTHOGRAPHIC") -> Scene:
    """A mirror seen by parallel rays, which shows the sun if it is tilted by less than the sun's radius."""
    seen = replace(camera((0.0, 2.0, 2.0), (0, 0, 0), size=4), kind=kind, ortho_width=0.5)
    assert isinstance(seen, Camera)
    sun = SunLight(np.array([np.sin(tilt), -1.0, 1.0]), 2.0, angle=0.08)
    return Scene(seen, {"sheet": rectangle((0, 0, 0), (0, 0, 0.6), (0.6, 0, 0), "metal")},
                 {"metal": Material(metallic=1.0, roughness=roughness), "clay": matte(0.5, 0.5, 0.5)}, {"sun": sun})


def named(made: Scene, path: str = SUN) -> bool:
    return any("appear or vanish at once" in line for line in plan(made, [path]).missing)


def test_the_picture_jumps() -> None:
    need_every_table()
    bright, dark = (Renderer(scene(tilt)).render(spp=4) for tilt in (0.05, 0.06))
    assert np.all(bright > 100.0) and np.all(dark == 0.0)
    assert named(scene())


@pytest.mark.parametrize("what", ["perspective", "rough", "smooth-shaded", "matte", "still"])
def test_nothing_is_said_where_it_does_not(what: str) -> None:
    need_every_table()
    made, path = scene(roughness=0.2 if what == "rough" else 0.0,
                       kind="PERSPECTIVE" if what == "perspective" else "ORTHOGRAPHIC"), SUN
    if what == "smooth-shaded":
        vertices, faces = shapes.ball(1, 0.5)
        made.meshes["sheet"] = replace(made.meshes["sheet"], vertices=vertices, faces=faces, smoothing=faces)
    elif what == "matte":
        made.meshes["sheet"] = replace(made.meshes["sheet"], materials=("clay",))
    elif what == "still":
        path = "materials.metal.base_color"
    assert not named(made, path)
