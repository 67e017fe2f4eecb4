"""Decoded pixels of image files, kept while the process runs."""

from __future__ import annotations

import hashlib
import time
from collections import OrderedDict
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

F32 = NDArray[np.float32]
Key = tuple[Any, ...]

LARGEST = 4 << 30  # bytes of all kept pixels

_kept: OrderedDict[Key, F32] = OrderedDict()
_floats: dict[Key, bool] = {}
# Blender keeps the pixels that it has read until the user reloads the image. Files that have changed since the start
# may differ from them, so their pixels are not kept.
_start = time.time_ns()


def key_of(image: Any, *more: object) -> Key | None:
    """All that decides the pixels of an image: its file's content and the settings; None if that is not known."""
    if image.source != "FILE" or image.is_dirty:
        return None
    content: tuple[Any, ...]
    if image.packed_file is not None:
        content = ("packed", hashlib.sha256(image.packed_file.data).digest())
    else:
        path = Path(bpy.path.abspath(image.filepath, library=image.library))
        try:
            found = path.stat()
        except OSError:
            return None
        if max(found.st_mtime_ns, found.st_ctime_ns) >= _start:
            return None
        content = (str(path), found.st_mtime_ns, found.st_size)
    # Sizes and types of pixels follow from the content; asking Blender for them would decode the file.
    return (*content, image.colorspace_settings.name, image.alpha_mode, *more)


def is_float(image: Any) -> bool:
    """Whether an image has pixels of floats."""
    key = key_of(image)
    if key is None:
        return bool(image.is_float)
    if key not in _floats:
        _floats[key] = bool(image.is_float)
    return _floats[key]


def was_readable(image: Any) -> bool:
    """Whether the file of an image has been decoded."""
    return kept(key_of(image, False)) is not None or kept(key_of(image, True)) is not None


def kept(key: Key | None) -> F32 | None:
    """Pixels that were kept under a key; None if there are none."""
    if key is None or key not in _kept:
        return None
    _kept.move_to_end(key)
    return _kept[key]


def keep(key: Key | None, pixels: F32) -> None:
    """Keep pixels, and drop those that were used longest ago if they are too many."""
    if key is None:
        return
    pixels.flags.writeable = False  # scenes share them
    _kept[key] = pixels
    while sum(one.nbytes for one in _kept.values()) > LARGEST:
        _kept.popitem(last=False)
