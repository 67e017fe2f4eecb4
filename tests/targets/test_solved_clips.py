"""Blender's own motion tracking: solved frames become cameras that see the tracked points where they were seen."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad_addon
from edgegrad import images
from edgegrad.calibration import Lens
from edgegrad_addon.problem import Problem
from edgegrad_addon.targets.calibrated_cameras import LENS, add_calibration
from edgegrad_addon.targets.solved_clips import solved_clip

WIDTH, HEIGHT, FRAMES = 320, 240, 12
LENSES = {
    "POLYNOMIAL": Lens(WIDTH, HEIGHT, 350.0, 350.0, 168.0, 115.0, k1=-0.1, k2=0.02),
    "BROWN": Lens(WIDTH, HEIGHT, 350.0, 350.0, 160.0, 120.0, k1=-0.1, k2=0.02, p1=0.004, p2=-0.006),
}


def solved(folder: Path, model: str) -> tuple[Any, Any]:
    """A sequence whose markers are points seen through the lens, solved by Blender; the clip, and the pixels."""
    bpy.ops.wm.read_factory_settings(use_empty=False)
    for k in range(FRAMES):
        images.write_image(folder / f"shot_{k + 5:04d}.png", np.full((HEIGHT, WIDTH, 3), 0.2, np.float32))
    clip = bpy.data.movieclips.load(str(folder / "shot_0005.png"))
    lens, camera = LENSES[model], clip.tracking.camera
    camera.distortion_model, camera.focal_length_pixels = model, lens.fx
    camera.principal_point_pixels = (lens.cx, HEIGHT - lens.cy)
    prefix = "brown_" if model == "BROWN" else ""
    for key in ("k1", "k2", "k3"):
        setattr(camera, prefix + key, getattr(lens, key))
    if model == "BROWN":
        camera.brown_p1, camera.brown_p2 = lens.p2, -lens.p1
    points = np.random.default_rng(0).uniform(-1.0, 1.0, (24, 3))
    pixels = np.zeros((FRAMES, len(points), 2))
    tracks = [clip.tracking.tracks.new(name=f"Point {k}", frame=1) for k in range(len(points))]
    for f in range(FRAMES):
        c, s = np.cos(0.06 * f), np.sin(0.06 * f)
        seen = points @ np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]).T + [0.0, 0.0, 6.0]
        pixels[f] = lens.distort(seen[:, :2] / seen[:, 2:])
        for track, (u, v) in zip(tracks, pixels[f], strict=True):
            track.markers.insert_frame(f + 1, co=(u / WIDTH, 1.0 - v / HEIGHT))
    held = next(one for one in clip.tracking.objects if one.is_camera)
    held.keyframe_a, held.keyframe_b = 1, FRAMES
    window = bpy.context.window_manager.windows[0]
    area = window.screen.areas[0]
    area.type = "CLIP_EDITOR"
    area.spaces.active.clip = clip
    region = next(one for one in area.regions if one.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region):
        assert bpy.ops.clip.solve_camera() == {"FINISHED"}
    assert held.reconstruction.average_error < 1e-3
    return clip, pixels


@pytest.mark.parametrize("model", LENSES)
def test_tracked_points_are_where_the_markers_were(model: str, tmp_path: Path) -> None:
    clip, pixels = solved(tmp_path, model)
    scene = bpy.context.scene
    bundles = np.array([track.bundle for track in clip.tracking.tracks])
    found = solved_clip(scene, clip.name, 5)
    assert [one.image.name for one in found.pictures] == ["shot_0005.png", "shot_0010.png", "shot_0015.png"]
    for one, f in zip(found.pictures, (0, 5, 10), strict=True):
        at = np.c_[bundles, np.ones(len(bundles))] @ np.linalg.inv(one.to_world).T
        assert (at[:, 2] < 0.0).all()
        np.testing.assert_allclose(one.lens.distort(at[:, :2] / -at[:, 2:3] * [1.0, -1.0]), pixels[f], atol=0.05)


def test_solved_frames_are_targets_and_stand_where_the_tracked_camera_does(tmp_path: Path) -> None:
    clip, _ = solved(tmp_path, "POLYNOMIAL")
    edgegrad_addon.register()
    try:
        scene = bpy.context.scene
        scene.frame_set(6)
        tracked = scene.camera
        tracked.matrix_world = [[2, 0, 0, 0], [0, 0, 2, 0], [0, -2, 0, 0], [1, 2, 3, 1]]
        constraint = tracked.constraints.new("CAMERA_SOLVER")
        constraint.use_active_clip, constraint.clip = False, clip
        assert bpy.ops.edgegrad.cameras_from_clip(clip=clip.name, every=5) == {"FINISHED"}
        rows = scene.edgegrad.targets
        assert [row.image.rpartition("/")[2] for row in rows] == ["shot_0005.png", "shot_0010.png", "shot_0015.png"]
        assert rows[0].camera.data.get(LENS) is not None and not rows[0].use_frame
        bpy.context.view_layer.update()
        follows = np.array(tracked.evaluated_get(bpy.context.evaluated_depsgraph_get()).matrix_world)
        np.testing.assert_allclose(np.array(rows[1].camera.matrix_world), follows, atol=1e-4)
    finally:
        edgegrad_addon.unregister()


def test_clips_that_are_not_solved_are_named(tmp_path: Path) -> None:
    clip, _ = solved(tmp_path, "BROWN")
    scene = bpy.context.scene
    with pytest.raises(Problem, match=r"movie clip 'Gone': there is no such clip \(known: 'shot_0005.png'"):
        add_calibration(scene, "clip:Gone")
    clip.tracking.camera.brown_k4 = 0.1
    with pytest.raises(Problem, match="distortion Brown with K4 can't be undone"):
        add_calibration(scene, f"clip:{clip.name}")
    clip.tracking.camera.distortion_model = "NUKE"
    with pytest.raises(Problem, match=r"distortion Nuke .*choose Polynomial"):
        add_calibration(scene, f"clip:{clip.name}")
    other = bpy.data.movieclips.load(str(tmp_path / "shot_0006.png"), check_existing=False)
    with pytest.raises(Problem, match="its camera is not solved"):
        add_calibration(scene, f"clip:{other.name}")
