"""Bakes, kept while the process runs under the hash of all that decides them."""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

import bpy
import numpy as np
from numpy.typing import NDArray

import edgegrad

from ..materials.material import BakedOutput
from ..nodes.constants import Place, Values
from .bake import CopiedObject
from .content import UnknownContent, content_of, mesh_content

LARGEST = 2 << 30  # bytes of all kept images


class Bake(Protocol):
    """What can be kept."""

    def arrays(self) -> Iterable[NDArray[np.float32]]:
        """Return the pixels of its images."""


@dataclass(frozen=True)
class KeptBake:
    """UV coordinates of corners, and the image of each material's output."""

    uv: NDArray[np.float32]
    images: dict[tuple[str, BakedOutput], edgegrad.Image]

    def arrays(self) -> Iterable[NDArray[np.float32]]:
        """Return the pixels of the images."""
        return [image.pixels for image in self.images.values()]


T = TypeVar("T", bound=Bake)
_kept: OrderedDict[bytes, Bake] = OrderedDict()


def key_of_bake(copied: CopiedObject, slots: tuple[str, ...], materials: dict[str, Any],
                outputs: list[tuple[str, BakedOutput]], resolution: int, around: bytes,
                constants: Mapping[str, Mapping[Place, Values]]) -> bytes | None:  # fmt: skip
    """Hash of all that decides a bake; None if something may change unnoticed.

    Parameters
    ----------
    copied, slots, resolution
        As for `ObjectBaker`.
    materials
        Blender's materials by their full names.
    outputs
        The outputs to bake.
    around
        Hash of what the bake sees beside the object.
    constants
        What each material gets of the rendered object.
    """
    try:
        contents = [(name, content_of(one)) for name, one in materials.items()]
        mesh = mesh_content(copied.mesh)
    except UnknownContent:
        return None
    frame = bpy.context.scene.frame_current_final
    rest = (copied.matrix, copied.color, copied.index, slots, outputs, resolution, frame, around,
            [(name, sorted(one.items())) for name, one in constants.items()])
    return hashlib.sha256(repr((mesh, contents, rest)).encode()).digest()


def kept(key: bytes | None, kind: type[T]) -> T | None:
    """The bake of a key; None if none is kept."""
    found = None if key is None else _kept.get(key)
    if key is None or not isinstance(found, kind):
        return None
    _kept.move_to_end(key)
    return found


def keep(key: bytes | None, bake: Bake) -> None:
    """Keep a bake, and drop those that were used longest ago if they are too large."""
    if key is None:
        return
    for pixels in bake.arrays():
        pixels.flags.writeable = False  # scenes share them
    _kept[key] = bake
    while sum(pixels.nbytes for one in _kept.values() for pixels in one.arrays()) > LARGEST:
        _kept.popitem(last=False)
