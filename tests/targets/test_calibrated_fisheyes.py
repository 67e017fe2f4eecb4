"""Fisheyes of a calibration in Blender: Cycles and Edgegrad see points where OpenCV's formula has them."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

from edgegrad import Camera, Renderer, images
from edgegrad.calibration import FisheyeLens, Intrinsics, PanoramaLens, read_calibration
from edgegrad_addon.export import export_scene
from edgegrad_addon.problem import Problem
from edgegrad_addon.running.guard import _lens
from edgegrad_addon.targets.calibrated_cameras import KIND, LENS, add_camera, add_cameras, lens_of
from tests.support.scenes import blender_scenes as bs
from tests.targets.cycles_targets import TRUTH, ball, fitted_color

# Of a lens with its axis away from the middle, whose camera keeps pictures; and of one with oblong pixels.
KEPT = {"camera_model": "OPENCV_FISHEYE", "w": 96, "h": 72, "fl_x": 30.0, "fl_y": 30.0, "cx": 52.0, "cy": 33.0,
        "k1": -0.02, "k2": 0.004}  # fmt: skip
OBLONG = {**KEPT, "fl_x": 40.0, "fl_y": 42.0, "k1": -0.08, "k3": 0.002}


def calibration(folder: Path, fields: dict[str, Any], height: float = 0.0) -> Path:
    pose = np.eye(4)
    pose[2, 3] = height
    path = folder / "transforms.json"
    path.write_text(json.dumps({**fields, "frames": [{"file_path": "photo.exr", "transform_matrix": pose.tolist()}]}))
    return path


def opencv(fields: dict[str, Any], points: Any) -> Any:
    """Where OpenCV's cv2.fisheye has (..., 3) points in Blender's axes, by its documentation."""
    x, y, z = np.moveaxis(points * [1.0, -1.0, -1.0], -1, 0)
    aside = np.hypot(x, y)
    theta = np.arctan2(aside, z)
    k1, k2, k3, k4 = (fields.get(key, 0.0) for key in ("k1", "k2", "k3", "k4"))
    distorted = theta * (1 + k1 * theta**2 + k2 * theta**4 + k3 * theta**6 + k4 * theta**8) / np.maximum(aside, 1e-12)
    return np.stack([fields["fl_x"] * distorted * x + fields["cx"], fields["fl_y"] * distorted * y + fields["cy"]], -1)


@pytest.mark.parametrize("lens", [
    FisheyeLens(96, 72, 30.0, 30.0, 52.0, 33.0, k1=-0.02, k2=0.004),
    FisheyeLens(96, 72, 12.0, 12.0, 40.0, 33.0),  # sees more than all directions
    FisheyeLens(96, 72, 40.0, 42.0, 52.0, 33.0, k1=-0.1, k4=1e-4),
    PanoramaLens(96, 72, 50.0, 80.0, 30.0, 40.0),
    PanoramaLens(96, 48, 48.0, 48.0, 48.0, 24.0),
])  # fmt: skip
def test_blender_cameras_are_those_of_the_calibration(lens: Intrinsics) -> None:
    scene = bs.empty(96)
    scene.render.resolution_x, scene.render.resolution_y = lens.width, lens.height
    camera = add_camera(scene, "Found", lens, np.eye(4))
    bs.add("Cube", bs.cube("Cube", bs.material("Clay")))
    bpy.context.view_layer.update()
    (found,) = export_scene(scene, [camera]).views
    expected = lens.camera(np.eye(4))
    for name in ("fisheye_fov", "fisheye_polynomial", "longitude", "latitude", "shift"):
        if lens.camera(np.eye(4)).kind == "EQUIRECTANGULAR" and name == "shift":
            continue
        np.testing.assert_allclose(getattr(found, name), getattr(expected, name), rtol=1e-5, atol=1e-6, err_msg=name)
    assert (found.kind, found.pixel_aspect) == (expected.kind, 1.0)
    if lens.keeps_pictures:
        assert lens_of(camera) is None
    else:
        assert lens_of(camera) == lens
        camera.data[LENS][KIND] = "Unknown"
        with pytest.raises(Problem, match="camera 'Found': its custom property 'edgegrad_lens' is no lens"):
            lens_of(camera)


def test_a_change_of_a_coefficient_is_a_change_of_the_lens() -> None:
    """A fit that runs must not go on with another camera."""
    camera = add_camera(bs.empty(), "Found", FisheyeLens(96, 72, 30.0, 30.0, 52.0, 33.0, k1=-0.02), np.eye(4))
    before = _lens(camera)
    camera.data.fisheye_polynomial_k2 *= 1.1
    assert _lens(camera) != before


@pytest.mark.parametrize("engine", ["Cycles", "Edgegrad"])
def test_pictures_show_points_where_opencv_does(engine: str, tmp_path: Path) -> None:
    """Glowing cubes, of which one is behind the camera."""
    scene = bs.empty(96)
    bs.world((0, 0, 0))
    scene.cycles.samples = 256
    path = calibration(tmp_path, KEPT)
    scene.camera = add_cameras(scene, read_calibration(path))[0].camera
    cube = bs.add("Cube", bs.cube("Cube", bs.material("Glow", (1, 1, 1), "ShaderNodeEmission")), scale=(0.1,) * 3)
    for angle, turn in ((0.4, 0.7), (1.0, 2.5), (1.7, 3.3)):
        point = np.array([math.sin(angle) * math.cos(turn), math.sin(angle) * math.sin(turn), -math.cos(angle)])
        cube.location = 5.0 * point
        bpy.context.view_layer.update()
        if engine == "Cycles":
            light = bs.cycles(tmp_path)[..., 0].astype(np.float64)
        else:
            light = Renderer(bs.export().scene).render(spp=1024, max_depth=1)[..., 0].astype(np.float64)
        y, x = np.mgrid[: light.shape[0], : light.shape[1]] + 0.5
        found = np.array([(light * x).sum(), (light * y).sum()]) / light.sum()
        np.testing.assert_allclose(found, opencv(KEPT, point), atol=0.15)


def photograph(path: Path) -> None:
    """The scene through the fisheye: a fine panorama, whose pixels fall where OpenCV has their directions."""
    (one,) = read_calibration(path)
    around = Camera(one.to_world, kind="EQUIRECTANGULAR", width=2000, height=1000, clip_start=0.01)
    picture = Renderer(bs.export().scene).render(spp=4, camera=around)
    v, u = np.mgrid[:1000, :2000] + 0.5
    longitude, latitude = np.pi * (u / 1000 - 1.0), np.pi * (0.5 - v / 1000)
    away = np.stack([np.sin(longitude) * np.cos(latitude), np.sin(latitude), -np.cos(longitude) * np.cos(latitude)], -1)
    at = opencv(OBLONG, away)
    column, row = np.floor(at[..., 0]).astype(int), np.floor(at[..., 1]).astype(int)
    inside = (column >= 0) & (column < 96) & (row >= 0) & (row < 72)
    total, count = np.zeros((72, 96, 3)), np.zeros((72, 96, 1))
    weight = np.cos(latitude)[..., None]
    np.add.at(total, (row[inside], column[inside]), (weight * picture)[inside])
    np.add.at(count, (row[inside], column[inside]), weight[inside])
    assert count.min() > 0.0
    images.write_image(one.image, (total / count).astype(np.float32))


def test_colors_are_found_from_photographs_through_a_fisheye(tmp_path: Path) -> None:
    """The command line imports the camera and its picture, and takes out what the camera does not have."""
    ball(size=96)
    bpy.data.objects.remove(bpy.data.objects["Front"])
    path = calibration(tmp_path, OBLONG, 4.0)
    assert not read_calibration(path)[0].lens.keeps_pictures
    bs.camera((0, 0, 6), name="Unused")
    photograph(path)
    color = fitted_color(tmp_path, path)
    np.testing.assert_allclose(color, TRUTH, atol=0.02)
    assert bpy.data.objects["photo"].data.type == "PANO"
