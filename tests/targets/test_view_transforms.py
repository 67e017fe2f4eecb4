"""Targets that Blender saved with a view transform are read as the light that was rendered."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
from edgegrad import images
from edgegrad.images.targets import target_of_codes
from edgegrad_addon import view_transforms
from edgegrad_addon.problem import Problem
from edgegrad_addon.view_transforms import view_of
from tests.support.scenes import blender_scenes as bs
from tests.targets.cycles_targets import TRUTH, ball, recolored, saved

SETTINGS = [("Standard", "None", 0.0, 1.0), ("AgX", "None", 0.0, 1.0), ("AgX", "AgX - Punchy", 0.5, 1.0),
            ("Filmic", "None", -1.0, 1.3)]  # fmt: skip


@pytest.mark.parametrize(("view", "look", "exposure", "gamma"), SETTINGS)
def test_view_transform_is_the_one_of_blender_and_its_inverse(view: Any, look: Any, exposure: Any, gamma: Any,
                                                              tmp_path: Any) -> None:  # fmt: skip
    scene = bs.empty()
    scene.render.dither_intensity = 0.0
    v = scene.view_settings
    v.view_transform, v.look, v.exposure, v.gamma = view, look, exposure, gamma
    light = np.ones((32, 32, 4), np.float32)
    light[..., :3] = 2.0 ** np.random.default_rng(0).uniform(-9, 2, (32, 32, 3))
    picture = bpy.data.images.new("Light", 32, 32, float_buffer=True)
    picture.pixels.foreach_set(light[::-1].ravel())
    picture.update()
    settings = scene.render.image_settings
    settings.file_format, settings.color_depth, settings.color_mode = "PNG", "16", "RGB"
    picture.save_render(str(tmp_path / "saved.png"), scene=scene)
    transform, _ = view_of(scene, tmp_path / "saved.png", "SCENE")
    assert transform is not None
    codes = images.linear_to_srgb(images.read_image(tmp_path / "saved.png"))
    assert np.abs(transform.encode(light[..., :3]) - codes).max() < 1e-4
    decoded, noise = transform.decode(np.round(255 * codes) / 255)
    known = noise < 0.2 * light[..., :3].mean(axis=2)  # where the transform is about linear over a code
    assert known.mean() > 0.4
    squares = (((decoded - light[..., :3])[known] / noise[known][:, None]) ** 2).sum(axis=1)
    # The errors are those that the noise states; Punchy has colours with a channel below its smallest value.
    assert 0.8 < np.sqrt(squares.mean()) < 1.5 and (squares > 11).mean() < 0.01


def test_noise_tells_of_other_lights_with_the_same_code() -> None:
    """High contrast maps many saturated colors to the same code: an error beyond 3.3 times the noise stays rare."""
    scene = bs.empty()
    scene.view_settings.view_transform, scene.view_settings.look = "AgX", "AgX - High Contrast"
    transform, _ = view_of(scene, Path("saved.png"), "SCENE")
    assert transform is not None
    light = 2.0 ** np.random.default_rng(1).uniform(-9, 2, (2000, 3))
    decoded, noise = transform.decode(np.round(255 * transform.encode(light)) / 255)
    known = noise < 0.2 * light.mean(axis=1)
    squares = (((decoded - light)[known] / noise[known][:, None]) ** 2).sum(axis=1)
    assert known.mean() > 0.5 and (squares > 11).mean() < 0.02
    grey = np.linspace(0.2, 0.8, 7)[:, None].repeat(3, axis=1)  # no channel of them is dark
    assert (transform.decode(grey)[1] < 0.03 * transform.decode(grey)[0].mean(axis=1)).all()


def test_origin_chooses_the_view(tmp_path: Any) -> None:
    scene = ball(size=8)
    scene.cycles.samples = 1
    for name, file_format in (("a.png", "PNG"), ("a.jpg", "JPEG")):
        transform, note = view_of(scene, saved(tmp_path / name, scene, file_format=file_format), "AUTO")
        assert transform is not None and transform.view == "AgX" and "Blender rendered it" in note
    photograph = tmp_path / "photo.png"
    images.write_image(photograph, np.full((8, 8, 3), 0.5, np.float32))
    transform, note = view_of(scene, photograph, "AUTO")
    assert transform == images.ViewTransform() and "--view scene" in note
    assert view_of(scene, tmp_path / "a.exr", "AUTO") == (None, "")
    assert view_of(scene, photograph, "agx")[0] == view_of(scene, photograph, "AgX")[0]


def test_what_cannot_be_undone_is_named(tmp_path: Any, monkeypatch: Any) -> None:
    scene = ball(size=8)
    path = tmp_path / "photo.png"
    images.write_image(path, np.full((8, 8, 3), 0.5, np.float32))
    with pytest.raises(ValueError, match=r"photo.png.*no view transform 'Agfa'.*AgX"):
        images.read_target(path, view_of(scene, path, "Agfa")[0])
    images.write_image(tmp_path / "light.exr", np.full((8, 8, 3), 0.5, np.float32))
    with pytest.raises(ValueError, match="is an EXR"):
        images.read_target(tmp_path / "light.exr", view_of(scene, path, "AgX")[0])
    images.write_image(path, np.ones((8, 8, 3), np.float32))
    with pytest.raises(ValueError, match="all of its pixels are clipped"):
        images.read_target(path)
    scene.view_settings.use_curve_mapping = True
    with pytest.raises(Problem, match="'Use Curves' off"):
        view_of(scene, path, "SCENE")
    monkeypatch.setitem(__import__("sys").modules, "PyOpenColorIO", None)
    monkeypatch.setattr(view_transforms, "_with_library", lambda transform: transform)
    with pytest.raises(ImportError, match="pip install opencolorio"):
        images.read_target(path, view_of(scene, path, "AgX")[0])


def test_gradient_at_the_truth_is_zero_within_noise(tmp_path: Any) -> None:
    """Of an 8-bit AgX picture by Cycles of the same scene; if it is read as sRGB, the gradient is far from zero."""
    scene = ball()
    scene.cycles.samples = 256
    path = saved(tmp_path / "agx.png", scene)
    export = bs.export()
    wrt = ["materials.Clay.base_color"]

    def gradients(choice: str) -> Any:
        found = images.read_target(path, view_of(scene, path, choice)[0])
        renderer = edgegrad.Renderer(export.scene)
        out = []
        for seed in range(16):
            picture = renderer.render(spp=16, seed=seed)
            adjoint = edgegrad.losses.l2(picture, found.image, found.weight)[1]
            out.append(renderer.render_backward(adjoint, wrt, spp=16, seed=100 + seed)[wrt[0]])
        return np.array(out)

    def z(values: Any) -> Any:
        """Mean, and its standard error by the noise of the renders."""
        return np.abs(values.mean(axis=0)), values.std(axis=0, ddof=1) / np.sqrt(len(values))

    mean, error = z(gradients("AUTO"))
    wrong, _ = z(gradients("SRGB"))
    # The target's own noise is not in the standard error; 2 % of the wrong gradient allows for it.
    assert (mean < 5 * error + 0.02 * wrong).all(), (mean, error, wrong)
    assert (wrong > 50 * mean).any()


def test_color_is_recovered_from_agx_about_as_well_as_from_linear(tmp_path: Any) -> None:
    scene = ball()
    scene.cycles.samples = 256
    scene.render.resolution_x = scene.render.resolution_y = 24
    agx = saved(tmp_path / "agx.png", scene)
    linear = saved(tmp_path / "linear.exr", scene, "32", "OPEN_EXR")
    recolored()
    from edgegrad_addon.parameters import Names
    from edgegrad_addon.session import Picture, Request, Session

    errors = {}
    for path in (agx, linear):
        request = Request([Picture("Front", str(path))], Names(base_color=("Clay",)), iterations=150, samples=16)
        result = Session.prepare(bpy.context, request).run()
        errors[path.suffix] = np.abs(result.values["materials.Clay.base_color"] - TRUTH).max()
    assert errors[".png"] < 2 * errors[".exr"] + 2e-3, errors


def test_pixels_of_ordinary_light_count_alike() -> None:
    """Weights by the rounding alone would lose what the errors of neighbouring pixels of a render cancel."""
    codes = np.repeat(np.linspace(0.1, 0.95, 64)[None, :, None], 3, axis=2)
    weight = target_of_codes("ramp", np.concatenate([codes, np.ones((1, 2, 3))], axis=1)).weight
    assert weight is not None
    assert weight[0, :64].min() > 0.9 and (weight[0, 64:] == 0.0).all()
