"""Broken picture files: cut off, and with changed bytes, of every kind that `read_image` takes."""

from __future__ import annotations

import io
import struct
import tempfile
import zlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
from PIL import Image, ImageCms

from edgegrad import images

HEIGHT, WIDTH = 21, 18
FLIPS = 60  # changed files of each kind
SHARES = (0.0, 0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99)


def _codes(channels: int, kind: Any = np.uint8) -> np.ndarray:
    rng = np.random.default_rng(channels)
    return rng.integers(0, np.iinfo(kind).max, (HEIGHT, WIDTH, channels), dtype=kind)


def _saved(picture: Any, form: str, **options: Any) -> bytes:
    out = io.BytesIO()
    picture.save(out, form, **options)
    return out.getvalue()


def chunked(name: bytes, data: bytes) -> bytes:
    """One chunk of a PNG."""
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


def png(color: int, depth: int, channels: int, extra: bytes = b"") -> bytes:
    """A PNG of any colour type and depth, written by hand; `extra` are chunks before the pixels."""
    row = -(-WIDTH * channels * depth // 8)
    data = np.random.default_rng(color + depth).bytes(HEIGHT * row)
    if color == 3:  # places in a palette of 2**depth colours
        extra = chunked(b"PLTE", bytes(range(256))[: 3 * 2 ** min(depth, 6)]) + extra
        data = bytes(b & 0x3F if depth == 8 else b for b in data)
    rows = b"".join(b"\0" + data[k * row : (k + 1) * row] for k in range(HEIGHT))
    head = struct.pack(">IIBBBBB", WIDTH, HEIGHT, depth, color, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunked(b"IHDR", head) + extra + chunked(b"IDAT", zlib.compress(rows))
            + chunked(b"IEND", b""))


def _exr(compression: str, kind: Any, *, tiled: bool) -> bytes:
    values = np.random.default_rng(5).random((HEIGHT, WIDTH, 4)) * (50 if kind is np.uint32 else 1)
    channels: dict[str, Any] = {name: np.ascontiguousarray(values[..., k], kind) for k, name in enumerate("RGBA")}
    header: dict[str, Any] = {"compression": getattr(OpenEXR, f"{compression}_COMPRESSION"),
                              "type": OpenEXR.tiledimage if tiled else OpenEXR.scanlineimage}
    if tiled:
        header["tiles"] = OpenEXR.TileDescription()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.exr"
        with OpenEXR.File(header, channels) as file:
            file.write(str(path))
        return path.read_bytes()


@cache
def whole_files() -> dict[str, bytes]:
    """Valid files by name, of every PNG colour type and depth, JPEG mode, EXR compression and pixel type."""
    out = {}
    for color, channels, depths in ((0, 1, (1, 2, 4, 8, 16)), (2, 3, (8, 16)), (3, 1, (1, 2, 4, 8)), (4, 2, (8, 16)),
                                    (6, 4, (8, 16))):
        for depth in depths:
            out[f"color{color}_{depth}.png"] = png(color, depth, channels)
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    out["profile.png"] = _saved(Image.fromarray(_codes(3)), "PNG", icc_profile=profile)
    for mode, channels in (("L", 1), ("RGB", 3), ("CMYK", 4)):
        picture = Image.fromarray(np.squeeze(_codes(channels)), mode)
        out[f"{mode}.jpg"] = _saved(picture, "JPEG")
    out["progressive.jpg"] = _saved(Image.fromarray(_codes(3)), "JPEG", progressive=True)
    for compression in ("NO", "RLE", "ZIPS", "ZIP", "PIZ", "PXR24", "B44", "B44A", "DWAA", "DWAB"):
        for kind in (np.float16, np.float32, np.uint32):
            out[f"{compression}_{kind.__name__}.exr"] = _exr(compression, kind, tiled=False)
    out["tiled.exr"] = _exr("ZIP", np.float32, tiled=True)
    return out


def broken_files(flips: int = FLIPS) -> Iterator[tuple[str, bytes]]:
    """Names and contents: each whole file, cut off, and with some bytes changed."""
    for name, data in whole_files().items():
        yield f"{name}: whole", data
        for share in SHARES:
            yield f"{name}: cut off at {share:.0%}", data[: int(share * len(data))]
        yield f"{name}: without the last byte", data[:-1]
        rng = np.random.default_rng(len(data))
        for k in range(flips):
            changed = bytearray(data)
            # Headers are short, and decide most.
            reach = len(data) if k % 2 else min(400, len(data))
            for at in rng.integers(0, reach, 1 + k % 3):
                changed[at] = rng.choice([0, 1, 0x7F, 0x80, 0xFF, changed[at] ^ (1 << int(rng.integers(8)))])
            yield f"{name}: changed {k}", bytes(changed)


def read(name: str, data: bytes) -> Any:
    """What `read_image` makes of a file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name.split(":")[0]
        path.write_bytes(data)
        image = images.read_image(path)
        assert image.ndim == 3 and image.shape[2] in (3, 4) and image.dtype == np.float32, "no picture"
        return image
