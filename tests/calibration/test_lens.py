"""Lenses: the model, and pictures without distortion, of patterns that are known everywhere."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from edgegrad.calibration import MODELS, Lens, intrinsics, lens_of_model

CURVED = Lens(96, 64, 80.0, 84.0, 50.0, 30.0, k1=-0.25, k2=0.06, k3=-0.01, p1=0.004, p2=-0.003)


def pattern(ideal: Any) -> Any:
    """A smooth picture, as a function of ideal coordinates."""
    x, y = ideal[..., 0], ideal[..., 1]
    return np.stack([1.0 + np.sin(9.0 * x) * np.cos(7.0 * y), 1.0 + x, 1.0 + y * y], axis=-1)


def ideal_of(lens: Lens, pixels: Any) -> Any:
    """Invert the model by a search that knows only `distort`: Newton's method with differences."""
    at = (pixels - [lens.cx, lens.cy]) / [lens.fx, lens.fy]
    for _ in range(30):
        here = lens.distort(at)
        columns = [(lens.distort(at + 1e-6 * np.eye(2)[k]) - here) / 1e-6 for k in range(2)]
        at = at - np.linalg.solve(np.stack(columns, axis=-1), (here - pixels)[..., None])[..., 0]
    return at


def centres(lens: Lens) -> Any:
    return np.stack(np.meshgrid(np.arange(lens.width) + 0.5, np.arange(lens.height) + 0.5), axis=-1)


def test_undistorted_picture_is_that_of_the_camera() -> None:
    picture = pattern(ideal_of(CURVED, centres(CURVED))).astype(np.float32)
    found, weight = CURVED.undistort(picture)
    expected = pattern((centres(CURVED) - [CURVED.cx, CURVED.cy]) / CURVED.fx)
    seen = weight > 0.999
    assert seen.mean() > 0.8
    # What remains is the error of linear interpolation, an eighth of the second derivative over a pixel squared.
    assert np.abs(found - expected)[seen].max() < 81.0 / 80.0**2
    assert np.abs(picture - expected)[seen].max() > 0.1
    camera = CURVED.camera(np.eye(4))
    np.testing.assert_allclose(camera.principal_point, [CURVED.cx, CURVED.cy])
    assert camera.focal == pytest.approx(CURVED.fx) and camera.pixel_aspect == 1.0


def test_pixels_outside_have_no_weight_and_ignored_ones_no_part() -> None:
    zoomed = Lens(32, 32, 30.0, 30.0, 16.0, 16.0, k1=0.4)  # a pincushion: the corners come from outside
    picture = np.ones((32, 32, 3), np.float32)
    _, weight = zoomed.undistort(picture)
    assert weight[0, 0] == 0.0 and weight[16, 16] == 1.0
    mask = np.ones((32, 32))
    mask[:, :10] = 0.0
    picture[:, :10] = 1e6
    found, weight = zoomed.undistort(picture, mask)
    assert found[weight > 0.0].max() == pytest.approx(1.0, abs=1e-6) and (weight[4:28, 12:20] > 0.0).all()


def test_pictures_in_several_bands_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    picture = np.random.default_rng(0).random((64, 96, 3)).astype(np.float32)
    found, weight = CURVED.undistort(picture)
    monkeypatch.setattr(intrinsics, "BAND", 5 * 96)
    again, weights = CURVED.undistort(picture)
    np.testing.assert_array_equal(found, again)
    np.testing.assert_array_equal(weight, weights)
    assert CURVED.shift > 1.0


def test_folds_of_the_polynomial_have_no_weight() -> None:
    """1 - r² falls from r = 0.577 on: the model shows the middle again at the border."""
    folded = Lens(64, 64, 30.0, 30.0, 32.0, 32.0, k1=-1.0)
    _, weight = folded.undistort(np.ones((64, 64, 3), np.float32))
    radius = np.linalg.norm((centres(folded) - 32.0) / 30.0, axis=2)
    assert (weight[radius > 0.58] == 0.0).all() and (weight[radius < 0.57] > 0.0).all()


def test_a_lens_without_distortion_leaves_pictures_as_they_are() -> None:
    plain = Lens(16, 8, 20.0, 20.0, 7.0, 5.0)
    picture = np.random.default_rng(0).random((8, 16, 3)).astype(np.float32)
    found, weight = plain.undistort(picture)
    assert plain.shift == 0.0 and found is picture and (weight == 1.0).all()
    large = CURVED.of_size(640, 960)
    ideal = np.random.default_rng(0).uniform(-0.4, 0.4, (9, 2))
    np.testing.assert_allclose(large.distort(ideal), 10.0 * CURVED.distort(ideal))


def test_models_of_colmap() -> None:
    """The special cases are those of their names; the formulas written out."""
    x, y = 0.3, -0.2
    r2 = x * x + y * y
    expected = {
        "SIMPLE_PINHOLE": (1.0, 0.0, 0.0), "PINHOLE": (1.0, 0.0, 0.0), "SIMPLE_RADIAL": (1 + 0.1 * r2, 0.0, 0.0),
        "RADIAL": (1 + 0.1 * r2 + 0.02 * r2 * r2, 0.0, 0.0),
        "OPENCV": (1 + 0.1 * r2 + 0.02 * r2 * r2, 0.03, -0.04),
    }  # fmt: skip
    values = {"f": 50.0, "fx": 50.0, "fy": 60.0, "cx": 20.0, "cy": 10.0, "k1": 0.1, "k2": 0.02, "p1": 0.03, "p2": -0.04}
    for name, (radial, p1, p2) in expected.items():
        lens = lens_of_model("here", name, 40, 20, [values[key] for key in MODELS[name]])
        fy = 60.0 if "fy" in MODELS[name] else 50.0
        moved_x = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
        moved_y = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
        assert isinstance(lens, Lens)
        np.testing.assert_allclose(lens.distort([x, y]), [50.0 * moved_x + 20.0, fy * moved_y + 10.0], rtol=1e-12)
    full = lens_of_model("here", "FULL_OPENCV", 40, 20, [50, 60, 20, 10, 0.1, 0.02, 0, 0, 0.3, 0.4, 0.5, 0.6])
    assert isinstance(full, Lens) and (full.k3, full.k4, full.k5, full.k6) == (0.3, 0.4, 0.5, 0.6)
    with pytest.raises(ValueError, match=r"here: its camera model 'EUCM' is not supported .*undistort"):
        lens_of_model("here", "EUCM", 40, 20, [1.0] * 6)
    with pytest.raises(ValueError, match=r"'PINHOLE' has 4 parameters \(fx, fy, cx, cy\), not 3"):
        lens_of_model("here", "PINHOLE", 40, 20, [1.0] * 3)
