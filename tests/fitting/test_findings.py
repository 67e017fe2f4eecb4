"""What a fit reports about its parameters."""

from __future__ import annotations

import numpy as np
import pytest

import edgegrad
from edgegrad import Target
from tests.support.fits import COLOR, ball


@pytest.mark.filterwarnings("ignore:fit. no gradient")
def test_limits_and_parameters_without_effect_are_found() -> None:
    """A target brighter than any colour can be; a lamp that is switched off says nothing about its place."""
    scene = ball()
    scene.camera.width, scene.camera.height = 12, 9
    scene.lights["lamp"].power = 0.0
    scene.materials["clay"].base_color = np.array([0.9, 0.5, 0.5])
    seen = edgegrad.render(scene, spp=16)
    result = edgegrad.fit(scene, Target(seen * (9.0, 1.0, 1.0)), [COLOR, "lights.lamp.position"], iterations=20, spp=2)
    found = {(one.path, one.kind): (one.count, one.size) for one in result.findings}
    assert found == {(COLOR, "at the upper limit"): (1, 3), ("lights.lamp.position", "open"): (3, 3)}
    said = [str(one) for one in result.findings]
    assert "the pictures say nothing about 'lights.lamp.position'" in said
    assert f"1 of 3 numbers of '{COLOR}': at the upper limit" in said
