"""The scene of tests of rendered views."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest


@pytest.fixture
def scene() -> Iterator[Any]:
    """A cube over a plane under a lamp and a world, with the add-on registered."""
    pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

    import edgegrad_addon
    from tests.support.scenes import blender_scenes as bs

    made = bs.empty(24)
    edgegrad_addon.register()
    bs.camera((0.3, -0.4, 5.0), (0.1, 0.05, 0.02))
    bs.light("POINT")
    bs.world((0.1, 0.2, 0.3))
    bs.add("Cube", bs.cube("Cube", bs.material("Red", (0.8, 0.3, 0.2))))
    bs.add("Plane", bs.plane("Plane", 4.0, bs.material("Green", (0.2, 0.4, 0.3))), (0, 0, -2))
    yield made
    edgegrad_addon.unregister()
