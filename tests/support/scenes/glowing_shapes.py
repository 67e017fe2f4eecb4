"""Shapes that only emit, before every kind of camera.

Their radiance stays as they or the camera move: all that changes is where they are seen, so that the primary term is
the whole derivative.
"""

from __future__ import annotations

from copy import deepcopy
from dataclasses import replace

import numpy as np

import edgegrad
from tests.support import shapes
from tests.support.small_scenes import Floats, Make, box, camera, glowing, rectangle

# The term alone beside the whole difference: see above.
PRIMARY = {"eps": 0.01, "reference_spp": 256, "max_depth": 1, "terms": ("primary",)}


def turn(angle: float, axis: int) -> Floats:
    """Rotation about a coordinate axis."""
    c, s = np.cos(angle), np.sin(angle)
    out = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    out[i, i] = out[j, j] = c
    out[i, j], out[j, i] = -s, s
    return out


def glowing_scene(view: edgegrad.Camera, *, world: float = 0.3) -> edgegrad.Scene:
    """Emissive shapes, one partly before another."""
    front, faces = shapes.ball(2, 0.45)
    return edgegrad.Scene(
        deepcopy(view),
        {
            "box": box((0.4, 0.1, -0.6), (0.35, 0.45, 0.3), "warm", 0.5),
            "ball": edgegrad.Mesh(front + [-0.25, -0.1, 0.5], faces, ("cold",)),
            "card": rectangle((-0.7, 0.5, -0.4), (0.3, 0.1, 0), (-0.1, 0.35, 0.2), "both"),
        },
        {
            "warm": edgegrad.Material(np.zeros(3), np.array([2.0, 1.2, 0.5])),
            "cold": edgegrad.Material(np.zeros(3), np.array([0.2, 0.6, 1.6])),
            "both": glowing(1.5, True),
        },
        world=edgegrad.World(np.ones(3), world),
    )


VIEW = camera((0.3, 0.4, 3.0), (0, 0, 0), 32, 0.8)
ORTHOGRAPHIC = replace(VIEW, kind="ORTHOGRAPHIC", ortho_width=2.4)
PANORAMA = replace(camera((0.1, 0.0, 1.3), (0, 0, 0)), kind="EQUIRECTANGULAR", width=64)
# Its left and right end, and its upper end, go through the shapes.
BACKWARDS = replace(camera((-0.3, 0.2, -0.05), (-0.2, 1.0, -2.0)), kind="EQUIRECTANGULAR", width=64)
# Seen from among the shapes: the border of the disc that the lens sees goes through some of them.
FISHEYE = replace(camera((0.1, 0.0, 1.0), (0, 0, 0), 48), kind="FISHEYE_EQUIDISTANT", fisheye_fov=3.7)
EQUISOLID = replace(FISHEYE, kind="FISHEYE_EQUISOLID", fisheye_lens=0.4, fisheye_fov=1.7, crop=(3, 0, 48, 40))
# Without such a border
LENS_CURVE = np.array([0.002, 1.9, 0.3, -0.4, 0.2])
POLYNOMIAL = replace(FISHEYE, kind="FISHEYE_POLYNOMIAL", fisheye_polynomial=LENS_CURVE, fisheye_fov=6.0)
LENS = replace(VIEW, aperture_radius=0.12, focus_distance=2.7)
BLADES = replace(LENS, aperture_blades=5, aperture_rotation=0.3, aperture_ratio=1.6, aperture_radius=0.2)
TRIANGLE = replace(LENS, aperture_blades=3, aperture_radius=0.4)
WIDE = replace(VIEW, crop=(5, 3, 27, 25), filter="BLACKMAN_HARRIS", filter_width=3.0, pixel_aspect=1.3)


def moved(
    view: edgegrad.Camera, axis: int = 3, angle: float = 0.0, shift: tuple[float, float, float] = (0, 0, 0)
) -> Make:
    """The camera turns about a world axis and moves."""

    def make(theta: float) -> edgegrad.Scene:
        to_world = view.to_world.copy()
        if angle:
            to_world[:3, :3] = turn(theta * angle, axis) @ to_world[:3, :3]
        to_world[:3, 3] += theta * np.asarray(shift)
        return glowing_scene(replace(view, to_world=to_world))

    return make


def changed(view: edgegrad.Camera, field: str, rate: float | Floats) -> Make:
    """One number of the camera grows."""
    return lambda theta: glowing_scene(replace(view, **{field: getattr(view, field) + theta * np.asarray(rate)}))


def shapes_move(view: edgegrad.Camera) -> Make:
    """All shapes move apart and stretch."""

    def make(theta: float) -> edgegrad.Scene:
        scene = glowing_scene(view)
        for k, mesh in enumerate(scene.meshes.values()):
            apart = np.array([0.6, -0.3, 0.8]) * (k - 1)
            mesh.vertices = mesh.vertices + theta * (apart + 0.4 * mesh.vertices[:, ::-1])
        return scene

    return make


MESHES = [f"meshes.{name}.vertices" for name in ("box", "ball", "card")]
POSE = ["camera.to_world"]
CASES: dict[str, tuple[Make, list[str]]] = {
    "perspective: shapes move": (shapes_move(VIEW), MESHES),
    "perspective: camera moves": (moved(VIEW, shift=(1.0, 0.4, -0.7)), POSE),
    "perspective: camera turns": (moved(VIEW, 1, 0.7), POSE),
    "perspective: camera rolls": (moved(VIEW, 2, 0.9), POSE),
    "perspective: focal length": (changed(VIEW, "fov_x", 0.6), ["camera.fov_x"]),
    "perspective: shift": (changed(VIEW, "shift", np.array([0.3, -0.2])), ["camera.shift"]),
    "perspective: pixel aspect": (changed(WIDE, "pixel_aspect", 0.8), ["camera.pixel_aspect"]),
    "crop and wide filter: shapes move": (shapes_move(WIDE), MESHES),
    "crop and wide filter: camera moves": (moved(WIDE, shift=(1.0, 0.4, -0.7)), POSE),
    "orthographic: shapes move": (shapes_move(ORTHOGRAPHIC), MESHES),
    "orthographic: camera moves": (moved(ORTHOGRAPHIC, shift=(1.0, 0.4, -0.7)), POSE),
    "orthographic: camera turns": (moved(ORTHOGRAPHIC, 0, 0.7), POSE),
    "orthographic: width": (changed(ORTHOGRAPHIC, "ortho_width", 2.0), ["camera.ortho_width"]),
    "panorama: shapes move": (shapes_move(PANORAMA), MESHES),
    "panorama: camera moves": (moved(PANORAMA, shift=(0.5, 0.4, -0.7)), POSE),
    "panorama: camera turns": (moved(PANORAMA, 0, 0.5), POSE),
    "panorama: longitudes": (changed(PANORAMA, "longitude", np.array([0.9, -0.6])), ["camera.longitude"]),
    "panorama: latitudes": (changed(PANORAMA, "latitude", np.array([0.2, -0.3])), ["camera.latitude"]),
    "fisheye: shapes move": (shapes_move(FISHEYE), MESHES),
    "fisheye: camera moves": (moved(FISHEYE, shift=(0.5, 0.4, -0.7)), POSE),
    "fisheye: camera turns": (moved(FISHEYE, 1, 0.5), POSE),
    "fisheye: field of view": (changed(FISHEYE, "fisheye_fov", 0.6), ["camera.fisheye_fov"]),
    "equisolid fisheye: shapes move": (shapes_move(EQUISOLID), MESHES),
    "equisolid fisheye: camera turns": (moved(EQUISOLID, 0, 0.5), POSE),
    "equisolid fisheye: lens": (
        changed(replace(EQUISOLID, fisheye_lens=0.5, fisheye_fov=6.0), "fisheye_lens", -0.2), ["camera.fisheye_lens"]
    ),
    "polynomial fisheye: shapes move": (shapes_move(POLYNOMIAL), MESHES),
    "polynomial fisheye: camera turns": (moved(POLYNOMIAL, 2, 0.5), POSE),
    "polynomial fisheye: shift": (changed(POLYNOMIAL, "shift", np.array([0.3, -0.2])), ["camera.shift"]),
    "polynomial fisheye: pixel aspect": (changed(POLYNOMIAL, "pixel_aspect", 0.6), ["camera.pixel_aspect"]),
    "polynomial fisheye: lens": (
        changed(POLYNOMIAL, "fisheye_polynomial", np.array([0.05, 0.5, -0.6, 0.9, -0.8])),
        ["camera.fisheye_polynomial"],
    ),
    "panorama all around: shapes move": (shapes_move(BACKWARDS), MESHES),
    "panorama all around: camera turns": (moved(BACKWARDS, 0, 0.4, (0.1, 0.2, 0.1)), POSE),
    "lens: shapes move": (shapes_move(LENS), MESHES),
    "lens: camera moves": (moved(LENS, 1, 0.3, (0.4, 0.3, -0.7)), POSE),
    "lens: aperture opens": (changed(LENS, "aperture_radius", 1.0), ["camera.aperture_radius"]),
    "lens: focus": (changed(LENS, "focus_distance", 3.0), ["camera.focus_distance"]),
    "blades: aperture turns": (changed(TRIANGLE, "aperture_rotation", 3.0), ["camera.aperture_rotation"]),
    "blades: aperture's ratio": (changed(BLADES, "aperture_ratio", 6.0), ["camera.aperture_ratio"]),
    "lens, orthographic: focus and pose": (
        moved(replace(LENS, kind="ORTHOGRAPHIC", ortho_width=2.4), 1, 0.3, (0.4, 0.3, -0.7)), POSE
    ),
}
