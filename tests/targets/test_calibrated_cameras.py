"""Calibrations in Blender: cameras see what they saw, and distorted photographs are targets."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad_addon
from edgegrad import Renderer, images
from edgegrad.calibration import Lens, read_calibration
from edgegrad.fitting.silhouettes import silhouette_scene
from edgegrad.fitting.targets import views
from edgegrad_addon.export import export_scene
from edgegrad_addon.parameters import Names
from edgegrad_addon.problem import Problem
from edgegrad_addon.session import Picture, Request, Session
from edgegrad_addon.targets.calibrated_cameras import LENS, add_cameras, lens_of
from tests.support.scenes import blender_scenes as bs
from tests.targets.cycles_targets import TRUTH, ball, fitted_color

BENT = {"w": 64, "h": 48, "fl_x": 90.0, "fl_y": 94.0, "cx": 34.0, "cy": 22.0, "k1": -0.6, "k2": 0.2, "p1": 0.01,
        "p2": -0.01}  # fmt: skip


def pose(turn: float) -> Any:
    """A camera that looks down at the origin, turned about the x axis."""
    c, s = np.cos(turn), np.sin(turn)
    out = np.eye(4)
    out[:3, :3] = [[1, 0, 0], [0, c, -s], [0, s, c]]
    out[:3, 3] = out[:3, :3] @ [0.0, 0.0, 4.0]
    return out


def calibration(folder: Path, **changes: Any) -> Path:
    frames = [{"file_path": f"{name}.exr", "transform_matrix": pose(turn).tolist()}
              for name, turn in (("left", -0.3), ("right", 0.4))]  # fmt: skip
    path = folder / "transforms.json"
    path.write_text(json.dumps({**BENT, "frames": frames, **changes}))
    return path


def photographs(path: Path) -> None:
    """Pictures of the scene through the distorting lens: of many narrow pixels, from the definition of the model."""
    scene = bs.export().scene
    for one in read_calibration(path):
        wide = Lens(640, 480, 500.0, 500.0, 320.0, 240.0)  # sees more than the lens does
        picture = Renderer(scene).render(spp=16, camera=wide.camera(one.to_world))
        v, u = np.mgrid[0:480, 0:640] + 0.5
        at = one.lens.distort(np.stack([(u - 320.0) / 500.0, (v - 240.0) / 500.0], axis=2))
        column, row = np.floor(at[..., 0]).astype(int), np.floor(at[..., 1]).astype(int)
        inside = (column >= 0) & (column < one.lens.width) & (row >= 0) & (row < one.lens.height)
        total, count = np.zeros((one.lens.height, one.lens.width, 3)), np.zeros((one.lens.height, one.lens.width, 1))
        np.add.at(total, (row[inside], column[inside]), picture[inside])
        np.add.at(count, (row[inside], column[inside]), 1.0)
        assert count.min() > 0.0
        images.write_image(one.image, (total / count).astype(np.float32))


def test_cameras_are_exported_as_they_were_calibrated(tmp_path: Any) -> None:
    scene = bs.empty(100)
    path = calibration(tmp_path)
    found = read_calibration(path)
    cameras = [one.camera for one in add_cameras(scene, found)]
    bs.add("Cube", bs.cube("Cube", bs.material("Clay")))
    bs.world((1, 1, 1))
    assert [camera.name for camera in cameras] == ["left", "right"]
    assert (scene.render.resolution_x, scene.render.resolution_y) == (100, 75)
    export = export_scene(scene, cameras)
    for one, view in zip(found, export.views, strict=True):
        np.testing.assert_allclose(view.to_world, one.to_world, atol=1e-6)
        expected = one.lens.of_size(75, 100).camera(one.to_world)
        assert view.focal == pytest.approx(expected.focal, rel=1e-6)
        np.testing.assert_allclose(view.principal_point, expected.principal_point, atol=1e-4)
    assert lens_of(cameras[0]) == found[0].lens
    cameras[0].parent.scale = (2.0, 2.0, 2.0)
    cameras[0].parent.location = (1.0, 0.0, 0.0)
    moved = export_scene(scene, cameras).views[0].to_world
    np.testing.assert_allclose(moved[:3, 3], 2.0 * found[0].to_world[:3, 3] + [1.0, 0.0, 0.0], atol=1e-5)
    cameras[1].data[LENS] = 3.0
    with pytest.raises(Problem, match="camera 'right': its custom property 'edgegrad_lens' is no lens"):
        lens_of(cameras[1])


def test_pictures_of_several_aspects_are_refused(tmp_path: Any) -> None:
    path = calibration(tmp_path, frames=[
        {"file_path": "a.png", "transform_matrix": pose(0.0).tolist()},
        {"file_path": "b.png", "transform_matrix": pose(0.1).tolist(), "w": 48, "h": 64},
    ])  # fmt: skip
    with pytest.raises(Problem, match=r"picture 'b.png': is 48 x 64 pixels, .* another aspect than 'a.png' of 64 x 48"):
        add_cameras(bs.empty(), read_calibration(path))


def test_targets_are_read_without_the_distortion_of_their_camera(tmp_path: Any) -> None:
    """The truth renders as its undistorted photograph; a silhouette is undistorted, too."""
    scene = ball(size=64)
    path = calibration(tmp_path)
    photographs(path)
    camera = add_cameras(scene, read_calibration(path))[0].camera
    mask = (images.read_image(tmp_path / "left.exr")[..., 1] < 0.15).astype(np.float32)
    images.write_image(tmp_path / "mask.png", np.repeat(mask[..., None], 3, axis=2))

    def differences() -> Any:
        pictures = [Picture("left", str(tmp_path / "left.exr")),
                    Picture("left", str(tmp_path / "mask.png"), silhouette_of=("Cube",))]  # fmt: skip
        request = Request(pictures, Names(base_color=("Clay",)))
        session = Session.prepare(bpy.context, request)
        out = []
        for view in views(session.export.scene, session.targets):
            made = session.export.scene
            made = made if view.objects is None else silhouette_scene(made, view.objects)
            picture = Renderer(made).render(spp=64, max_depth=2 if view.objects is None else 1, camera=view.camera)
            weight = np.ones(view.image.shape[:2]) if view.mask is None else view.mask
            out.append(np.average(np.abs(picture - view.image).mean(axis=2), weights=weight))
        return np.array(out)

    straight = differences()
    del camera.data[LENS]
    assert (straight < 0.5 * differences()).all(), (straight, differences())


def test_colors_are_found_from_photographs_through_a_bent_lens(tmp_path: Any) -> None:
    """The command line imports cameras and pictures, and undoes the lens."""
    ball(size=64)
    bpy.data.objects.remove(bpy.data.objects["Front"])
    path = calibration(tmp_path)
    bs.camera((0, 0, 6), name="Unused")
    photographs(path)
    color = fitted_color(tmp_path, path)
    np.testing.assert_allclose(color, TRUTH, atol=0.02)
    assert bpy.data.objects["left"].data.background_images[0].image is not None


def test_operator_adds_cameras_and_targets(tmp_path: Any) -> None:
    edgegrad_addon.register()
    try:
        ball()
        path = calibration(tmp_path)
        photographs(path)
        (tmp_path / "right.exr").unlink()
        assert bpy.ops.edgegrad.cameras_import(filepath=str(path)) == {"FINISHED"}
        (row,) = bpy.context.scene.edgegrad.targets
        assert row.camera.name == "left" and row.image.endswith("left.exr")
        path.write_text("{}")
        with pytest.raises(RuntimeError, match="has no list 'frames'"):
            bpy.ops.edgegrad.cameras_import(filepath=str(path))
    finally:
        edgegrad_addon.unregister()
