"""Image files: colour, alpha, layers, and one clear error for each that can't be used."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from edgegrad import images


def picture(channels: int, seed: int = 0) -> np.ndarray:
    """A 7 x 5 picture; its alpha is between 0.25 and 1, so that colours survive 8 bits."""
    out = np.random.default_rng(seed).random((5, 7, channels))
    if channels == 4:
        out[..., 3] = 0.25 + 0.75 * out[..., 3]
    return out.astype(np.float32)


@pytest.mark.parametrize("channels", [3, 4])
@pytest.mark.parametrize(("half", "tolerance"), [(False, 1e-6), (True, 2e-3)])
def test_exr_round_trip(tmp_path: Path, channels: int, half: bool, tolerance: float) -> None:
    image = 50.0 * picture(channels)
    if channels == 4:
        image[..., 3] /= 50.0
    images.write_image(tmp_path / "a.exr", image, half=half)
    back = images.read_image(tmp_path / "a.exr")
    assert back.dtype == np.float32 and back.shape == image.shape
    np.testing.assert_allclose(back, image, rtol=tolerance)


@pytest.mark.parametrize("channels", [3, 4])
def test_png_round_trip(tmp_path: Path, channels: int) -> None:
    image = picture(channels)
    images.write_image(tmp_path / "a.png", image)
    back = images.read_image(tmp_path / "a.png")
    assert back.shape == image.shape
    # Half a code value, through the steepest slope of the curve at 1: 2.275 / 510.
    np.testing.assert_allclose(back, image, atol=0.5 / 255 * 2.3)
    images.write_image(tmp_path / "b.png", back)
    assert np.array_equal(images.read_image(tmp_path / "b.png"), back)


def test_srgb_curve_has_the_published_values() -> None:
    code = np.array([0.0, 0.04045, 0.5, 1.0])
    np.testing.assert_allclose(images.srgb_to_linear(code), [0.0, 0.0031308, 0.2140411, 1.0], atol=1e-7)
    x = np.linspace(0.0, 1.0, 1001)
    np.testing.assert_allclose(images.linear_to_srgb(images.srgb_to_linear(x)), x, atol=1e-7)


def test_exr_stores_premultiplied_and_png_straight_colour(tmp_path: Path) -> None:
    image = np.full((2, 2, 4), [0.8, 0.4, 0.2, 0.5], np.float32)
    images.write_image(tmp_path / "a.exr", image)
    with OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True) as file:
        np.testing.assert_allclose(file.channels()["R"].pixels, 0.4, rtol=1e-6)
    images.write_image(tmp_path / "a.png", image)
    assert np.asarray(Image.open(tmp_path / "a.png"))[0, 0, 0] == round(255 * float(images.linear_to_srgb(0.8)))


def test_light_without_coverage_keeps_its_colour(tmp_path: Path) -> None:
    image = np.full((2, 2, 4), [3.0, 2.0, 1.0, 0.0], np.float32)
    images.write_image(tmp_path / "a.exr", image)
    np.testing.assert_array_equal(images.read_image(tmp_path / "a.exr"), image)


def write_channels(path: Path, channels: dict[str, np.ndarray], **header: object) -> None:
    full = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **header}
    with OpenEXR.File(full, channels) as file:
        file.write(str(path))


def test_the_combined_layer_is_read(tmp_path: Path) -> None:
    rgb = picture(3)
    channels = {f"ViewLayer.Combined.{c}": np.ascontiguousarray(rgb[..., k]) for k, c in enumerate("RGB")}
    channels |= {f"ViewLayer.AO.{c}": np.zeros((5, 7), np.float32) for c in "RGB"}
    channels |= {f"ViewLayer.Normal.{c}": np.zeros((5, 7), np.float32) for c in "XYZ"}
    write_channels(tmp_path / "a.exr", channels)
    np.testing.assert_array_equal(images.read_image(tmp_path / "a.exr"), rgb)


def test_grey_exr_gives_three_channels(tmp_path: Path) -> None:
    grey = picture(3)[..., 0].copy()
    write_channels(tmp_path / "a.exr", {"Y": grey})
    np.testing.assert_array_equal(images.read_image(tmp_path / "a.exr"), np.stack([grey] * 3, axis=-1))


def test_data_window_is_placed_in_the_display_window(tmp_path: Path) -> None:
    rgb = picture(3)
    window = (np.array([2, 1], np.int32), np.array([8, 5], np.int32))
    display = (np.array([0, 0], np.int32), np.array([9, 9], np.int32))
    write_channels(
        tmp_path / "a.exr",
        {c: np.ascontiguousarray(rgb[..., k]) for k, c in enumerate("RGB")},
        dataWindow=window,
        displayWindow=display,
    )
    image = images.read_image(tmp_path / "a.exr")
    assert image.shape == (10, 10, 3) and images.image_size(tmp_path / "a.exr") == (10, 10)
    np.testing.assert_array_equal(image[1:6, 2:9], rgb)
    assert image.sum() == pytest.approx(rgb.sum(), rel=1e-6)


def test_other_primaries_are_converted(tmp_path: Path) -> None:
    rec2020 = (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290)
    channels = {c: np.full((2, 2), v, np.float32) for c, v in zip("RGB", (1.0, 0.0, 0.0), strict=True)}
    write_channels(tmp_path / "a.exr", channels, chromaticities=rec2020)
    # ITU-R BT.2087: the Rec.2020 red in Rec.709.
    np.testing.assert_allclose(images.read_image(tmp_path / "a.exr")[0, 0], [1.6605, -0.1246, -0.0182], atol=1e-3)


def test_unknown_colour_space_is_refused(tmp_path: Path) -> None:
    channels = {c: np.zeros((2, 2), np.float32) for c in "RGB"}
    write_channels(tmp_path / "a.exr", channels, colorInteropID="lin_ap1_scene")
    with pytest.raises(ValueError, match="lin_ap1_scene"):
        images.read_image(tmp_path / "a.exr")


@pytest.mark.parametrize(("mode", "code", "channels"), [("L", 128, 3), ("LA", (128, 64), 4), ("P", 3, 3), ("1", 1, 3)])
def test_other_png_kinds(tmp_path: Path, mode: str, code: object, channels: int) -> None:
    Image.new(mode, (4, 3), code).save(tmp_path / "a.png")  # type: ignore[arg-type]
    assert images.read_image(tmp_path / "a.png").shape == (3, 4, channels)


def test_sixteen_bit_grey_png(tmp_path: Path) -> None:
    Image.fromarray(np.full((3, 4), 32768, np.uint16)).save(tmp_path / "a.png")
    np.testing.assert_allclose(images.read_image(tmp_path / "a.png"), images.srgb_to_linear(32768 / 65535), rtol=1e-6)


@pytest.mark.parametrize("channels", [3, 4])
def test_sixteen_bit_png_keeps_its_bits(tmp_path: Path, channels: int) -> None:
    codes = np.random.default_rng(0).integers(0, 65536, (5, 7, channels), np.uint16)

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", 7, 5, 16, 2 if channels == 3 else 6, 0, 0, 0)
    rows = b"".join(b"\0" + row.astype(">u2").tobytes() for row in codes)
    (tmp_path / "a.png").write_bytes(
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
    )
    expected = codes / 65535.0
    expected[..., :3] = images.srgb_to_linear(expected[..., :3])
    np.testing.assert_allclose(images.read_image(tmp_path / "a.png"), expected, atol=1e-6)


@pytest.mark.parametrize("name", ["a.jpg", "a.png", "a.tif"])
def test_pictures_are_turned_as_their_exif_says(tmp_path: Path, name: str) -> None:
    exif = Image.Exif()
    exif[0x0112] = 6  # turn by 90 degrees to see it upright
    Image.new("RGB", (32, 16), (255, 0, 0)).save(tmp_path / name, exif=exif)
    image = images.read_image(tmp_path / name)
    assert image.shape == (32, 16, 3) and images.image_size(tmp_path / name) == (32, 16)
    np.testing.assert_allclose(image[8, 8], [1.0, 0.0, 0.0], atol=0.02)


@pytest.mark.parametrize("name", ["missing.exr", "missing.png", "text.exr", "text.png", "cut.exr", "cut.png", "a.tga"])
def test_unreadable_files_are_named(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    if name.startswith("text"):
        path.write_text("not an image")
    if name.startswith("cut"):
        images.write_image(path, np.random.default_rng(0).random((64, 64, 3)))
        path.write_bytes(path.read_bytes()[:200])
    with pytest.raises(ValueError, match=r"image '.*" + name):
        images.read_image(path)


@pytest.mark.parametrize("name", ["a.exr", "a.png"])
def test_unwritable_paths_are_named(tmp_path: Path, name: str) -> None:
    with pytest.raises(ValueError, match=rf"none/{name}'.*can't be written"):
        images.write_image(tmp_path / "none" / name, np.zeros((2, 2, 3)))


def test_wrong_pixels_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"shape \(H, W, 3\)"):
        images.write_image(tmp_path / "a.exr", np.zeros((4, 4)))
    with pytest.raises(ValueError, match="non-finite"):
        images.write_image(tmp_path / "a.png", np.full((4, 4, 3), np.nan))
    with pytest.raises(ValueError, match=r"'\.tif' can't be written"):
        images.write_image(tmp_path / "a.tif", np.zeros((4, 4, 3)))


def test_derivative_picture_colours() -> None:
    change = np.zeros((1, 4, 3))
    change[0, 1], change[0, 2], change[0, 3] = 2.0, -2.0, 1.0
    colours = images.derivative_image(change, scale=2.0)
    assert colours.dtype == np.uint8
    assert colours[0].tolist() == [[255, 255, 255], [255, 0, 0], [0, 0, 255], [255, 128, 128]]
    assert (images.derivative_image(np.zeros((2, 2, 3))) == 255).all()
    assert (images.derivative_image(np.full((1, 1, 3), np.nan)) == 0).all()
    with pytest.raises(ValueError, match="scale"):
        images.derivative_image(change, scale=0.0)


def test_derivative_file_states_its_scale(tmp_path: Path) -> None:
    change = np.random.default_rng(0).normal(size=(20, 150, 3))
    scale = images.write_derivative(tmp_path / "d.png", change)
    written = np.asarray(Image.open(tmp_path / "d.png"))
    np.testing.assert_array_equal(written[:20, :150], images.derivative_image(change, scale))
    line = written[24:]
    assert line.size and (line.min(axis=2) < 128).any(), "no text below the picture"
    images.write_derivative(tmp_path / "e.png", change, 2.0 * scale)
    assert not np.array_equal(np.asarray(Image.open(tmp_path / "e.png"))[24:], line)


def test_files_written_by_blender(tmp_path: Path) -> None:
    bpy = pytest.importorskip("bpy")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.view_settings.view_transform = "Standard"
    scene.world = bpy.data.worlds.new("World")
    scene.world.color = (0.2, 0.5, 0.8)
    if scene.world.node_tree:
        scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.2, 0.5, 0.8, 1.0)
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(scene.camera)
    scene.render.engine = "CYCLES"
    scene.cycles.samples = 1
    scene.cycles.use_denoising = False
    scene.render.dither_intensity = 0.0
    scene.render.resolution_x, scene.render.resolution_y = 16, 8
    for kind, suffix in (("OPEN_EXR", "exr"), ("OPEN_EXR_MULTILAYER", "exr"), ("PNG", "png")):
        settings = scene.render.image_settings
        if hasattr(settings, "media_type"):
            settings.media_type = "MULTI_LAYER_IMAGE" if "MULTI" in kind else "IMAGE"
        settings.file_format = kind
        path = tmp_path / f"{kind}.{suffix}"
        scene.render.filepath = str(path)
        bpy.ops.render.render(write_still=True)
        image = images.read_image(path)
        assert image.shape[:2] == (8, 16)
        expected = np.broadcast_to([0.2, 0.5, 0.8], (8, 16, 3))
        np.testing.assert_allclose(image[..., :3], expected, atol=1e-3 if settings.color_depth == "16" else 5e-3)
