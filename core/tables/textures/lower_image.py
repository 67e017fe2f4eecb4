"""How image textures are looked up: projections of a vector to the image's plane (lower_math.py)."""

from __future__ import annotations

import numpy as np

from ... import expression as e
from .lowering import Components, Lowering, rule
from .ops import Value


@rule(e.ImageTexture)
def _image_texture(low: Lowering, node: e.ImageTexture) -> Components:
    v = low.components(node.vector)[:3]
    if node.projection == "BOX":
        return _box(low, node, v)
    if node.projection == "FLAT":
        return _lookup(low, node, v[0], v[1])
    return _lookup(low, node, *PROJECTIONS[node.projection](low, v))


def _lookup(low: Lowering, node: e.ImageTexture, u: Value, v: Value) -> Components:
    image = low.resources.image(node.image, node.interpolation, node.extension, node.alpha)
    x, y, z, w = low.build.emit_all("IMAGE", u, v, data=image)
    # Also an image without alpha is transparent outside its borders.
    return (x, y, z, 1.0 if node.alpha == "NONE" and node.extension != "CLIP" else w)


def _centred(low: Lowering, v: Components) -> tuple[Value, ...]:
    """The cube [0, 1] as [-1, 1]."""
    return tuple(low.mul(low.sub(x, 0.5), 2.0) for x in v)


def _sphere(low: Lowering, v: Components) -> tuple[Value, Value]:
    x, y, z = _centred(low, v)
    u = low.sub(0.5, low.mul(low.build.emit("ARCTAN2", x, y), 0.5 / np.pi))
    on_axis = low.mul(low.build.emit("EQUAL", x, 0.0), low.build.emit("EQUAL", y, 0.0))
    squared = low.dot((x, y, z), (x, y, z))
    polar = low.build.emit("ARCCOSINE", low.mul(z, low.build.emit("INVERSE_SQRT", squared)))
    up = low.select(squared, low.sub(1.0, low.mul(polar, 1.0 / np.pi)), 0.0)
    return low.select(on_axis, 0.0, u), up


def _tube(low: Lowering, v: Components) -> tuple[Value, Value]:
    x, y, z = _centred(low, v)
    on_axis = low.mul(low.build.emit("EQUAL", x, 0.0), low.build.emit("EQUAL", y, 0.0))
    u = low.mul(low.sub(1.0, low.mul(low.build.emit("ARCTAN2", x, y), 1.0 / np.pi)), 0.5)
    return low.select(on_axis, 0.0, u), low.select(on_axis, 0.0, low.mul(low.add(z, 1.0), 0.5))


def _equirectangular(low: Lowering, v: Components) -> tuple[Value, Value]:
    x, y, z = low.normalized(v)[:3]
    u = low.sub(0.5, low.mul(low.build.emit("ARCTAN2", y, x), 0.5 / np.pi))
    up = low.sub(1.0, low.mul(low.build.emit("ARCCOSINE", z), 1.0 / np.pi))
    there = low.dot((x, y, z), (x, y, z))
    return low.select(there, u, 0.0), low.select(there, up, 0.0)


def _mirror_ball(low: Lowering, v: Components) -> tuple[Value, Value]:
    x, y, z = low.normalized(v)[:3]
    # The ball seen along +Y mirrors a direction where its normal is half-way between that and -Y.
    scale = low.mul(2.0, low.build.emit("SQRT", low.mul(-0.5, low.sub(y, 1.0))))
    nothing = low.build.emit("EQUAL", scale, 0.0)
    a, b = (low.select(nothing, c, low.div(c, scale)) for c in (x, z))
    return low.mul(0.5, low.add(a, 1.0)), low.mul(0.5, low.add(b, 1.0))


PROJECTIONS = {"SPHERE": _sphere, "TUBE": _tube, "EQUIRECTANGULAR": _equirectangular, "MIRROR_BALL": _mirror_ball}


def _box(low: Lowering, node: e.ImageTexture, v: Components) -> Components:
    """Three lookups, weighted by the normal's barycentric place between the cube's sides."""
    normal = low.components(node.normal)[:3]
    weights = _box_weights(low, normal, node.blend)
    x, y, z = v
    sides = [
        (low.select(low.less(normal[0], 0.0), low.sub(1.0, y), y), z),
        (low.select(low.build.emit("GREATER_THAN", normal[1], 0.0), low.sub(1.0, x), x), z),
        (low.select(low.build.emit("GREATER_THAN", normal[2], 0.0), low.sub(1.0, y), y), x),
    ]
    total: Components = (0.0, 0.0, 0.0, 0.0)
    for (a, b), weight in zip(sides, weights, strict=True):
        found = _lookup(low, node, a, b)
        total = tuple(low.mad(weight, f, t) for f, t in zip(found, total, strict=True))
    return total


def _box_weights(low: Lowering, normal: Components, blend: float) -> tuple[Value, Value, Value]:
    """Seven zones of the triangle of normals: one side alone, two mixed, all three mixed."""
    if not 0.0 <= blend <= 1.0:
        raise ValueError(f"expression ImageTexture: blend must be between 0 and 1, not {blend:g}")
    limit = low.mul(0.5, low.add(1.0, blend))
    n = [low.build.emit("ABSOLUTE", c) for c in normal]
    total = low.add(low.add(n[0], n[1]), n[2])

    def larger(a: Value, b: Value) -> Value:
        return low.build.emit("GREATER_THAN", a, b)

    # A normal of length 0 has all sides alike. Its quotients would be 0, and the weights negative.
    n = [low.select(larger(total, 0.0), low.div(c, total), 1.0 / 3.0) for c in n]

    def alone(i: int) -> Value:
        j, k = (i + 1) % 3, (i + 2) % 3
        return low.mul(larger(n[i], low.mul(limit, low.add(n[i], n[j]))),
                       larger(n[i], low.mul(limit, low.add(n[i], n[k]))))

    if float(blend) == 0.0:
        rest: list[Value] = [1.0, 0.0, 0.0]
    else:
        rest = [low.div(low.mad(low.sub(2.0, limit), c, low.sub(limit, 1.0)), blend) for c in n]
        # The zone of two sides i, j without k; the first that applies counts, so the last is placed first.
        for i, j, k in ((0, 2, 1), (1, 2, 0), (0, 1, 2)):
            share = low.div(n[i], low.add(n[i], n[j]))
            share = low.clamp(low.div(low.sub(share, low.mul(0.5, low.sub(1.0, blend))), blend))
            pair: list[Value] = [0.0, 0.0, 0.0]
            pair[i], pair[j] = share, low.sub(1.0, share)
            inside = low.less(n[k], low.mul(low.sub(1.0, limit), low.add(n[i], n[j])))
            rest = [low.select(inside, p, r) for p, r in zip(pair, rest, strict=True)]
    for i in (2, 1, 0):
        single = alone(i)
        rest = [low.select(single, float(i == k), r) for k, r in enumerate(rest)]
    return rest[0], rest[1], rest[2]
