"""Image files: conversion of OpenEXR, PNG, JPEG and TIFF to and from linear Rec.709 arrays.

In memory, an image is float32 linear light with row 0 on top. Its alpha, if any, is *straight*: colours are not
multiplied by alpha. EXR files store premultiplied linear colours, PNG files straight sRGB code values.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
from numpy.typing import ArrayLike, NDArray

from .._check import file_path, flag, numeric
from ..scene.camera import MAX_SIDE
from .chromaticities import to_rec709
from .code_values import write_codes
from .coded import CODED, coded_size, read_coded
from .output_files import replacing
from .srgb import linear_to_srgb, srgb_to_linear

F32 = NDArray[np.float32]

READABLE = (".exr", *CODED)
WRITABLE = (".exr", ".png")

# An EXR may have MOST_EXR_PIXELS pixels whatever its file size, or MOST_PIXELS_PER_BYTE pixels per byte if that is
# more. No compression method reaches that ratio, so a header beyond it is damaged.
MOST_EXR_PIXELS = 1 << 26
MOST_PIXELS_PER_BYTE = 4096


def read_image(path: str | Path) -> F32:
    """Read an EXR, PNG, JPEG or TIFF file; all but EXR as sRGB (`read_target` for other view transforms).

    Parameters
    ----------
    path
        The file. From an EXR with several layers, the unnamed layer is read, else Blender's ``…Combined``, else
        the first layer with R, G and B. A grey picture returns three equal channels.

    Returns
    -------
    (H, W, 3) float32 linear Rec.709, row 0 on top; (H, W, 4) with straight alpha in [0, 1] if the file has alpha.
    EXR pixels with alpha 0 keep their colour, which is light without coverage, such as a glow.

    Raises
    ------
    ValueError
        If the file is missing, cannot be decoded or has an unsupported format; names the path.
    """
    file = readable(path)
    with np.errstate(all="ignore"):  # files may contain non-finite pixels
        image = _read_exr(file) if file.suffix.lower() == ".exr" else _light(read_coded(file).values)
        return np.ascontiguousarray(image, np.float32)


def image_size(path: str | Path) -> tuple[int, int]:
    """Return height and width of the picture that `read_image` reads, from the head of the file alone.

    Raises
    ------
    ValueError
        If the file is missing, or its head can't be read; names the path.
    """
    file = readable(path)
    if file.suffix.lower() != ".exr":
        return coded_size(file)
    (left, top), (right, bottom) = _headers(file)[0]["displayWindow"]
    return int(bottom - top) + 1, int(right - left) + 1


def readable(path: str | Path) -> Path:
    """Check that there is a file of a readable type; ``ValueError`` names the path."""
    if isinstance(path, (str, Path)) and not str(path).strip():
        raise ValueError(f"image '{path}': no picture is chosen; choose a file")
    file = file_path("image", "path", path)
    suffix = file.suffix.lower()
    if file.is_dir():
        raise ValueError(f"image '{path}': is a folder; choose a picture in it")
    if suffix not in READABLE:
        raise ValueError(f"image '{path}': files of type '{suffix}' can't be read; use {', '.join(READABLE)}")
    if not file.is_file():
        raise ValueError(f"image '{path}': there is no such file")
    return file


def write_image(path: str | Path, image: ArrayLike, *, half: bool = False) -> None:
    """Write an EXR (float32, or float16 if `half`) or an 8-bit sRGB PNG, completely or not at all.

    Parameters
    ----------
    path
        The file, ``.exr`` or ``.png``; its folder must exist.
    image
        (H, W, 3), or (H, W, 4) with straight alpha; linear Rec.709. A PNG clips it to [0, 1].

    Raises
    ------
    ValueError
        For another file type, a wrong shape or non-finite values in a PNG; names the path.
    OSError
        If the file can't be written; names the path and the reason. An earlier file stays unchanged.
    """
    file = file_path("image", "path", path)
    half = flag(f"image '{path}'", "half", half)
    pixels = _writable(path, image)
    if pixels.ndim != 3 or pixels.shape[2] not in (3, 4) or pixels.size == 0:
        raise ValueError(f"image '{path}': must have the shape (H, W, 3) or (H, W, 4), not {pixels.shape}")
    suffix = file.suffix.lower()
    if suffix not in WRITABLE:
        raise ValueError(f"image '{path}': files of type '{suffix}' can't be written; use {', '.join(WRITABLE)}")
    if suffix == ".exr":
        _write_exr(file, pixels, half)
    else:
        if not np.isfinite(pixels).all():
            raise ValueError(f"image '{path}': has non-finite values, which a PNG can't hold; write an .exr")
        write_codes(file, np.round(255.0 * _coded(pixels)).astype(np.uint8))


def _writable(path: str | Path, image: ArrayLike) -> F32:
    """Convert a picture of any shape, finite or not, to float32; refuse integers."""
    pixels = numeric(f"image '{path}'", "pixels", image)
    if pixels.dtype.kind != "f":
        raise ValueError(f"image '{path}': pixels hold whole numbers ({pixels.dtype}), but must be linear light; "
                         "convert 8-bit code values by edgegrad.images.srgb_to_linear(codes / 255)")
    with np.errstate(over="ignore"):
        return np.asarray(pixels, np.float32)


def _coded(pixels: F32) -> NDArray[np.float64]:
    codes = np.clip(pixels.astype(np.float64), 0.0, 1.0)
    codes[..., :3] = linear_to_srgb(codes[..., :3])
    return codes


def _light(codes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Convert sRGB codes in [0, 1] to linear light in place; alpha stays unchanged."""
    codes[..., :3] = srgb_to_linear(codes[..., :3])
    return codes


def _headers(path: Path) -> list[dict[str, Any]]:
    """Headers of the parts of an EXR, whose windows are sound."""
    try:
        with OpenEXR.File(str(path), separate_channels=True, header_only=True) as file:
            headers = [dict(part.header) for part in file.parts]
    except Exception as error:  # the library raises RuntimeError, ValueError and TypeError alike
        raise ValueError(f"image '{path}': can't be read ({error}); it is damaged or not an EXR file") from None
    for header in headers:
        _check_windows(path, header)
    return headers


def _read_exr(path: Path) -> NDArray[Any]:
    headers = _headers(path)
    try:
        with OpenEXR.File(str(path), separate_channels=True) as file:
            parts = [(dict(part.header), {n: c.pixels for n, c in part.channels.items()}) for part in file.parts]
    except MemoryError:
        raise
    except Exception as error:  # as above
        raise ValueError(f"image '{path}': can't be read ({error})") from None
    # If pixels can't be read, the library prints the reason and omits them.
    if len(parts) < len(headers) or any(part.get("channels") and not channels for part, channels in parts):
        raise ValueError(f"image '{path}': its pixels can't be read; the file is cut off or damaged")
    layers = [(header, prefix, channels) for header, channels in parts for prefix in _layers(channels)]
    if not layers:
        names = ", ".join(name for _, channels in parts for name in channels) or "none"
        raise ValueError(f"image '{path}': has no layer with R, G and B or Y (channels: {names})")
    rank = {"": 0}
    header, prefix, channels = min(
        layers, key=lambda layer: rank.get(layer[1], 1 if layer[1].endswith("Combined.") else 2)
    )
    selected = [prefix + c for c in ("RGB" if prefix + "R" in channels else "YYY")]
    if prefix + "A" in channels:
        selected.append(prefix + "A")
    planes = [np.asarray(channels[name]) for name in selected]
    if any(p.shape != planes[0].shape for p in planes):
        raise ValueError(f"image '{path}': its channels are subsampled, which is not supported; save all channels at "
                         "full resolution")
    pixels = np.stack(planes, axis=-1).astype(np.float64)
    pixels[..., :3] = to_rec709(pixels[..., :3], header, path)
    if pixels.shape[2] == 4:
        alpha = pixels[..., 3:]
        pixels[..., :3] /= np.where(alpha > 0.0, alpha, 1.0)
    return _display(pixels, header)


def _check_windows(path: Path, header: dict[str, Any]) -> None:
    """Refuse windows that are too large for the size of the file: a damaged header would allocate all memory."""
    most = max(MOST_EXR_PIXELS, MOST_PIXELS_PER_BYTE * path.stat().st_size)
    for name in ("dataWindow", "displayWindow"):
        (x0, y0), (x1, y1) = (tuple(int(x) for x in corner) for corner in header[name])
        width, height = x1 - x0 + 1, y1 - y0 + 1
        if not (0 < width <= MAX_SIDE and 0 < height <= MAX_SIDE and width * height <= most):
            raise ValueError(f"image '{path}': its {name} of {width} x {height} pixels exceeds {MAX_SIDE} a side or "
                             f"{most:,} in all, the limit for a file of its size; it is damaged")


def _layers(channels: dict[str, Any]) -> list[str]:
    """List prefixes ("" or "name.") of layers with R, G and B, or with Y alone."""
    prefixes = dict.fromkeys(name[: name.rfind(".") + 1] for name in channels)
    return [
        p
        for p in prefixes
        if all(p + c in channels for c in "RGB") or (p + "Y" in channels and p + "X" not in channels)
    ]


def _display(pixels: NDArray[np.float64], header: dict[str, Any]) -> NDArray[np.float64]:
    """Return the picture in its display window, with zeros outside the data window of the file."""
    (x0, y0), (x1, y1) = (np.asarray(corner, int) for corner in header["dataWindow"])
    (left, top), (right, bottom) = (np.asarray(corner, int) for corner in header["displayWindow"])
    if (x0, y0, x1, y1) == (left, top, right, bottom):
        return pixels
    out = np.zeros((bottom - top + 1, right - left + 1, pixels.shape[2]))
    ax, bx, ay, by = max(x0, left), min(x1, right) + 1, max(y0, top), min(y1, bottom) + 1
    if ax < bx and ay < by:
        out[ay - top : by - top, ax - left : bx - left] = pixels[ay - y0 : by - y0, ax - x0 : bx - x0]
    return out


def _write_exr(path: Path, pixels: F32, half: bool) -> None:
    stored = pixels.copy()
    if stored.shape[2] == 4:
        alpha = stored[..., 3:]
        stored[..., :3] *= np.where(alpha > 0.0, alpha, np.float32(1.0))
    kind: type[np.floating[Any]] = np.float16 if half else np.float32
    if half:  # values beyond the range would become infinite
        limit = float(np.finfo(np.float16).max)
        stored = np.clip(stored, -limit, limit)
    channels = {name: np.ascontiguousarray(stored[..., k], kind) for k, name in enumerate("RGBA"[: stored.shape[2]])}
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with replacing(path) as temporary:
        try:
            with OpenEXR.File(header, channels) as file:
                file.write(str(temporary))
        except Exception as error:  # the library raises several types
            raise OSError(str(error)) from None
