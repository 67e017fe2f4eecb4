"""Keyframes of fitted properties: one at each frame of the film, in place of those that were between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..animated import refusals
from ..animated.data_path import Place
from ..animated.film_driver import frames_kept
from ..animated.parameter import Parameter
from ..problem import Problem

TREE = "node_tree."


@dataclass(frozen=True)
class KeysOf:
    """The numbers of a keyed property at the frames of a film."""

    parameter: Parameter
    frames: tuple[int, ...]

    def check(self) -> None:
        self.parameter.renew()
        for place in self.parameter.places:
            refusals.check(place, may_be_keyed=True)

    def write(self, before: Any, after: Any) -> None:
        write_keys(self.parameter.places, self.frames, after)

    def entry(self, before: Any, after: Any) -> dict[str, Any]:
        return {"properties": self.parameter.names, "frames": list(self.frames), "values": np.asarray(after).tolist()}


def write_keys(places: Sequence[Place], frames: Sequence[int], values: Any) -> None:
    """Write keyframes of numbers (frames, places); other keys within the range are removed."""
    import bpy

    with frames_kept(bpy.context.scene):
        for n, place in enumerate(places):
            curve = refusals.curve_of(place)
            if curve is not None:
                _cleared(curve, frames)
            holder, path = _keyed_at(place)
            for frame, value in zip(frames, np.asarray(values)[:, n], strict=True):
                place.write(float(value))
                if not holder.keyframe_insert(path, index=place.index, frame=frame):
                    raise Problem(f"property '{place.name}': Blender can't key it")
            curve = refusals.curve_of(place)
            if curve is not None:
                curve.update()


def _cleared(curve: Any, frames: Sequence[int]) -> None:
    for point in reversed(list(curve.keyframe_points)):
        if frames[0] <= point.co[0] <= frames[-1]:
            curve.keyframe_points.remove(point, fast=True)
    curve.update()


def _keyed_at(place: Place) -> tuple[Any, str]:
    """Return the datablock that holds the animation of a property, and the path from it."""
    tree = getattr(place.owner, "node_tree", None)
    if place.path.startswith(TREE) and tree is not None:
        return tree, place.path[len(TREE) :]
    return place.owner, place.path
