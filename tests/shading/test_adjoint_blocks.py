"""Steps whose derivatives are written by hand (native/adjoint/blocks.h) beside differences of the plain formulas."""

from __future__ import annotations

import pytest

from tests.support.scene_probe import Probe

MET_POINT, SEGMENTS, REFLECTION = range(5, 8)


@pytest.mark.parametrize("instances", [False, True])
def test_points_that_rays_meet(instances: bool) -> None:
    names = ("vertices", "a", "b") + (("instance_to_world",) if instances else ())
    Probe(MET_POINT, instances=instances).check(names)


def test_segments() -> None:
    Probe(SEGMENTS).check(("vertices", "a", "b"))


def test_diffuse_reflection() -> None:
    Probe(REFLECTION).check(("vertices", "a", "b"))
