"""A small scene with the add-on, and a picture, for tests of what the panel shows."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from edgegrad import images


@pytest.fixture(name="scene")
def _scene() -> Iterator[Any]:
    bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")
    import edgegrad_addon
    from tests.support.scenes import blender_scenes as bs

    bs.empty(16)
    bs.camera(name="Front")
    bs.add("Cube", bs.cube("Cube", bs.material("Clay")))
    bs.light("POINT", "Lamp")
    bpy.context.view_layer.update()
    edgegrad_addon.register()
    yield bpy.context.scene
    edgegrad_addon.unregister()


@pytest.fixture
def picture(tmp_path: Path) -> str:
    """The name of a picture of 20 x 10 pixels."""
    images.write_image(tmp_path / "a picture.exr", np.ones((10, 20, 3), np.float32))
    return str(tmp_path / "a picture.exr")
