"""Which parameters may move something."""

from __future__ import annotations

from ..scene import parameters

# Fields of lights that change the radiance and move nothing.
STRENGTH = ("power", "strength", "color")


def may_move(path: str) -> bool:
    """Whether a parameter may move anything, so that edges sweep over the picture or between surfaces and lights."""
    collection, _, field = parameters.split(path)
    return (
        field in ("vertices", "instances", "transform", "rotation")
        or collection == "camera"
        or (collection == "lights" and field not in STRENGTH)
    )
