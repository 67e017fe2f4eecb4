"""Calibrations from files: transforms.json of NeRF and Instant-NGP, and the text model of COLMAP."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._check import file_path, shown
from ..images import image_size
from ..scene.camera import Camera
from .fisheye import FisheyeLens, PanoramaLens
from .intrinsics import Intrinsics
from .lens import Lens
from .models import MODELS, PANORAMA, is_fisheye, lens_of_model

F64 = NDArray[np.float64]

# COLMAP's cameras look along +Z with Y down, Blender's along -Z with Y up.
TO_BLENDER = np.diag([1.0, -1.0, -1.0, 1.0])
# Endings that transforms.json may leave out.
ENDINGS = ("", ".png", ".jpg", ".jpeg", ".exr", ".tif", ".tiff")
# Keys of transforms.json that are other lenses or cameras than the models here. Instant-NGP's "equirectangular" is a
# projection of equal areas.
_REFUSED = ("rolling_shutter", "k5", "k6", "ftheta_p0", "w_ftheta", "equirectangular")
# Values of camera_model: none, those of COLMAP whose parameters have keys in transforms.json, and those of nerfstudio.
_MODELS = ("", "PERSPECTIVE", *(name for name in MODELS if name not in ("FULL_OPENCV", "FOV")))
# Largest difference of a pose's axes from orthonormal ones that counts as rounding.
ROUNDING = 1e-2


@dataclass(frozen=True)
class Calibrated:
    """One picture of a calibration.

    Attributes
    ----------
    name
        Name of the picture's file, as the calibration has it.
    image
        The file; it need not exist.
    lens
        Intrinsics, of the size of the picture at its calibration.
    to_world
        (4, 4) pose in Blender's axes, in the units of the calibration.
    """

    name: str
    image: Path
    lens: Intrinsics
    to_world: F64

    @property
    def camera(self) -> Camera:
        """The camera; its picture is that of `lens.undistort`."""
        return self.lens.camera(self.to_world)


def read_calibration(path: str | Path, images: str | Path | None = None) -> list[Calibrated]:
    """Read the cameras of a calibration, in the order of the names of their pictures.

    Parameters
    ----------
    path
        A transforms.json, or the folder with COLMAP's cameras.txt and images.txt, or one of these two files.
    images
        Folder of the pictures. None: for transforms.json its own folder; for COLMAP the folder "images" beside the
        model or beside a folder above it, else the folder of the model.

    Raises
    ------
    ValueError
        If a file can't be read, or has a camera model that is not supported; names it.
    """
    file = file_path("calibration", "path", path)
    folder = None if images is None else file_path("calibration", "images", images)
    if file.suffix.lower() == ".json":
        found = _read_transforms(file, folder or file.parent)
    else:
        model = file if file.is_dir() else file.parent
        found = _read_colmap(model, folder or _images_beside(model))
    if not found:
        raise ValueError(f"calibration '{path}': has no pictures")
    for one in found:
        try:
            one.camera.validate()
        except ValueError as error:
            raise ValueError(f"calibration '{path}': picture {shown(one.name)}: {error}") from None
    return sorted(found, key=lambda one: one.name)


def _images_beside(model: Path) -> Path:
    above = [model, *model.resolve().parents[:3]]
    return next((folder / "images" for folder in above if (folder / "images").is_dir()), model)


def _text(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is no text"
        raise ValueError(f"calibration '{file}': can't be read ({reason})") from None


# ---------------------------------------------------------------- transforms.json
def _read_transforms(file: Path, folder: Path) -> list[Calibrated]:
    try:
        data = json.loads(_text(file))
    except json.JSONDecodeError as error:
        raise ValueError(f"calibration '{file}': is no JSON ({error})") from None
    frames = data.get("frames") if isinstance(data, Mapping) else None
    if not isinstance(frames, list):
        raise ValueError(f"calibration '{file}': has no list 'frames', as transforms.json of NeRF has")
    out = []
    for k, frame in enumerate(frames):
        where = f"calibration '{file}', frame {k}"
        if not isinstance(frame, Mapping) or not isinstance(frame.get("file_path"), str):
            raise ValueError(f"{where}: has no file_path")
        values = {**{key: value for key, value in data.items() if key != "frames"}, **frame}
        name = Path(frame["file_path"])
        image = next((one for end in ENDINGS if _is_file(one := folder / f"{name}{end}")), folder / name)
        pose = _pose(where, frame.get("transform_matrix"))
        out.append(Calibrated(name.name, image, _lens(where, values, image), pose))
    return out


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:  # a name that no file can have
        return False


def _lens(where: str, values: Mapping[str, Any], image: Path) -> Intrinsics:
    for key in _REFUSED:
        if np.any(values.get(key, False)):
            raise ValueError(f"{where}: has '{key}', a camera that is not supported; undistort the pictures first")
    model = str(values.get("camera_model", "")).upper()
    if model not in _MODELS:
        raise ValueError(f"{where}: its camera_model {shown(model)} is not supported; undistort the pictures first")

    def value(key: str) -> float | None:
        return None if values.get(key) is None else _number(where, key, values[key])

    width, height = value("w"), value("h")
    if width is None or height is None:
        try:
            height, width = image_size(image)
        except ValueError as error:
            raise ValueError(f"{where}: states no w and h, and its picture gives none ({error})") from None
    fx, fy, cx, cy = value("fl_x"), value("fl_y"), value("cx"), value("cy")
    middle = 0.5 * width if cx is None else cx, 0.5 * height if cy is None else cy
    coefficients = {key: found for key in ("k1", "k2", "k3", "k4", "p1", "p2") if (found := value(key))}
    try:
        if model == PANORAMA or values.get("latlong"):
            _check_coefficients(where, coefficients, "panoramas")
            if model != PANORAMA:  # Instant-NGP's "latlong" is of all directions
                fx, fy, middle = None, None, (0.5 * width, 0.5 * height)
            return PanoramaLens(round(width), round(height), fx or 0.5 * width, fy or height, *middle)
        if is_fisheye(model) or values.get("is_fisheye"):
            focal = fx if fx is not None else fy
            if focal is None:
                raise ValueError(f"{where}: has no focal length; a fisheye needs fl_x, since its angle of view does "
                                 "not tell it")  # fmt: skip
            _check_coefficients(where, coefficients, "fisheyes", "k1", "k2", "k3", "k4")
            fy = fy if fy is not None else focal
            return FisheyeLens(round(width), round(height), focal, fy, *middle, **coefficients)
        _check_coefficients(where, coefficients, "lenses that are no fisheyes", "k1", "k2", "k3", "p1", "p2")
        fx, fy = _focal_lengths(where, value, width, height)
        return Lens(round(width), round(height), fx, fy, *middle, **coefficients)
    except ValueError as error:
        raise _located(where, error) from None


def _located(where: str, error: ValueError) -> ValueError:
    """The error with the place where it arose, unless it states it."""
    text = str(error)
    return ValueError(text if text.startswith(where) else f"{where}: {text}")


def _check_coefficients(where: str, coefficients: Mapping[str, float], what: str, *known: str) -> None:
    for key in coefficients:
        if key not in known:
            raise ValueError(f"{where}: has '{key}', which {what} do not have here; state the right camera_model, such "
                             "as OPENCV or OPENCV_FISHEYE, or undistort the pictures first")


def _focal_lengths(where: str, value: Callable[[str], float | None], width: float,
                   height: float) -> tuple[float, float]:  # fmt: skip
    """Return fx and fy of a lens that is no fisheye, pixels."""
    fx, fy, angle_x, angle_y = (value(key) for key in ("fl_x", "fl_y", "camera_angle_x", "camera_angle_y"))
    for key, angle in (("camera_angle_x", angle_x), ("camera_angle_y", angle_y)):
        if angle is not None and not 0.0 < angle < np.pi:
            raise ValueError(f"{where}: {key} must be between 0 and pi radians, not {angle:g}")
    if fx is None and angle_x is not None:
        fx = 0.5 * width / float(np.tan(0.5 * angle_x))
    if fy is None and angle_y is not None and value("fl_x") is None:
        fy = 0.5 * height / float(np.tan(0.5 * angle_y))
    fx, fy = fx if fx is not None else fy, fy if fy is not None else fx
    if fx is None or fy is None:
        raise ValueError(f"{where}: has no focal length; it needs fl_x or camera_angle_x")
    return fx, fy


def _pose(where: str, matrix: Any) -> F64:
    try:
        pose = np.array(matrix, np.float64)
    except (TypeError, ValueError, OverflowError):
        pose = np.zeros(0)
    if pose.shape not in ((3, 4), (4, 4)) or not np.isfinite(pose).all():
        raise ValueError(f"{where}: transform_matrix must be 4 x 4 numbers")
    return _rigid(where, pose[:3, :3], pose[:3, 3])


def _rigid(where: str, axes: F64, position: F64) -> F64:
    """Return the pose with exactly orthonormal axes; a common scale of the axes has no effect on a camera."""
    scale = abs(float(np.linalg.det(axes))) ** (1.0 / 3.0)
    u, _, vt = np.linalg.svd(axes / (scale or 1.0))
    rotation = u @ vt
    if scale == 0.0 or np.abs(axes / scale - rotation).max() > ROUNDING or np.linalg.det(rotation) < 0.0:
        raise ValueError(f"{where}: its pose is no rotation and translation (its axes are skewed or mirrored)")
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = rotation, position
    return out


def _number(where: str, key: str, value: Any) -> float:
    try:
        out = float(value)
    except (TypeError, ValueError, OverflowError):
        out = float("nan")
    if not np.isfinite(out):
        raise ValueError(f"{where}: {key} must be a number, not {shown(value)}")
    return out


# ---------------------------------------------------------------- COLMAP
def _read_colmap(model: Path, folder: Path) -> list[Calibrated]:
    for name in ("cameras", "images"):
        if not (model / f"{name}.txt").is_file():
            binary = (model / f"{name}.bin").is_file()
            cure = ("convert the binary model: colmap model_converter --output_type TXT" if binary
                    else "choose the folder of COLMAP's text model, or a transforms.json")  # fmt: skip
            raise ValueError(f"calibration '{model}': has no {name}.txt; {cure}")
    lenses = {}
    file = model / "cameras.txt"
    for k, line in enumerate(_text(file).splitlines()):
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        where = f"calibration '{file}', line {k + 1}"
        if len(words) < 5:
            raise ValueError(f"{where}: must have an id, a model, width, height and parameters")
        values = [_number(where, "a parameter", word) for word in words[2:]]
        try:
            lenses[words[0]] = lens_of_model(where, words[1], round(values[0]), round(values[1]), values[2:])
        except ValueError as error:
            raise _located(where, error) from None
    file = model / "images.txt"
    # Two lines for each picture: its pose, and its points, which may be an empty line. Some programs write no points.
    lines = [(k, line) for k, line in enumerate(_text(file).splitlines()) if not line.lstrip().startswith("#")]
    out, k = [], 0
    while k < len(lines):
        number, line = lines[k]
        words = line.split(None, 9)
        if not words:
            k += 1
            continue
        where = f"calibration '{file}', line {number + 1}"
        if len(words) != 10:
            raise ValueError(f"{where}: must have an id, four numbers of a rotation, three of a translation, a camera "
                             "and a name")  # fmt: skip
        values = [_number(where, "the pose", word) for word in words[1:8]]
        if words[8] not in lenses:
            raise ValueError(f"{where}: camera {words[8]} is not in cameras.txt")
        to_camera = _rigid(where, _rotation(where, np.array(values[:4])), np.array(values[4:]))
        name = words[9].strip()
        out.append(Calibrated(name, folder / name, lenses[words[8]], np.linalg.inv(to_camera) @ TO_BLENDER))
        k += 2 if k + 1 < len(lines) and _are_points(lines[k + 1][1]) else 1
    return out


def _are_points(line: str) -> bool:
    """Whether a line holds points, three numbers each; a pose ends with the name of a file."""
    words = line.split()
    try:
        return len(words) % 3 == 0 and all(np.isfinite(float(word)) for word in words)
    except ValueError:
        return False


def _rotation(where: str, quaternion: F64) -> F64:
    length = float(np.linalg.norm(quaternion))
    if length == 0.0:
        raise ValueError(f"{where}: its rotation is the quaternion 0")
    w, x, y, z = quaternion / length
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip
