"""TIFF and PNG files of 16 bits a channel, as Blender and developers of raw photographs write them."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image, ImageCms

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

from edgegrad import images
from edgegrad.images.coded import read_coded
from tests.support.scenes import blender_scenes as bs


def saved(path: Path, light: Any, mode: str, codec: str, file_format: str = "TIFF") -> Path:
    """The light as Blender saves it with 16 bits."""
    scene = bs.empty()
    scene.view_settings.view_transform, scene.render.dither_intensity = "Standard", 0.0
    picture = bpy.data.images.new("Light", light.shape[1], light.shape[0], alpha=True, float_buffer=True)
    premultiplied = light.copy()
    premultiplied[..., :3] *= light[..., 3:]
    picture.pixels.foreach_set(premultiplied[::-1].astype(np.float32).ravel())
    picture.update()
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth = file_format, mode, "16"
    if file_format == "TIFF":
        settings.tiff_codec = codec
    picture.save_render(str(path), scene=scene)
    return path


@pytest.mark.parametrize("codec", ["NONE", "DEFLATE", "LZW", "PACKBITS"])
@pytest.mark.parametrize("mode", ["RGB", "RGBA"])
def test_sixteen_bits_of_tiffs_are_all_read(codec: str, mode: str, tmp_path: Any) -> None:
    light = np.random.default_rng(0).uniform(0.2, 0.99, (24, 32, 4))
    if mode == "RGB":
        light[..., 3] = 1.0
    path = saved(tmp_path / "deep.tif", light, mode, codec)
    assert read_coded(path).levels == 65535
    found = images.read_image(path)
    assert found.shape == (24, 32, len(mode))
    # A code is a few hundred-thousandths of the light; straight colours are divided by alpha.
    assert np.abs(found - light[..., : len(mode)]).max() < (5e-4 if mode == "RGBA" else 1e-4)
    like = images.read_image(saved(tmp_path / "deep.png", light, mode, "", "PNG"))
    assert np.abs(found - like).max() < (5e-4 if mode == "RGBA" else 1e-6)


def test_both_byte_orders_and_an_srgb_profile(tmp_path: Any) -> None:
    """Files that are written byte by byte: uncompressed RGB of 16 bits."""
    codes = np.random.default_rng(1).integers(0, 65536, (5, 7, 3))
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    for order, sign in (("little", "<"), ("big", ">")):
        for icc in (b"", profile):
            data = codes.astype(f"{sign}u2").tobytes()
            entries = [(256, 4, 1, 7), (257, 4, 1, 5), (258, 3, 3, None), (259, 3, 1, 1), (262, 3, 1, 2),
                       (273, 4, 1, None), (277, 3, 1, 3), (278, 4, 1, 5), (279, 4, 1, len(data))]  # fmt: skip
            if icc:
                entries.append((34675, 7, len(icc), None))
            start = 8 + 2 + 12 * len(entries) + 4
            places = {258: start, 273: start + 6, 34675: start + 6 + len(data)}

            def number(value: int, size: int, order: Any = order) -> bytes:
                return value.to_bytes(size, order)

            body = b"".join(
                number(tag, 2) + number(kind, 2) + number(count, 4)
                + (number(places[tag], 4) if value is None
                   else number(value, 2) + b"\0\0" if kind == 3 else number(value, 4))
                for tag, kind, count, value in entries
            )  # fmt: skip
            head = (b"II*\0" if order == "little" else b"MM\0*") + number(8, 4) + number(len(entries), 2)
            path = tmp_path / f"{order}{bool(icc)}.tif"
            path.write_bytes(head + body + number(0, 4) + number(16, 2) * 3 + data + icc)
            np.testing.assert_allclose(read_coded(path).values * 65535.0, codes, atol=1e-6)


def test_what_holds_no_code_values_is_named(tmp_path: Any) -> None:
    Image.fromarray(np.full((4, 4), 0.5, np.float32)).save(tmp_path / "float.tif")
    with pytest.raises(ValueError, match=r"float.tif': holds floating-point numbers.*save it as EXR"):
        images.read_image(tmp_path / "float.tif")
    Image.fromarray(np.full((4, 4), 1 << 20, np.int32)).save(tmp_path / "int.tif")
    with pytest.raises(ValueError, match=r"int.tif': holds grey values of more than 16 bits"):
        images.read_image(tmp_path / "int.tif")


@pytest.mark.parametrize("orientation", range(1, 9))
def test_deep_pictures_are_turned_as_those_of_8_bits(orientation: int, tmp_path: Any) -> None:
    light = np.random.default_rng(0).uniform(0.2, 0.99, (5, 7, 4))
    light[..., 3] = 1.0
    found = []
    for depth in ("deep", "flat"):
        path = saved(tmp_path / f"{depth}.png", light, "RGB", "", "PNG")
        if depth == "flat":
            with Image.open(path) as opened:
                opened.convert("RGB").save(path, exif=_exif(orientation))
        else:
            _add_exif(path, _exif(orientation))
        coded = read_coded(path)
        assert coded.levels == (65535 if depth == "deep" else 255)
        found.append(coded.values)
    np.testing.assert_allclose(found[0], found[1], atol=1.0 / 255.0)


def _exif(orientation: int) -> bytes:
    exif = Image.Exif()
    exif[0x0112] = orientation
    return exif.tobytes()


def _add_exif(path: Path, exif: bytes) -> None:
    """Insert the chunk eXIf before the pixels of a PNG, where it replaces Blender's own."""
    data = path.read_bytes()
    payload = exif.removeprefix(b"Exif\0\0")
    chunk = b"eXIf" + payload
    whole = len(payload).to_bytes(4, "big") + chunk + zlib.crc32(chunk).to_bytes(4, "big")
    at = data.index(b"IDAT") - 4
    path.write_bytes(data[:at] + whole + data[at:])
