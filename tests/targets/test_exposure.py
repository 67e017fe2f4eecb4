"""Exposure between a scene and a target: Blender's film exposure, exposure and gamma of its view transform."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
from edgegrad import images
from edgegrad_addon.parameters import Names
from edgegrad_addon.session import Picture, Request, Session
from tests.support.scenes import blender_scenes as bs
from tests.targets.cycles_targets import TRUTH, ball, recolored, saved


@pytest.mark.parametrize("film", [2.0, 0.5])
def test_film_exposure_and_exposure_of_the_view_are_both_undone(film: float, tmp_path: Any) -> None:
    """Film exposure is in the light of an EXR, too; exposure and gamma of the view only in coded pictures."""
    scene = ball(size=24)
    scene.cycles.samples = 256
    scene.cycles.film_exposure = film
    scene.view_settings.exposure, scene.view_settings.gamma = -0.5, 1.2
    coded = saved(tmp_path / "agx.png", scene)
    linear = saved(tmp_path / "linear.exr", scene, "32", "OPEN_EXR")
    theirs = images.read_image(linear)[..., :3].mean(axis=(0, 1))
    assert edgegrad.render(bs.export().scene, spp=64).mean(axis=(0, 1)) == pytest.approx(theirs, rel=3e-3)
    recolored()
    errors = {}
    for path in (coded, linear):
        request = Request([Picture("Front", str(path))], Names(base_color=("Clay",)), iterations=100, samples=16)
        result = Session.prepare(bpy.context, request).run()
        errors[path.suffix] = np.abs(result.values["materials.Clay.base_color"] - TRUTH).max()
    assert errors[".exr"] < 0.01 and errors[".png"] < 0.015, errors
