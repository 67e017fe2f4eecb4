"""Targets as rows of the panel and as options of the command line: what becomes of each setting."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

import argparse
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad_addon
from edgegrad import images
from edgegrad_addon.parameters import Names
from edgegrad_addon.problem import Problem
from edgegrad_addon.properties import request
from edgegrad_addon.session import Request, Session
from edgegrad_addon.targets import options
from edgegrad_addon.targets.draw import draw_details, draw_target
from edgegrad_addon.targets.pictures import Picture, silhouette_objects
from tests.support.scenes import blender_scenes as bs
from tests.targets.cycles_targets import TRUTH, ball, recolored, saved


def parsed(*texts: str) -> list[Picture]:
    parser = argparse.ArgumentParser()
    options.add_arguments(parser)
    return options.pictures(parser.parse_args(texts))


def prepared(*pictures: Picture) -> Session:
    return Session.prepare(bpy.context, Request(list(pictures), Names(base_color=("Clay",)), iterations=1, samples=1))


def levels(count: int = 3) -> list[Any]:
    """Grey pictures with a bright bar on top, of growing brightness."""
    out = []
    for k in range(count):
        image = np.full((32, 32, 3), 0.1 * (k + 1), np.float32)
        image[:6] = 0.7
        out.append(image)
    return out


def test_options_are_those_of_their_camera_or_of_all() -> None:
    ball()
    bs.camera((5, 0, 0), (0, 1.57, 0), name="Side = 2")
    front, side, outline = parsed(
        "--target", "Front=a.exr", "--target", "Side = 2=b=c.png", "--silhouette", "Front=m.png",
        "--silhouette-of", "Cube", "--exposure", "fit:day", "--exposure", "Side = 2=1.5", "--alpha", "mask",
        "--weight", "2", "--weight", "Side = 2=0.5", "--frame", "Front=7", "--view", "sRGB",
    )  # fmt: skip
    assert front == Picture("Front", "a.exr", "", "sRGB", 2.0, "exposure", "day", "mask", frame=7)
    assert side.image == "b=c.png" and side.gain == pytest.approx(2.0**1.5) and (side.weight, side.frame) == (0.5, None)
    assert outline == Picture("Front", "m.png", weight=2.0, silhouette_of=("Cube",), frame=7)
    assert parsed("--target", "Front=a.exr", "--exposure", "balance")[0].gain == "white balance"


@pytest.mark.parametrize(
    ("texts", "words"),
    [
        (["--target", "Front=a", "--exposure", "bright"], "--exposure 'bright': must be a number of stops"),
        (["--target", "Front=a", "--exposure", "nan"], "--exposure 'nan'"),
        (["--target", "Front=a", "--exposure", "Back=1"], "camera 'Back' has no --target"),
        (["--target", "Front=a", "--weight", "0"], "--weight '0': must be a number above 0"),
        (["--target", "Front=a", "--weight", "1", "--weight", "2"], "name a camera, as CAMERA=WEIGHT"),
        (["--target", "Front=a", "--alpha", "none"], "must be world or mask"),
        (["--target", "Front=a", "--frame", "x"], "--frame 'x': must be a whole number"),
        (["--silhouette", "Front=a"], "--silhouette-of NAME"),
        (["--target", "Front=a", "--silhouette-of", "Cube"], "there is no --silhouette"),
    ],
)
def test_wrong_options_are_named(texts: list[str], words: str) -> None:
    ball()
    with pytest.raises(Problem, match=words):
        parsed(*texts)


def test_rows_of_the_panel_have_the_same_settings(tmp_path: Any) -> None:
    edgegrad_addon.register()
    try:
        scene = ball()
        row = scene.edgegrad.targets.add()
        row.camera, row.image, row.weight = bpy.data.objects["Front"], "a.exr", 2.0
        row.exposure, row.stops = "FIXED", -1.0
        assert request(bpy.context).pictures == [Picture("Front", "a.exr", weight=2.0, gain=0.5)]
        row.exposure, row.shared, row.alpha = "white balance", "day", "mask"
        row.datablock, row.use_frame, row.frame = bpy.data.images.new("Painted", 4, 4), True, 3
        assert request(bpy.context).pictures == [
            Picture("Front", "a.exr", weight=2.0, gain="white balance", shared="day", alpha="mask", datablock="Painted",
                    frame=3)
        ]  # fmt: skip
        row.kind = "SILHOUETTE"
        with pytest.raises(Problem, match="choose its Object or Collection"):
            request(bpy.context)
        row.silhouette_object = bpy.data.objects["Cube"]
        assert request(bpy.context).pictures[0].silhouette_of == ("Cube",)
    finally:
        edgegrad_addon.unregister()


class Layout:
    """Records which properties of an item are drawn; a name that the item does not have is an error."""

    def __init__(self) -> None:
        self.drawn: list[str] = []

    def prop(self, item: Any, name: str) -> None:
        assert name in item.bl_rna.properties
        self.drawn.append(name)


def test_panel_shows_what_the_kind_of_target_uses(tmp_path: Any) -> None:
    edgegrad_addon.register()
    try:
        row = ball().edgegrad.targets.add()

        def drawn() -> set[str]:
            layout = Layout()
            draw_target(layout, row)
            draw_details(layout, row)
            return set(layout.drawn)

        everywhere = {"camera", "image", "datablock", "kind", "mask", "weight"}
        assert drawn() == everywhere | {"alpha", "view", "exposure", "stops"}
        row.exposure, row.image = "exposure", "shot.mp4"
        assert drawn() == everywhere | {"alpha", "view", "exposure", "shared", "use_frame"}
        row.kind, row.use_frame = "SILHOUETTE", True
        assert drawn() == everywhere | {"silhouette_object", "silhouette_collection", "use_frame", "frame"}
    finally:
        edgegrad_addon.unregister()


def movie(folder: Any, pictures: list[Any]) -> str:
    """A lossless movie of the pictures."""
    for k, image in enumerate(pictures):
        images.write_image(folder / f"in_{k + 1:03d}.png", image)
    scene = bpy.data.scenes.new("Movie")
    editor = scene.sequence_editor_create()
    strips = editor.strips if hasattr(editor, "strips") else editor.sequences
    strip = strips.new_image("in", str(folder / "in_001.png"), 1, 1)
    for k in range(1, len(pictures)):
        strip.elements.append(f"in_{k + 1:03d}.png")
    scene.frame_start, scene.frame_end = 1, len(pictures)
    render = scene.render
    render.resolution_y, render.resolution_x = pictures[0].shape[:2]
    render.resolution_percentage, render.dither_intensity = 100, 0.0
    scene.view_settings.view_transform = "Standard"
    if hasattr(render.image_settings, "media_type"):
        render.image_settings.media_type = "VIDEO"
    render.image_settings.file_format = "FFMPEG"
    render.ffmpeg.format, render.ffmpeg.codec, render.ffmpeg.constant_rate_factor = "MPEG4", "H264", "LOSSLESS"
    render.use_file_extension, render.filepath = False, str(folder / "movie.mp4")
    bpy.ops.render.render(animation=True, scene="Movie")
    bpy.data.scenes.remove(scene)
    return str(folder / "movie.mp4")


def test_frames_of_movies_are_targets(tmp_path: Any) -> None:
    scene = ball()
    pictures = levels()
    path = movie(tmp_path, pictures)
    before = len(bpy.data.scenes)
    for frame in (1, 2, 3):
        for picture in (Picture("Front", path, frame=frame),
                        Picture("Front", "", datablock=bpy.data.images.load(path).name, frame=frame)):  # fmt: skip
            (target,) = prepared(picture).targets
            # A movie stores colours in 8 bits of luma and chroma.
            np.testing.assert_allclose(target.image, pictures[frame - 1], atol=0.02)
    scene.frame_set(2)
    np.testing.assert_allclose(prepared(Picture("Front", path)).targets[0].image, pictures[1], atol=0.02)
    assert len(bpy.data.scenes) == before
    with pytest.raises(Problem, match="has 3 frames, but frame 4 is wanted"):
        prepared(Picture("Front", path, frame=4))
    (tmp_path / "broken.mp4").write_bytes(b"no movie")
    with pytest.raises(Problem, match=r"broken.mp4': can't be read"):
        prepared(Picture("Front", str(tmp_path / "broken.mp4"), frame=1))


def test_images_of_the_blend_are_targets(tmp_path: Any) -> None:
    def same(image: Any, frame: int, expected: Any) -> None:
        (target,) = prepared(Picture("Front", "", datablock=image.name, frame=frame)).targets
        np.testing.assert_allclose(np.asarray(target.image)[..., :3], expected, atol=4e-3)

    ball()
    pictures = levels()
    for k, image in enumerate(pictures):
        images.write_image(tmp_path / f"shot_{k + 8:04d}.png", image)
    image = bpy.data.images.load(str(tmp_path / "shot_0008.png"))
    same(image, 1, pictures[0])
    image.source = "SEQUENCE"
    same(image, 10, pictures[2])
    with pytest.raises(Problem, match=r"sequence has no file 'shot_0011.png'"):
        prepared(Picture("Front", "", datablock=image.name, frame=11))
    image.source = "FILE"
    image.pack()
    (tmp_path / "shot_0008.png").unlink()
    same(image, 1, pictures[0])
    light = np.random.default_rng(0).uniform(0.0, 3.0, (32, 32, 4)).astype(np.float32)
    light[..., 3] = 1.0
    painted = bpy.data.images.new("Painted", 32, 32, float_buffer=True)
    painted.pixels.foreach_set(light[::-1].ravel())
    found = prepared(Picture("Front", "", datablock="Painted")).targets[0]
    np.testing.assert_allclose(np.asarray(found.image)[..., :3], light[..., :3], rtol=1e-6)
    with pytest.raises(Problem, match="there is no such image"):
        prepared(Picture("Front", "", datablock="Gone"))


def test_targets_of_other_sizes_are_read_and_other_aspects_refused(tmp_path: Any) -> None:
    ball()
    images.write_image(tmp_path / "large.png", np.full((96, 96, 3), 0.3, np.float32))
    images.write_image(tmp_path / "wide.png", np.full((32, 64, 3), 0.3, np.float32))
    session = prepared(Picture("Front", str(tmp_path / "large.png"), mask=str(tmp_path / "large.png")))
    assert session.run().losses[0] >= 0.0
    with pytest.raises(ValueError, match=r"wide.png' of camera 'Front': image is 64 x 32 pixels, .*another aspect"):
        prepared(Picture("Front", str(tmp_path / "wide.png")))
    with pytest.raises(Problem, match=r"mask '.*wide.png': is 64 x 32 pixels, of another aspect"):
        prepared(Picture("Front", str(tmp_path / "large.png"), mask=str(tmp_path / "wide.png")))


def test_silhouettes_are_of_objects_and_collections(tmp_path: Any) -> None:
    scene = ball()
    bs.add("Other", bs.cube("Other", bpy.data.materials["Clay"]), (3, 0, 0))
    group = bpy.data.collections.new("Group")
    scene.collection.children.link(group)
    group.objects.link(bpy.data.objects["Cube"])
    export = bs.export()
    assert silhouette_objects(export, ["Cube"]) == silhouette_objects(export, ["Group"])
    assert set(silhouette_objects(export, ["Group", "Other"])) == set(export.meshes)
    with pytest.raises(Problem, match="silhouette of 'Ball': there is no such object"):
        silhouette_objects(export, ["Ball"])
    with pytest.raises(Problem, match="silhouette of 'Sun': nothing of it is rendered"):
        silhouette_objects(export, ["Sun"])
    twin = bs.add("Twin", bpy.data.objects["Cube"].data, (0, 4, 0))
    made = bs.export()
    with pytest.raises(Problem, match="'Twin': is rendered as one mesh"):
        silhouette_objects(made, ["Cube"])
    assert silhouette_objects(made, ["Cube", "Twin"]) == silhouette_objects(export, ["Cube"])
    bpy.data.objects.remove(twin)
    images.write_image(tmp_path / "mask.png", np.ones((32, 32, 3), np.float32))
    (target,) = prepared(Picture("Front", str(tmp_path / "mask.png"), silhouette_of=("Cube",))).targets
    assert np.asarray(target.image).shape == (32, 32) and target.objects is not None


def test_color_is_found_from_agx_of_unknown_exposure_as_well_as_from_linear(tmp_path: Any) -> None:
    """The pictures, with Blender's default dither, are 1.7 stops brighter than the scene.

    With 16 bits, the error is that of linear light. With 8 bits, rounding and dither leave about 1.5 % of the light of
    a pixel, and about 1e-3 of the mean of some hundred pixels.
    """
    scene = ball(size=24)
    scene.cycles.samples = 256
    scene.render.dither_intensity = 1.0
    linear = saved(tmp_path / "linear.exr", scene, "32", "OPEN_EXR")
    scene.cycles.film_exposure = 2.0**1.7
    shallow, deep = saved(tmp_path / "agx_8.png", scene), saved(tmp_path / "agx_16.png", scene, "16")
    scene.cycles.film_exposure = 1.0
    recolored()
    errors = {}
    for path, gain in ((shallow, "exposure"), (deep, "exposure"), (linear, 1.0)):
        pictures = [Picture("Front", str(path), gain=gain)]
        wanted = Request(pictures, Names(base_color=("Clay",)), iterations=200, samples=16)
        session = Session.prepare(bpy.context, wanted)
        result = session.run()
        errors[path.stem] = np.abs(result.values["materials.Clay.base_color"] - TRUTH).max()
        assert np.log2(result.gains[0]) == pytest.approx(0.0 if gain == 1.0 else 1.7, abs=0.01)
        assert [note for note in session.late_notes if "found exposure +1." in note] or gain == 1.0
    assert errors["linear"] < 1e-3
    assert errors["agx_16"] <= 2 * errors["linear"] + 3e-4, errors
    assert errors["agx_8"] <= 2 * errors["linear"] + 2e-3, errors
