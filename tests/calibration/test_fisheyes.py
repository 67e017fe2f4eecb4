"""Fisheyes and panoramas: cameras and pictures show points where the formulas of OpenCV, COLMAP and nerfstudio do."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from edgegrad import Camera, Material, Renderer, Scene
from edgegrad.calibration import MODELS, FisheyeLens, Intrinsics, PanoramaLens, lens_of_model, read_calibration
from edgegrad.geometry.camera_view import panorama_rays
from tests.calibration.colmap_files import colmap
from tests.support.small_scenes import need, rectangle

FLAT = np.diag([1.0, -1.0, -1.0])  # Blender's axes to Y down and Z forward
# A lens with a usual distortion; one that sees behind itself, with oblong pixels and its axis away from the middle; one
# whose formula folds back within the picture; exact equidistant ones.
USUAL = FisheyeLens(876, 584, 394.0, 394.0, 440.0, 288.0, k1=-0.029, k2=-0.0042, k3=0.0019, k4=-0.0004)
WIDE = FisheyeLens(220, 200, 62.0, 66.0, 116.0, 93.0, k1=-0.04, k2=0.004, k3=-0.0003)
FOLDED = FisheyeLens(240, 180, 70.0, 70.0, 120.0, 90.0, k1=-1 / 6, k2=1 / 120, k3=-1 / 5040)
EQUIDISTANT = FisheyeLens(200, 150, 70.0, 70.0, 104.0, 71.0)
LENSES = {"usual": USUAL, "wide": WIDE, "folded": FOLDED, "equidistant": EQUIDISTANT}


def opencv(lens: FisheyeLens, point: Any) -> Any:
    """Where OpenCV's cv2.fisheye has a point, by its documentation, with the angle by atan2."""
    x, y, z = point
    aside = math.hypot(x, y)
    theta = math.atan2(aside, z)
    distorted = theta * (1 + lens.k1 * theta**2 + lens.k2 * theta**4 + lens.k3 * theta**6 + lens.k4 * theta**8)
    return np.array([lens.fx * distorted * x / aside + lens.cx, lens.fy * distorted * y / aside + lens.cy])


def centres(lens: Intrinsics) -> Any:
    return np.stack(np.meshgrid(np.arange(lens.width) + 0.5, np.arange(lens.height) + 0.5), axis=-1)


def rays(lens: Intrinsics, places: Any) -> Any:
    """Directions that the camera of a lens has at places of its picture, with Y down and Z forward."""
    return panorama_rays(lens.camera(np.eye(4)), places.reshape(-1, 2)).reshape(*places.shape[:-1], 3) @ FLAT


def pattern(directions: Any) -> Any:
    """A smooth picture, as a function of unit directions."""
    x, y, z = np.moveaxis(directions, -1, 0)
    return np.stack([2.0 + np.sin(7.0 * x) * np.cos(5.0 * y), 2.0 + x + z, 2.0 + y], axis=-1)


@pytest.mark.parametrize("name", ["usual", "equidistant"])
def test_cameras_see_points_where_opencv_does(name: str) -> None:
    """The bound is that of pictures that are kept; without distortion it is rounding."""
    lens = FisheyeLens(**{**vars_of(USUAL), "width": 438, "height": 292, "fx": 197.0, "fy": 197.0, "cx": 220.0,
                          "cy": 144.0}) if name == "usual" else EQUIDISTANT  # fmt: skip
    lens.camera(np.eye(4)).validate()
    places = centres(lens)[::7, ::7].reshape(-1, 2)
    off = [opencv(lens, direction) - place for place, direction in zip(places, rays(lens, places), strict=True)]
    assert np.abs(off).max() < (0.1 if name == "usual" else 1e-9)
    assert np.abs(off).max() <= lens.shift + 1e-9 and lens.keeps_pictures
    picture = np.random.default_rng(0).random((lens.height, lens.width, 3)).astype(np.float32)
    found, weight = lens.undistort(picture)
    assert found is picture and (weight == 1.0).all()


def vars_of(lens: FisheyeLens) -> dict[str, Any]:
    return {name: getattr(lens, name) for name in FisheyeLens.checks}


@pytest.mark.parametrize("name", LENSES)
def test_points_are_projected_as_opencv_does(name: str) -> None:
    lens = LENSES[name]
    rng = np.random.default_rng(1)
    for angle, turn in zip(rng.uniform(0.01, 1.45, 20), rng.uniform(0.0, 6.3, 20), strict=True):
        point = 3.0 * np.array([math.sin(angle) * math.cos(turn), math.sin(angle) * math.sin(turn), math.cos(angle)])
        np.testing.assert_allclose(lens.project(point), opencv(lens, point), rtol=1e-12)
    np.testing.assert_allclose(lens.project([0.0, 0.0, 2.0]), [lens.cx, lens.cy])


@pytest.mark.parametrize("name", ["wide", "folded"])
def test_pictures_are_those_of_the_camera(name: str) -> None:
    """What the polynomial of the camera does not have, and oblong pixels, are taken out of the picture."""
    lens = LENSES[name]
    assert lens.shift > 0.5 and not lens.keeps_pictures
    # The picture, whose rays come from a search for the angle
    offsets = (centres(lens) - [lens.cx, lens.cy]) / [lens.fx, lens.fy]
    radius = np.hypot(*np.moveaxis(offsets, -1, 0))
    widest = 0.5 * np.pi if name == "folded" else np.pi
    low, high = np.zeros_like(radius), np.full_like(radius, widest)
    for _ in range(50):
        middle = 0.5 * (low + high)
        t = middle**2
        below = middle * (1 + t * (lens.k1 + t * (lens.k2 + t * (lens.k3 + t * lens.k4)))) < radius
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    aside = offsets * (np.sin(low) / radius)[..., None]
    taken = pattern(np.concatenate([aside, np.cos(low)[..., None]], axis=-1)).astype(np.float32)
    taken[low > widest - 1e-9] = 1e6  # of nothing
    found, weight = lens.undistort(taken, np.where(low > widest - 1e-9, 0.0, 1.0))
    # At the picture's border there is nothing to interpolate with
    border = np.pad(np.ones((lens.height - 2, lens.width - 2)), 1)
    _, inside = lens.undistort(np.ones((lens.height, lens.width, 1)), border)
    seen = (weight > 0.999) & (inside > 0.999)
    camera = lens.camera(np.eye(4))
    camera.validate()
    expected = pattern(rays(lens, centres(lens)))
    assert np.isfinite(expected[seen]).all() and camera.pixel_aspect == 1.0
    # What remains is the error of linear interpolation, an eighth of the second derivative over a pixel squared. Angles
    # of neighbouring pixels differ most at the border.
    inner = seen & (np.arccos(rays(lens, centres(lens))[..., 2]) < 0.8 * widest)
    assert inner.mean() > (0.3 if name == "folded" else 0.7)
    assert np.abs(found - expected)[inner].max() < 0.01
    if name == "wide":
        assert np.abs(taken - expected)[inner].max() > 0.03


def test_folds_have_no_weight_and_are_seen() -> None:
    """The picture has nothing beyond 90 degrees; the camera sees more there, lest pixels of the border are black."""
    _, weight = FOLDED.undistort(np.ones((180, 240, 3), np.float32))
    along = rays(FOLDED, centres(FOLDED))[..., 2]
    assert (weight[along < 0.0] == 0.0).all() and (weight[along > 0.05] > 0.0).all() and (weight[0, 0] == 0.0).all()
    assert FOLDED.camera(np.eye(4)).disc > 70.0 + 2.0
    assert np.isnan(FOLDED.project([1.0, 0.0, -0.1])).all()


def test_renders_show_points_where_opencv_does() -> None:
    """Glowing squares, of which one is behind the camera."""
    need("native")
    lens = FisheyeLens(128, 96, 33.0, 33.0, 70.0, 45.0, k1=-0.02, k2=0.004)
    assert lens.keeps_pictures
    camera = lens.camera(np.eye(4))
    camera.clip_start = 0.0
    for angle, turn in ((0.4, 0.7), (1.2, 2.5), (1.75, 3.4)):
        point = np.array([math.sin(angle) * math.cos(turn), math.sin(angle) * math.sin(turn), math.cos(angle)])
        away = FLAT @ point
        side = np.cross(away, [0.0, 1.0, 0.0])
        side /= np.linalg.norm(side)
        square = rectangle(tuple(4.0 * away), tuple(0.1 * side), tuple(0.1 * np.cross(side, away)), "glow")
        image = Renderer(Scene(camera, {"lamp": square}, {"glow": Material(np.zeros(3), np.ones(3))})).render(
            spp=4096, max_depth=1)[..., 0]  # fmt: skip
        y, x = np.mgrid[:96, :128] + 0.5
        np.testing.assert_allclose([(x * image).sum() / image.sum(), (y * image).sum() / image.sum()],
                                   opencv(lens, point), atol=0.15)  # fmt: skip


def test_cameras_of_lenses_that_polynomials_follow_badly_grow() -> None:
    """Any lens has a camera, and what the picture has of it."""
    rng = np.random.default_rng(3)
    for _ in range(60):
        focal = 10.0 ** rng.uniform(0.5, 2.0, 2)
        lens = FisheyeLens(60, 40, *focal, rng.uniform(-10, 70), rng.uniform(0, 40),
                           *(rng.normal(size=4) * 10.0 ** rng.uniform(-3, 0)))  # fmt: skip
        lens.camera(np.eye(4)).validate()
        places = centres(lens)
        source, seen = lens._source(places)
        # The lens has the camera's rays where `undistort` takes pixels from
        np.testing.assert_allclose(lens.project(rays(lens, places)[seen]), source[seen], atol=1e-6)


def test_models_of_colmap() -> None:
    x, y, z = 0.5, -0.3, 0.8
    theta = math.atan2(math.hypot(x, y), z)
    values = {"f": 50.0, "fx": 50.0, "fy": 60.0, "cx": 20.0, "cy": 10.0, "k1": 0.1, "k2": 0.02, "k3": -0.03, "k4": 0.01,
              "omega": 0.9}  # fmt: skip
    expected = {
        "SIMPLE_FISHEYE": theta, "FISHEYE": theta,
        "SIMPLE_RADIAL_FISHEYE": theta * (1 + 0.1 * theta**2),
        "RADIAL_FISHEYE": theta * (1 + 0.1 * theta**2 + 0.02 * theta**4),
        "OPENCV_FISHEYE": theta * (1 + 0.1 * theta**2 + 0.02 * theta**4 - 0.03 * theta**6 + 0.01 * theta**8),
        "FOV": math.atan(2 * math.hypot(x, y) / z * math.tan(0.45)) / 0.9,
    }  # fmt: skip
    for name, radius in expected.items():
        lens = lens_of_model("here", name, 40, 20, [values[key] for key in MODELS[name]])
        assert isinstance(lens, FisheyeLens)
        fy = 60.0 if "fy" in MODELS[name] else 50.0
        aside = math.hypot(x, y)
        at = [50.0 * radius * x / aside + 20.0, fy * radius * y / aside + 10.0]
        np.testing.assert_allclose(lens.project([x, y, z]), at, rtol=1e-12)
    with pytest.raises(ValueError, match=r"here: omega of camera model 'FOV' must be 0.001 or more, not 0; use"):
        lens_of_model("here", "FOV", 40, 20, [50.0, 50.0, 20.0, 10.0, 0.0])


@pytest.mark.parametrize("crop", [False, True])
def test_panoramas(crop: bool) -> None:
    """The longitude is pi (x - cx) / fx, and the latitude likewise; all directions have fx = w / 2 and fy = h."""
    whole = lens_of_model("here", "EQUIRECTANGULAR", 64, 32, [64, 32])
    lens = PanoramaLens(50, 30, 60.0, 55.0, 20.0, 25.0) if crop else whole
    places = centres(lens)[::7, ::5].reshape(-1, 2)
    for place, direction in zip(places, rays(lens, places), strict=True):
        theta = -np.pi * (place[0] - lens.cx) / lens.fx
        phi = np.pi * (0.5 + (place[1] - lens.cy) / lens.fy)
        nerfstudio = np.array([-np.sin(theta) * np.sin(phi), np.cos(phi), -np.cos(theta) * np.sin(phi)])
        np.testing.assert_allclose(direction @ FLAT, nerfstudio, atol=1e-12)
    assert lens.keeps_pictures
    with pytest.raises(ValueError, match="PanoramaLens: its picture spans 360 x 360 degrees, more than all"):
        PanoramaLens(64, 64, 32.0, 32.0, 32.0, 32.0)


def test_files(tmp_path: Path) -> None:
    """transforms.json of Instant-NGP and nerfstudio, and COLMAP's text."""
    frame = {"file_path": "a.png", "transform_matrix": np.eye(4).tolist()}
    size = {"w": 876, "h": 584, "cx": 440.0, "cy": 288.0}
    fisheye = {**size, "fl_x": 394.0, "fl_y": 394.0, "camera_angle_x": 1.7, "p1": 0.0,
               **{key: getattr(USUAL, key) for key in ("k1", "k2", "k3", "k4")}}  # fmt: skip
    path = tmp_path / "transforms.json"

    def read(data: dict[str, Any]) -> Intrinsics:
        path.write_text(json.dumps({**data, "frames": [frame]}))
        return read_calibration(path)[0].lens

    assert read({**fisheye, "camera_model": "OPENCV_FISHEYE"}) == USUAL == read({**fisheye, "is_fisheye": True})
    whole = PanoramaLens(64, 32, 32.0, 32.0, 32.0, 16.0)
    assert read({"w": 64, "h": 32, "camera_model": "EQUIRECTANGULAR"}) == whole
    assert read({"w": 64, "h": 32, "latlong": True, "fl_x": 9.0}) == whole
    row = "1 1 0 0 0 0 0 0 1 a.png\n\n"
    text = f"1 OPENCV_FISHEYE 876 584 394 394 440 288 {USUAL.k1} {USUAL.k2} {USUAL.k3} {USUAL.k4}\n"
    (found,) = read_calibration(colmap(tmp_path / "sparse", text, row), tmp_path)
    assert found.lens == USUAL and isinstance(found.camera, Camera) and found.camera.kind == "FISHEYE_POLYNOMIAL"


LENS = {"w": 8, "h": 8, "fl_x": 9.0, "frames": [{"file_path": "a.png", "transform_matrix": np.eye(4).tolist()}]}
BROKEN: dict[str, tuple[dict[str, Any], str]] = {
    "angle": ({**LENS, "fl_x": None, "camera_angle_x": 1.0, "is_fisheye": True}, "a fisheye needs fl_x, since"),
    "tangential": ({**LENS, "camera_model": "OPENCV_FISHEYE", "p1": 0.1}, "has 'p1', which fisheyes do not have"),
    "panorama": ({**LENS, "camera_model": "EQUIRECTANGULAR", "k1": 0.1}, "has 'k1', which panoramas do not have"),
    "sphere": ({**LENS, "fl_x": 2.0, "camera_model": "EQUIRECTANGULAR"}, "frame 0: PanoramaLens: its picture spans 7"),
    "equal areas": ({**LENS, "equirectangular": True}, "has 'equirectangular', a camera that is not supported"),
    "folded": ({**LENS, "is_fisheye": True, "k1": -1e9}, "frame 0: FisheyeLens: k1 to k4 make its picture fold back"),
    "model": ({**LENS, "camera_model": "THIN_PRISM_FISHEYE"}, "camera_model 'THIN_PRISM_FISHEYE' is not supported"),
    "far": ({**LENS, "is_fisheye": True, "cx": 1e30}, r"picture 'a\.png': camera: shift "),
}


@pytest.mark.parametrize("name", BROKEN)
def test_broken_lenses_are_named(name: str, tmp_path: Path) -> None:
    data, words = BROKEN[name]
    (tmp_path / "transforms.json").write_text(json.dumps(data))
    with pytest.raises(ValueError, match=words):
        read_calibration(tmp_path / "transforms.json")
