"""Images, and expressions of every node: fields are drawn by their types, so that no node is left out."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

from edgegrad import Image
from edgegrad import expression as e
from edgegrad.expression import Expression
from edgegrad.expression import procedural as p
from tests.torture.drawing.draw import Draw

# The images of a scene, by what reads them best.
IMAGES = ("colors", "grey", "rgba", "mask", "texel")
LAYERS = {"UVMap": 2, "color": 3, "packed": 4, "weight": 1}
_OUTER_NUMBERS = (0.0, 1.0, -1.0, 0.5, 1e-6, 2.0, -3.0, 10.0, 1e3)
# Fields that are limited by more than their type.
_WHOLE = {"index": (0, 3), "depth": (0, 10), "offset_frequency": (1, 99), "squash_frequency": (1, 99)}


def all_nodes() -> list[type[Expression]]:
    """Every kind of node, sorted by name."""
    found = [kind for kind in vars(e).values()
             if isinstance(kind, type) and issubclass(kind, Expression) and kind is not Expression]  # fmt: skip
    return sorted(set(found), key=lambda kind: kind.__name__)


def images(draw: Draw) -> dict[str, Image]:
    """Images of few texels; values beyond [0, 1] now and then."""
    top = draw.one((1.0, 1.0, 1.0, 3.0))

    def image(channels: int) -> Image:
        size = (draw.whole(1, 5), draw.whole(1, 5), channels)
        return Image(draw.rng.uniform(0.0, top, size).astype(np.float32))

    mask = draw.rng.integers(0, 2, (4, 4, 1)).astype(np.float32)
    return {"colors": image(3), "grey": image(1), "rgba": image(4), "mask": Image(mask),
            "texel": Image(draw.rng.random((1, 1, draw.one((1, 3, 4)))).astype(np.float32))}  # fmt: skip


def sky(draw: Draw) -> Image:
    """An environment: small, of one texel, or with one that is far brighter than the rest."""
    kind = draw.whole(0, 3)
    size = (1, 1) if kind == 0 else (draw.whole(1, 6), draw.whole(1, 8))
    pixels = draw.rng.uniform(0.0, 2.0, (*size, draw.one((1, 3, 4)))).astype(np.float32)
    if kind == 1:
        pixels[draw.whole(0, size[0] - 1), draw.whole(0, size[1] - 1)] = draw.log(10.0, 1e4)
    return Image(pixels)


def expression(draw: Draw, depth: int) -> Expression:
    """A tree of any nodes, up to `depth` of them above each other."""
    kind = draw.one((e.Attribute, e.ImageTexture, e.Coordinates) if depth <= 1 else all_nodes())
    made: dict[str, Any] = {}
    for field in fields(kind):
        value = _value(draw, kind, field.name, str(field.type), depth)
        if value is not None:
            made[field.name] = value
    node = _allowed(kind, made)
    # Places in units of the scene: textures of a million turns across it are nothing but noise.
    if node == e.Coordinates("POSITION") and draw.scale != 1.0:
        return e.VectorMath("SCALE", node, scale=1.0 / draw.scale)
    return node


def _value(draw: Draw, kind: type[Expression], name: str, type_name: str, depth: int) -> Any:
    if name in kind.choices:
        return draw.one(kind.choices[name])
    if name == "name":
        return draw.one((*LAYERS, "absent"))
    if name == "step":
        return draw.log(1e-6, 0.1)
    if name == "uv":
        return draw.one(tuple(LAYERS))
    if name == "required":  # meshes lack attributes now and then
        return False
    if name == "image":
        return draw.one(IMAGES)
    if name == "table":
        columns = 3 if kind is e.Curves else 4
        return tuple(tuple(row) for row in draw.rng.uniform(-0.2, 1.2, (draw.whole(2, 5), columns)).tolist())
    if name == "matrix":
        return tuple(tuple(row) for row in draw.rng.normal(size=(3, 4)).tolist())
    if name in _WHOLE:
        return draw.whole(*_WHOLE[name])
    if type_name == "bool":
        return draw.chance(0.5)
    if name == "blend" and kind is e.ImageTexture:
        return draw.share()
    if type_name.startswith("float"):
        return draw.uniform(0.1, 2.0)
    # What places a texture comes from the surface more often than not; the rest are numbers.
    if depth > 1 and (name == "vector" or draw.chance(0.4)):
        return expression(draw, depth - 1)
    if name == "vector":
        return e.Attribute("UVMap", required=False)
    # Half of the rest keep their defaults.
    return draw.one(_OUTER_NUMBERS) if _is_needed(kind, name) or draw.chance(0.5) else None


def _is_needed(kind: type[Expression], name: str) -> bool:
    """Whether a field has no default."""
    return name not in vars(kind)


def _allowed(kind: type[Expression], made: dict[str, Any]) -> Expression:
    """The node, where some choices exclude each other."""
    if kind is e.ColorModel:
        made["source" if made["source"] != "RGB" and made["target"] != "RGB" else "target"] = "RGB"
        if made["source"] == "RGB" and made["target"] == "RGB":
            made["target"] = "HSV"
    if kind is p.Wave and made["direction"] == ("SPHERICAL" if made["kind"] == "BANDS" else "DIAGONAL"):
        made["direction"] = "X"
    if kind is e.Curves:
        made["maximum"] = made["minimum"] + 1.0
    return kind(**made)
