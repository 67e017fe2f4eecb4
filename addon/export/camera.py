"""Blender's camera and render size as an `edgegrad.Camera`."""

from __future__ import annotations

from typing import Any

import numpy as np

import edgegrad

from ..problem import Problem, Report


def picture_size(scene: Any) -> tuple[int, int]:
    """Width and height of the scene's render, pixels, its percentage applied as Blender does."""
    render = scene.render
    return (max(1, render.resolution_x * render.resolution_percentage // 100),
            max(1, render.resolution_y * render.resolution_percentage // 100))  # fmt: skip


def export_camera(camera: Any, scene: Any, report: Report) -> edgegrad.Camera:
    """The camera object (evaluated) with the scene's render size.

    Parameters
    ----------
    camera
        Object of type CAMERA.
    scene
        Blender's scene, for the render size.
    report
        Takes one warning per setting that isn't modelled.

    Raises
    ------
    Problem
        If it is no perspective camera, or pixels aren't square.
    """
    where = f"camera '{camera.name}'"
    lens = camera.data
    render = scene.render
    if camera.type != "CAMERA":
        raise Problem(f"object '{camera.name}': is no camera")
    if lens.type != "PERSP":
        raise Problem(f"{where}: its type is {lens.type}, but only perspective cameras can be rendered in this version")
    if not np.isclose(render.pixel_aspect_x, render.pixel_aspect_y):
        raise Problem(f"scene '{scene.name}': its pixel aspect isn't 1:1; only square pixels can be rendered")
    if lens.dof.use_dof:
        report.warn(where, "depth of field is ignored; everything is in focus")
    if render.use_border:
        report.warn(f"scene '{scene.name}'", "the render region is ignored; the full picture is rendered")

    width, height = picture_size(scene)
    # The sensor's size belongs to the side it is fitted to, and the shift is a fraction of that side's pixels.
    horizontal = lens.sensor_fit == "HORIZONTAL" or (lens.sensor_fit == "AUTO" and width >= height)
    sensor = lens.sensor_height if lens.sensor_fit == "VERTICAL" else lens.sensor_width
    fitted = width if horizontal else height
    sensor_x = sensor * width / fitted
    matrix = np.array(camera.matrix_world, np.float64)
    matrix[:3, :3] /= np.linalg.norm(matrix[:3, :3], axis=0)  # a camera's scale doesn't change its picture
    return edgegrad.Camera(
        to_world=matrix,
        fov_x=2.0 * float(np.arctan(0.5 * sensor_x / lens.lens)),
        width=width,
        height=height,
        shift=np.array([lens.shift_x, lens.shift_y]) * fitted / width,
        clip_start=lens.clip_start,
        clip_end=lens.clip_end,
    )
