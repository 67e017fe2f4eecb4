"""Export of Blender's camera and picture size to an `edgegrad.Camera`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad.scene.camera import FISHEYES

from ...problem import Problem, Report
from .shear import BARELY_SHEARED, RIGID, degrees, skew

KINDS = {"PERSP": "PERSPECTIVE", "ORTHO": "ORTHOGRAPHIC"}
PANORAMAS = {"EQUIRECTANGULAR": "EQUIRECTANGULAR", "FISHEYE_EQUISOLID": "FISHEYE_EQUISOLID",
             "FISHEYE_EQUIDISTANT": "FISHEYE_EQUIDISTANT", "FISHEYE_LENS_POLYNOMIAL": "FISHEYE_POLYNOMIAL"}  # fmt: skip
# What places the directions in the pictures of panoramas.
PANORAMA_NUMBERS = ("latitude_min", "latitude_max", "longitude_min", "longitude_max", "fisheye_fov", "fisheye_lens",
                    *(f"fisheye_polynomial_k{k}" for k in range(5)))  # fmt: skip
MILLIMETRE = 1e-3
# Blender stores full turns in single precision.
FULL_TURN = 2.0 * np.pi * (1.0 + 1e-6)


def render_size(scene: Any) -> tuple[int, int]:
    """Width and height of the scene's renders, of the whole picture."""
    render = scene.render
    return (max(1, render.resolution_x * render.resolution_percentage // 100),
            max(1, render.resolution_y * render.resolution_percentage // 100))  # fmt: skip


def export_camera(camera: Any, scene: Any, report: Report) -> edgegrad.Camera:
    """Export an evaluated camera object with the picture size of the scene.

    Parameters
    ----------
    camera
        Object of type CAMERA.
    scene
        Blender's scene, for the render size, the region and the pixel filter.
    report
        Receives one warning for each setting that is not supported.

    Raises
    ------
    Problem
        If the object is not a camera, or a camera of an unsupported type.
    """
    where = f"camera '{camera.name}'"
    if camera.type != "CAMERA":
        raise Problem(f"object '{camera.name}': is not a camera")
    lens = camera.data
    width, height = render_size(scene)
    render = scene.render
    matrix = _pose(np.array(camera.matrix_world, np.float64), where, report)
    out = edgegrad.Camera(
        to_world=matrix,
        width=width,
        height=height,
        clip_start=lens.clip_start,
        clip_end=lens.clip_end,
        kind=_kind(lens, where),
        pixel_aspect=render.pixel_aspect_y / render.pixel_aspect_x,
        crop=_region(render, width, height, f"scene '{scene.name}'", report),
    )
    _projection(out, lens, where)
    if lens.type != "PANO":
        _depth_of_field(out, lens, matrix)
    elif lens.dof.use_dof:
        report.warn(where, "depth of field is left out of panoramas; everything is in focus")
    out.filter, out.filter_width = _pixel_filter(scene)
    return out


def _kind(lens: Any, where: str) -> str:
    if lens.type == "PANO":
        settings = panorama_settings(lens)
        panorama = settings.panorama_type
        if panorama not in PANORAMAS:
            raise Problem(f"{where}: panoramas of the type {_label(settings, 'panorama_type')} can't be rendered; "
                          "choose Equirectangular or a fisheye")  # fmt: skip
        return PANORAMAS[panorama]
    if lens.type not in KINDS:
        raise Problem(f"{where}: cameras of the type {_label(lens, 'type')} can't be rendered; choose Perspective, "
                      "Orthographic or Panoramic")  # fmt: skip
    return KINDS[lens.type]


def _label(owner: Any, name: str) -> str:
    """Return the name that Blender shows for the value of an enumerated property."""
    return str(owner.bl_rna.properties[name].enum_items[getattr(owner, name)].name)


def _pose(matrix: NDArray[np.float64], where: str, report: Report) -> NDArray[np.float64]:
    """Return the rigid transform with the camera's place, view direction and, as far as possible, horizontal axis."""
    size = np.linalg.norm(matrix[:3, :3], axis=0)
    axes = matrix[:3, :3] / np.where(size > 0.0, size, 1.0)  # the scale of a camera does not change its picture
    volume = float(np.linalg.det(axes))
    if abs(volume) < RIGID:
        raise Problem(f"{where}: it is flattened, since its scale or that of a parent is 0 along an axis; set these "
                      "scales to other values")  # fmt: skip
    x, _, z = axes.T
    sheared = skew(axes)
    if sheared > RIGID:
        x = x - (x @ z) * z
        x /= np.linalg.norm(x)
        axes = np.stack([x, np.sign(volume) * np.cross(z, x), z], axis=1)
    if sheared > BARELY_SHEARED:
        report.warn(where, f"its parents' uneven scale shears it by {degrees(sheared):.2g} degrees, and Cycles its "
                    "picture; here the picture is not sheared")  # fmt: skip
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = axes, matrix[:3, 3]
    return out


def _projection(out: edgegrad.Camera, lens: Any, where: str) -> None:
    if out.kind == "EQUIRECTANGULAR":
        # Cycles shifts panoramas by fractions of their own width and height.
        panorama = panorama_settings(lens)
        longitude = np.array([panorama.longitude_min, panorama.longitude_max])
        latitude = np.array([panorama.latitude_min, panorama.latitude_max])
        out.longitude = longitude + lens.shift_x * np.diff(longitude)
        out.latitude = latitude + lens.shift_y * np.diff(latitude)
        return
    if out.kind in FISHEYES:
        _fisheye(out, lens, where)
        out.shift = np.array([lens.shift_x, lens.shift_y * out.height * out.pixel_aspect / out.width])
        return
    fitted = _fitted(out, lens)
    out.fov_x = 2.0 * float(np.arctan(0.5 * _sensor_width(out, lens) / lens.lens))
    out.ortho_width = lens.ortho_scale * out.width / fitted
    out.shift = np.array([lens.shift_x, lens.shift_y]) * fitted / out.width


def _fitted(out: edgegrad.Camera, lens: Any) -> float:
    """Side of the picture that the sensor size or an orthographic camera's scale refers to, in widths of a pixel."""
    high = out.height * out.pixel_aspect
    horizontal = lens.sensor_fit == "HORIZONTAL" or (lens.sensor_fit == "AUTO" and out.width >= high)
    return out.width if horizontal else high


def _sensor_width(out: edgegrad.Camera, lens: Any) -> float:
    """Width of the part of the sensor that the picture shows, millimetres."""
    sensor = lens.sensor_height if lens.sensor_fit == "VERTICAL" else lens.sensor_width
    return float(sensor * out.width / _fitted(out, lens))


def _fisheye(out: edgegrad.Camera, lens: Any, where: str) -> None:
    """Set what fisheyes have, as Cycles reads it."""
    panorama = panorama_settings(lens)
    out.fisheye_fov = float(panorama.fisheye_fov)
    if out.fisheye_fov > FULL_TURN:
        raise Problem(f"{where}: its fisheye sees {np.degrees(out.fisheye_fov):.0f} degrees, so that directions appear "
                      "several times in its picture; set its field of view to 360 degrees or less")  # fmt: skip
    out.fisheye_fov = min(out.fisheye_fov, 2.0 * np.pi)
    if out.kind == "FISHEYE_EQUIDISTANT":
        # Cycles measures both sides of the picture as one, and takes no notice of the shape of pixels.
        out.pixel_aspect = out.width / out.height
        return
    width = _sensor_width(out, lens)
    if out.kind == "FISHEYE_EQUISOLID":
        out.fisheye_lens = float(panorama.fisheye_lens) / width
        return
    powers = np.array([float(getattr(panorama, f"fisheye_polynomial_k{k}")) for k in range(5)])
    out.fisheye_polynomial = -powers * width ** np.arange(5)
    try:
        out.validate()
    except ValueError as error:
        raise Problem(f"{where}: the coefficients K0 to K4 of its fisheye can't be rendered, since the angle from the "
                      "viewing direction does not grow from the picture's middle to its border; change them, or set "
                      "its panorama type to Fisheye Equisolid") from error  # fmt: skip


def _depth_of_field(out: edgegrad.Camera, lens: Any, matrix: NDArray[np.float64]) -> None:
    dof = lens.dof
    if not dof.use_dof:
        return
    f_number = max(dof.aperture_fstop, 1e-5)
    # Cycles uses a focal length of 1 m for orthographic cameras.
    length = 1.0 if lens.type == "ORTHO" else lens.lens * MILLIMETRE
    out.aperture_radius = length / (2.0 * f_number)
    distance = float(dof.focus_distance)
    if dof.focus_object is not None:
        target = dof.focus_object.matrix_world
        bone = dof.focus_object.pose.bones.get(dof.focus_subtarget) if dof.focus_object.pose else None
        if bone is not None:
            target = target @ bone.matrix
        distance = abs(float((np.array(target, np.float64)[:3, 3] - matrix[:3, 3]) @ matrix[:3, 2]))
    out.focus_distance = max(distance, 1e-6)
    out.aperture_blades = dof.aperture_blades if dof.aperture_blades > 2 else 0
    out.aperture_rotation = dof.aperture_rotation
    out.aperture_ratio = max(dof.aperture_ratio, 1e-5)


def panorama_settings(lens: Any) -> Any:
    """What has the settings of panoramas: a camera's data from Blender 5.0 on, its settings of Cycles before."""
    return lens if hasattr(lens, "panorama_type") else lens.cycles


def _region(render: Any, width: int, height: int, where: str, report: Report) -> tuple[int, int, int, int] | None:
    """Return the render region in pixels, rounded like Blender; None: the full picture."""
    if not render.use_border:
        return None
    # Blender multiplies in float32 and truncates.
    edges = np.clip([render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y], 0.0, 1.0)
    x0, x1, y0, y1 = (int(np.float32(edge) * np.float32(size))
                      for edge, size in zip(edges, (width, width, height, height), strict=True))  # fmt: skip
    if x0 >= x1 or y0 >= y1:
        report.warn(where, "its render region is empty; the full picture is rendered")
        return None
    if not render.use_crop_to_border:
        report.warn(where, "the picture contains only the render region, as with 'Crop to Render Region'")
    return x0, height - y1, x1, height - y0


def _pixel_filter(scene: Any) -> tuple[str, float]:
    cycles = getattr(scene, "cycles", None)
    kind = getattr(cycles, "pixel_filter_type", "BLACKMAN_HARRIS")
    if kind == "BOX":
        return kind, 1.0  # Cycles ignores the width of box filters
    # The full support of a filter is twice (Gaussian: three times) what Cycles calls its width.
    whole = 3.0 if kind == "GAUSSIAN" else 2.0
    return kind, whole * max(float(getattr(cycles, "filter_width", scene.render.filter_size)), 0.01)
