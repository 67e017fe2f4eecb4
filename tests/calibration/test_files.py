"""Files of calibrations: poses and intrinsics project points as their own conventions say; broken files are named."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from edgegrad import Camera, images
from edgegrad.calibration import Lens, read_calibration
from tests.calibration.colmap_files import colmap

# cos and sin of half the angles of two rotations.
A, B = 0.35, -0.6


def pixel(camera: Camera, point: Any) -> Any:
    """Where a camera of the scene sees a point, from its definition alone."""
    x, y, z = (np.linalg.inv(camera.to_world) @ [*point, 1.0])[:3]
    assert z < 0.0
    return camera.principal_point + camera.focal * np.array([x / -z, -y / -z])


def test_colmap(tmp_path: Path) -> None:
    """A point is where K (R X + t) says; the second line of a picture may be empty, and names may have blanks."""
    quaternion = np.array([np.cos(A), np.sin(A) * 0.6, 0.0, np.sin(A) * 0.8])
    row = " ".join(map(str, [*quaternion, 0.3, -0.2, 4.0]))
    cameras = "1 PINHOLE 64 48 80 80 33 23\n2 SIMPLE_RADIAL 64 48 70 32 24 0.1\n"
    model = colmap(tmp_path / "scene" / "sparse" / "0", cameras,
                   f"7 {row} 2 side view.png\n1.0 2.0 -1 3.0 4.0 5\n3 {row} 1 front.png\n\n")  # fmt: skip
    (tmp_path / "scene" / "images").mkdir()
    front, side = read_calibration(model)
    assert (front.name, side.name) == ("front.png", "side view.png")
    assert front.image == tmp_path / "scene" / "images" / "front.png"
    assert isinstance(side.lens, Lens) and side.lens.k1 == 0.1 and front.lens.shift == 0.0
    # The rotation matrix by Rodrigues' formula, independent of quaternions.
    axis, angle = np.array([0.6, 0.0, 0.8]), 2.0 * A
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    rotation = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    for point in ([0.1, 0.2, 0.3], [-0.5, 0.1, -0.2]):
        x, y, z = rotation @ point + [0.3, -0.2, 4.0]
        np.testing.assert_allclose(pixel(front.camera, point), [80 * x / z + 33, 80 * y / z + 23], rtol=1e-9)
    assert [one.name for one in read_calibration(model / "images.txt", tmp_path)] == ["front.png", "side view.png"]


def test_colmap_without_points(tmp_path: Path) -> None:
    """Some programs write one line for each picture."""
    rows = "".join(f"{k} 1 0 0 0 0.{k} 0 4 1 {k:04}.png\n" for k in range(1, 5))
    model = colmap(tmp_path / "sparse", "1 PINHOLE 64 48 80 80 33 23\n", rows)
    found = read_calibration(model, tmp_path)
    assert [one.name for one in found] == ["0001.png", "0002.png", "0003.png", "0004.png"]
    np.testing.assert_allclose([one.to_world[0, 3] for one in found], [-0.1, -0.2, -0.3, -0.4])


def test_transforms_json(tmp_path: Path) -> None:
    """Instant-NGP's form with intrinsics, and NeRF's with an angle and files without endings."""
    pose = np.eye(4)
    pose[:3, :3] = [[np.cos(B), 0, np.sin(B)], [0, 1, 0], [-np.sin(B), 0, np.cos(B)]]
    pose[:3, 3] = pose[:3, :3] @ [0.1, 0.2, 5.0]  # it looks about at the origin
    frames = [{"file_path": "./images/b.png", "transform_matrix": (2.0 * pose[:3]).tolist()},
              {"file_path": "./images/a.png", "transform_matrix": pose.tolist(), "fl_x": 60.0}]  # fmt: skip
    for frame in frames[:1]:  # a common scale of the axes is no other camera
        matrix = np.array(frame["transform_matrix"])
        matrix[:, 3] = pose[:3, 3]
        frame["transform_matrix"] = [*matrix.tolist(), [0, 0, 0, 1]]
    data = {"w": 64, "h": 48, "fl_x": 80.0, "fl_y": 80.0, "cx": 30.0, "cy": 25.0, "k1": 0.01, "p1": 0.02, "k4": 0.0,
            "is_fisheye": False, "rolling_shutter": [0, 0, 0], "aabb_scale": 4, "frames": frames}  # fmt: skip
    (tmp_path / "transforms.json").write_text(json.dumps(data))
    first, second = read_calibration(tmp_path / "transforms.json")
    assert (first.name, first.lens.fx, second.lens.fx) == ("a.png", 60.0, 80.0)
    assert isinstance(second.lens, Lens) and second.lens.p1 == 0.02
    for one in (first, second):
        np.testing.assert_allclose(one.to_world, pose, atol=1e-12)
    x, y, z = np.linalg.inv(pose)[:3, :3] @ ([0.2, 0.1, 0.0] - pose[:3, 3])
    np.testing.assert_allclose(pixel(second.camera, [0.2, 0.1, 0.0]), [80 * x / -z + 30, 80 * -y / -z + 25])

    images.write_image(tmp_path / "r_0.png", np.zeros((20, 30, 3), np.float32))
    data = {"camera_angle_x": 0.8, "frames": [{"file_path": "./r_0", "transform_matrix": pose.tolist()}]}
    (tmp_path / "transforms_train.json").write_text(json.dumps(data))
    (found,) = read_calibration(tmp_path / "transforms_train.json")
    assert found.image == tmp_path / "r_0.png" and (found.lens.width, found.lens.height) == (30, 20)
    assert found.camera.fov_x == pytest.approx(0.8) and found.camera.shift.any() == 0.0


LENS = {"w": 8, "h": 8, "fl_x": 9.0}
FRAME = {"file_path": "a.png", "transform_matrix": np.eye(4).tolist()}
BROKEN: dict[str, tuple[Any, str]] = {
    "no frames": ({}, "has no list 'frames'"),
    "none": ({**LENS, "frames": []}, "has no pictures"),
    "no focal length": ({"w": 8, "h": 8, "frames": [FRAME]}, "frame 0: has no focal length"),
    "no size": ({"fl_x": 9.0, "frames": [FRAME]}, "states no w and h, and its picture gives none .*a.png"),
    "model": ({**LENS, "camera_model": "FISHEYE624", "frames": [FRAME]}, "camera_model 'FISHEYE624' is not"),
    "k4": ({**LENS, "k4": 0.1, "frames": [FRAME]}, "has 'k4', which lenses that are no fisheyes do not have"),
    "shutter": ({**LENS, "rolling_shutter": [0, 0, 0.1], "frames": [FRAME]}, "has 'rolling_shutter'"),
    "text": ({**LENS, "fl_x": "wide", "frames": [FRAME]}, "fl_x must be a number, not 'wide'"),
    "huge": ({**LENS, "fl_x": 10**400, "frames": [FRAME]}, "fl_x must be a number"),
    "angle": ({"camera_angle_x": 4.0, "w": 8, "h": 8, "frames": [FRAME]}, "camera_angle_x must be between 0 and pi"),
    "skewed": ({**LENS, "frames": [{**FRAME, "transform_matrix": (np.eye(4) + np.eye(4, k=1)).tolist()}]}, "skewed"),
    "mirrored": ({**LENS, "frames": [{**FRAME, "transform_matrix": np.diag([1, 1, -1, 1]).tolist()}]}, "mirrored"),
    "no matrix": ({**LENS, "frames": [{"file_path": "a.png"}]}, "transform_matrix must be 4 x 4 numbers"),
    "no path": ({**LENS, "frames": [{}]}, "frame 0: has no file_path"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_broken_transforms_are_named(name: str, tmp_path: Path) -> None:
    data, words = BROKEN[name]
    (tmp_path / "transforms.json").write_text(json.dumps(data))
    with pytest.raises(ValueError, match=words):
        read_calibration(tmp_path / "transforms.json")


@pytest.mark.parametrize(
    ("cameras", "pictures", "words"),
    [
        ("1 EUCM 8 8 9 9 4 4 0.6 1.1\n", "", r"line 2: its camera model 'EUCM' is not supported"),
        ("1 PINHOLE 8 8 9 9 4\n", "", "line 2: camera model 'PINHOLE' has 4 parameters"),
        ("1 PINHOLE 8 8 9 9 4 x\n", "", "a parameter must be a number, not 'x'"),
        ("1 PINHOLE 0 8 9 9 4 4\n", "", "line 2: Lens: width must be between 1"),
        ("1 PINHOLE\n", "", "must have an id, a model"),
        ("1 PINHOLE 8 8 9 9 4 4\n", "1 1 0 0 0 0 0 0 2 a.png\n\n", "camera 2 is not in cameras.txt"),
        ("1 PINHOLE 8 8 9 9 4 4\n", "1 0 0 0 0 0 0 0 1 a.png\n\n", "the quaternion 0"),
        ("1 PINHOLE 8 8 9 9 4 4\n", "1 1 0 0 0 a.png\n\n", "line 2: must have an id, four numbers"),
        ("1 PINHOLE 8 8 9 9 4 4\n", "", "has no pictures"),
    ],
)
def test_broken_models_of_colmap_are_named(cameras: str, pictures: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=words):
        read_calibration(colmap(tmp_path, cameras, pictures))


def test_files_that_are_not_there_are_named(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"has no cameras.txt; choose the folder of COLMAP's text model"):
        read_calibration(tmp_path)
    (tmp_path / "cameras.bin").write_bytes(b"")
    with pytest.raises(ValueError, match="colmap model_converter --output_type TXT"):
        read_calibration(tmp_path)
    with pytest.raises(ValueError, match=r"none.json': can't be read"):
        read_calibration(tmp_path / "none.json")
    (tmp_path / "bad.json").write_text("{")
    with pytest.raises(ValueError, match=r"bad.json': is no JSON"):
        read_calibration(tmp_path / "bad.json")
