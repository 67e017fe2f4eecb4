"""The pixels of an image are fitted and written back, as they are stored."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
from edgegrad import images
from edgegrad_addon.parameters import Names
from edgegrad_addon.problem import Problem
from edgegrad_addon.session import Picture, Request, Session
from edgegrad_addon.write_back import image_undo
from edgegrad_addon.write_back.destinations import StoredEntry
from edgegrad_addon.write_back.image_pixels import write_pixels
from tests.support.scenes import blender_scenes as bs

SIDE = 4


def poster(floats: bool) -> tuple[Any, Any]:
    """A glowing square that fills the picture with an image, and the image."""
    scene = bs.empty(4 * SIDE)
    bs.camera((0, 0, 6), name="Front")
    bpy.data.cameras["Front"].type, bpy.data.cameras["Front"].ortho_scale = "ORTHO", 2.0
    image = bpy.data.images.new("Poster", SIDE, SIDE, float_buffer=floats, alpha=False)
    rows = np.random.default_rng(4).uniform(0.1, 0.9, (SIDE, SIDE, 3))
    image.pixels.foreach_set(np.concatenate([rows, np.ones((SIDE, SIDE, 1))], 2).astype(np.float32).ravel())
    image.pack()
    material = bs.material("Glow", (1.0, 1.0, 1.0), "ShaderNodeEmission")
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    tree.links.new(node.outputs["Color"], bs.shader(material).inputs["Color"])
    bpy.ops.mesh.primitive_plane_add()
    bpy.context.object.data.materials.append(material)
    return scene, image


def stored(image: Any) -> Any:
    return np.array(image.pixels, np.float32).reshape(SIDE, SIDE, -1)


@pytest.mark.parametrize("floats", [False, True])
def test_pixels_are_found_and_written_as_they_are_stored(floats: bool, tmp_path: Path) -> None:
    _, image = poster(floats)
    target = tmp_path / "target.exr"
    images.write_image(target, edgegrad.render(bs.export().scene, spp=64))
    truth = stored(image)
    image.pixels.foreach_set(np.where(np.arange(4) < 3, np.float32(0.5), truth).astype(np.float32).ravel())
    request = Request([Picture("Front", str(target))], Names(image=("Poster",)), iterations=150, samples=4)
    session = Session.prepare(bpy.context, request)
    result = session.run()
    assert session.write(result)
    assert image.packed_file is not None and not image.is_dirty
    assert np.abs(stored(image) - truth).max() < 0.05
    assert np.abs(0.5 - truth)[..., :3].max() > 0.3


def test_pixels_that_are_kept_are_written_later() -> None:
    _, image = poster(False)
    wanted = np.random.default_rng(5).integers(0, 256, (SIDE, SIDE, 3)) / 255.0
    StoredEntry({"image": "Poster", "codes": True, "pixels": wanted.tolist()}).write()
    assert np.abs(stored(image)[::-1, :, :3] - wanted).max() < 1e-6


@pytest.mark.parametrize("saved", [True, False])
def test_an_undo_brings_pixels_back(saved: bool) -> None:
    """Those of the packed file, or those that no file has."""
    _, image = poster(False)
    packed = stored(image)
    before = packed if saved else np.roll(packed, 1, axis=0)
    if not saved:
        image.pixels.foreach_set(before.ravel())
    write_pixels(image, np.zeros((SIDE, SIDE, 3)), codes=True)
    assert stored(image)[..., :3].max() == 0.0
    # Blender's undo: the packed file is that of before, the pixels are those of after.
    image.pixels.foreach_set(packed.ravel())
    image.pack()
    image.pixels.foreach_set(np.zeros(packed.size, np.float32))
    image_undo.restore()
    assert np.array_equal(stored(image), before)


def test_images_that_cannot_be_fitted_are_refused_by_name() -> None:
    _, image = poster(False)
    with pytest.raises(Problem, match=r"image 'Banner': no image of this name is rendered \(known: 'Poster'\)"):
        Names(image=("Banner",)).paths(bs.export())
    scene = bpy.context.scene
    scene.render.use_simplify, scene.cycles.texture_limit_render = True, "128"
    image.scale(256, 256)
    with pytest.raises(Problem, match="image 'Poster': is rendered with 128 x 128 of its 256 x 256 pixels"):
        Names(image=("Poster",)).paths(bs.export())
