"""Meshes that hold media: hidden from rays that pass them, and overlapping with other media.

The media along a ray follow from all surfaces that it passes (native/shading/media.h), whether or not the ray sees
them, and what they scatter has one phase function at each place. Cycles' paths enter a medium where they meet its
surface, and choose one of the phase functions at random. Both are reported, with how much the media change.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad.scene.placement import places

from ..effects import change_by_media
from ..exported import Export
from ..geometry.visibility import RAYS
from .absorbing_meshes import MOST_PLACES, media_of
from .volumes import ALIKE

F64 = NDArray[np.float64]


def warn_about_filled(out: Export) -> None:
    """Report meshes with media that rays of some kinds do not see, and media of different anisotropy that overlap."""
    filled = {name: media for name in out.scene.meshes if (media := _media(out.scene, name))}
    for name in filled:
        hidden = [ray for ray in RAYS if ray not in out.scene.meshes[name].visible_to]
        if hidden:
            kinds = " and ".join(", ".join(hidden).rsplit(", ", 1))
            out.report.warn(f"volume of object '{out.meshes[name].object}'", f"{kinds} rays do not see the object, but "
                            "they pass its volume here; in Cycles such rays, and the paths that they begin, do not "
                            f"enter it (the volume changes the picture by {change_by_media(out, [name])}); make the "
                            "object visible to them")  # fmt: skip
    scattering = {name: one for name, media in filled.items() for one in media if any(one.scattering)}
    around = out.scene.world.medium
    for name, one in scattering.items():
        if around is not None and any(around.scattering) and abs(around.anisotropy - one.anisotropy) > ALIKE:
            _warn(out, name, "the volume of the world", one.anisotropy, around.anisotropy, [name])
    boxes = {name: _boxes(out.scene.meshes[name]) for name in scattering}
    for (name, one), (other, two) in combinations(scattering.items(), 2):
        if abs(one.anisotropy - two.anisotropy) > ALIKE and _overlap(boxes[name], boxes[other]):
            _warn(out, name, f"that of object '{out.meshes[other].object}'", one.anisotropy, two.anisotropy,
                  [name, other])  # fmt: skip


def _warn(out: Export, name: str, other: str, one: float, two: float, changing: list[str]) -> None:
    out.report.warn(f"volume of object '{out.meshes[name].object}'", f"where it overlaps {other}, both scatter light "
                    f"with the mean of their anisotropies {one:.2g} and {two:.2g}; Cycles uses both (such volumes "
                    f"change the picture by {change_by_media(out, changing)}, most of which is the same); give them "
                    "equal anisotropies")  # fmt: skip


def _media(scene: edgegrad.Scene, name: str) -> list[edgegrad.Medium]:
    """Media of the materials of a mesh."""
    return [one for one in media_of(scene, name) if one is not None]


def _boxes(mesh: edgegrad.Mesh) -> F64:
    """(k, 2, 3) corners of boxes around some of the places of a mesh, in world space."""
    vertices = np.asarray(mesh.vertices, np.float64)
    placed = [vertices @ place[:, :3].T + place[:, 3] for place in places(mesh)[:MOST_PLACES]]
    return np.array([(one.min(axis=0), one.max(axis=0)) for one in placed if len(one)]).reshape(-1, 2, 3)


def _overlap(one: F64, other: F64) -> bool:
    """Whether a box of one list overlaps one of the other."""
    apart = (one[:, None, 0] >= other[None, :, 1]) | (other[None, :, 0] >= one[:, None, 1])
    return bool((~apart.any(axis=-1)).any())
