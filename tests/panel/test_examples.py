"""The examples for Blender open with their fit set up, and it starts."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad_addon
from blend_examples import ready_to_fit
from edgegrad_addon import preflight, properties, setups
from edgegrad_addon.session import Session


@pytest.fixture(autouse=True)
def addon() -> Iterator[None]:
    """Register the add-on."""
    edgegrad_addon.register()
    yield
    edgegrad_addon.unregister()


@pytest.mark.parametrize("name", ready_to_fit.EXAMPLES)
def test_an_example_opens_ready_to_fit(name: str, tmp_path: Path) -> None:
    built = ready_to_fit.build(name, tmp_path, size=48, samples=4)
    # The folder may be moved: the pictures are named relative to the .blend.
    moved = built.parent.rename(tmp_path / "moved") / built.name
    bpy.ops.wm.open_mainfile(filepath=str(moved))
    obstacle = preflight.obstacle(bpy.context)
    assert obstacle is None, obstacle
    request = properties.request(bpy.context)
    assert len(request.pictures) == (len(ready_to_fit.build_sculpt.VIEWS) if name == "shape" else 1)
    assert bpy.context.scene.edgegrad.iterations >= 100 and ready_to_fit.EXAMPLES[name].task in setups.SETUPS
    assert Session.prepare(bpy.context, request).targets
