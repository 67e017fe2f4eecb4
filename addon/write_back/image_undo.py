"""Undo of fitted pixels.

Blender's undo restores what a file has of an image, as its packed file, but not its pixels in memory. They are restored
here when the packed file is another one than that of the pixels.
"""

from __future__ import annotations

import hashlib
from typing import Any

import bpy
import numpy as np
from bpy.app.handlers import persistent
from numpy.typing import NDArray

from .image_buffer import pixels_of

# By image, and digest of its packed file: pixels that no file has; None: the file has them.
_known: dict[tuple[int, bytes], NDArray[np.float32] | None] = {}
# By image: digest of the packed file that its pixels belong to.
_shown: dict[int, bytes] = {}


def remember(image: Any) -> None:
    """Remember the pixels of an image before and after they are replaced; called at both moments."""
    key = image.session_uid, _packed(image)
    _known[key], _shown[key[0]] = pixels_of(image) if image.is_dirty else None, key[1]


@persistent
def restore(*_: Any) -> None:
    """Bring the pixels back that belong to the packed files as they are now."""
    for image in bpy.data.images if _shown else ():
        key = image.session_uid, _packed(image) if image.session_uid in _shown else b""
        if key not in _known or _shown[key[0]] == key[1]:
            continue
        pixels = _known[key]
        if pixels is None:
            image.buffers_free()  # they are read again when they are needed; reload() would replace the packed file
            image.update_tag()
        elif len(pixels) == image.size[0] * image.size[1] * image.channels:
            image.pixels.foreach_set(pixels)
            image.update()
        _shown[key[0]] = key[1]


@persistent
def _forget(*_: Any) -> None:
    _known.clear()
    _shown.clear()


_HANDLERS = ((bpy.app.handlers.undo_post, restore), (bpy.app.handlers.redo_post, restore),
             (bpy.app.handlers.load_pre, _forget))  # fmt: skip


def register() -> None:
    """Notice undo and redo."""
    for handlers, handler in _HANDLERS:
        handlers.append(handler)


def unregister() -> None:
    """Undo `register`."""
    for handlers, handler in _HANDLERS:
        handlers.remove(handler)
    _forget()


def _packed(image: Any) -> bytes:
    return b"" if image.packed_file is None else hashlib.blake2b(image.packed_file.data, digest_size=16).digest()
