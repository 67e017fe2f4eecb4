"""How expressions of colours are computed (core/tables/textures/lower_math.py has the rest)."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from ... import expression as e
from .lowering import Components, Lowering, colored, repeated, rule, vector
from .ops import Value

# A blend mode of one channel: (factor, a, b).
Blend = Callable[[Lowering, Value, Value, Value], Value]


def _screen(low: Lowering, t: Value, a: Value, b: Value) -> Value:
    return low.sub(1.0, low.mul(low.mad(t, low.sub(1.0, b), low.sub(1.0, t)), low.sub(1.0, a)))


def _overlay(low: Lowering, t: Value, a: Value, b: Value) -> Value:
    rest, twice = low.sub(1.0, t), low.mul(2.0, t)
    dark = low.mul(a, low.mad(twice, b, rest))
    bright = low.sub(1.0, low.mul(low.mad(twice, low.sub(1.0, b), rest), low.sub(1.0, a)))
    return low.select(low.less(a, 0.5), dark, bright)


def _divide(low: Lowering, t: Value, a: Value, b: Value) -> Value:
    mixed = low.mad(t, low.div(a, b), low.mul(low.sub(1.0, t), a))
    return low.select(low.build.emit("EQUAL", b, 0.0), a, mixed)


def _dodge(low: Lowering, t: Value, a: Value, b: Value) -> Value:
    room = low.sub(1.0, low.mul(t, b))
    bright = low.build.emit("MINIMUM", low.div(a, room), 1.0)
    full = low.select(low.build.emit("GREATER_THAN", room, 0.0), bright, 1.0)
    return low.select(low.build.emit("EQUAL", a, 0.0), a, full)


def _burn(low: Lowering, t: Value, a: Value, b: Value) -> Value:
    room = low.mad(t, b, low.sub(1.0, t))
    dark = low.clamp(low.sub(1.0, low.div(low.sub(1.0, a), room)))
    return low.select(low.build.emit("GREATER_THAN", room, 0.0), dark, 0.0)


def _exclusion(low: Lowering, t: Value, a: Value, b: Value) -> Value:
    other = low.sub(low.add(a, b), low.mul(low.mul(2.0, a), b))
    return low.build.emit("MAXIMUM", low.lerp(a, other, t), 0.0)


def _soft_light(low: Lowering, t: Value, a: Value, b: Value) -> Value:
    screen = low.sub(1.0, low.mul(low.sub(1.0, b), low.sub(1.0, a)))
    soft = low.add(low.mul(low.mul(low.sub(1.0, a), b), a), low.mul(a, screen))
    return low.mad(t, soft, low.mul(low.sub(1.0, t), a))


BLENDS: Mapping[str, Blend] = {
    "MIX": lambda low, t, a, b: low.lerp(a, b, t),
    "ADD": lambda low, t, a, b: low.lerp(a, low.add(a, b), t),
    "SUBTRACT": lambda low, t, a, b: low.lerp(a, low.sub(a, b), t),
    "MULTIPLY": lambda low, t, a, b: low.lerp(a, low.mul(a, b), t),
    "DIFFERENCE": lambda low, t, a, b: low.lerp(a, low.build.emit("ABSOLUTE", low.sub(a, b)), t),
    "DARKEN": lambda low, t, a, b: low.lerp(a, low.build.emit("MINIMUM", a, b), t),
    "LIGHTEN": lambda low, t, a, b: low.lerp(a, low.build.emit("MAXIMUM", a, b), t),
    "LINEAR_LIGHT": lambda low, t, a, b: low.mad(t, low.mad(2.0, b, -1.0), a),
    "SCREEN": _screen,
    "OVERLAY": _overlay,
    "DIVIDE": _divide,
    "DODGE": _dodge,
    "BURN": _burn,
    "EXCLUSION": _exclusion,
    "SOFT_LIGHT": _soft_light,
}


@rule(e.Mix)
def _mix(low: Lowering, node: e.Mix) -> Components:
    factor, a, b = (low.components(v)[:3] for v in (node.factor, node.a, node.b))
    if node.clamp_factor:
        factor = tuple(low.clamp(t) for t in factor)
    if node.blend in BLENDS:
        blend = BLENDS[node.blend]
        out = [blend(low, *column) for column in zip(factor, a, b, strict=True)]
    else:
        out = list(_mix_hsv(low, node.blend, factor[0], a, b))
    if node.clamp_result:
        out = [low.clamp(x) for x in out]
    return colored(out)


def _mix_hsv(low: Lowering, blend: str, t: Value, a: Components, b: Components) -> Components:
    """Hue, saturation, colour or value of `b` on `a`."""
    first, second = _to_hsv(low, a), _to_hsv(low, b)
    if blend == "VALUE":
        return _from_hsv(low, (first[0], first[1], low.lerp(first[2], second[2], t)))
    if blend == "SATURATION":
        # What has no hue gets none.
        mixed = _from_hsv(low, (first[0], low.lerp(first[1], second[1], t), first[2]))
        grey = low.build.emit("EQUAL", first[1], 0.0)
        return tuple(low.select(grey, x, m) for x, m in zip(a, mixed, strict=True))
    replaced = _from_hsv(low, (second[0], second[1] if blend == "COLOR" else first[1], first[2]))
    grey = low.build.emit("EQUAL", second[1], 0.0)
    return tuple(low.select(grey, x, low.lerp(x, r, t)) for x, r in zip(a, replaced, strict=True))


def _to_hsv(low: Lowering, rgb: Components) -> Components:
    return low.build.emit_all("RGB_TO_HSV", *rgb[:3], count=3)


def _from_hsv(low: Lowering, hsv: Components) -> Components:
    return low.build.emit_all("HSV_TO_RGB", *hsv[:3], count=3)


@rule(e.ColorModel)
def _color_model(low: Lowering, node: e.ColorModel) -> Components:
    return vector(*low.build.emit_all(f"{node.source}_TO_{node.target}", *low.components(node.color)[:3], count=3))


@rule(e.HueSaturation)
def _hue_saturation(low: Lowering, node: e.HueSaturation) -> Components:
    color, factor = low.components(node.color)[:3], low.number(node.factor)
    h, s, v = _to_hsv(low, color)
    turned = low.fract(low.add(low.add(h, low.number(node.hue)), 0.5))
    changed = _from_hsv(low, (turned, low.clamp(low.mul(s, low.number(node.saturation))),
                              low.mul(v, low.number(node.value))))
    return vector(*(low.build.emit("MAXIMUM", low.lerp(x, y, factor), 0.0)
                    for x, y in zip(color, changed, strict=True)))


@rule(e.BrightContrast)
def _bright_contrast(low: Lowering, node: e.BrightContrast) -> Components:
    contrast = low.number(node.contrast)
    gain = low.add(1.0, contrast)
    lift = low.sub(low.number(node.brightness), low.mul(contrast, 0.5))
    return vector(*(low.build.emit("MAXIMUM", low.mad(gain, x, lift), 0.0) for x in low.components(node.color)[:3]))


@rule(e.Gamma)
def _gamma(low: Lowering, node: e.Gamma) -> Components:
    gamma = low.number(node.gamma)
    flat = low.build.emit("EQUAL", gamma, 0.0)
    out = []
    for x in low.components(node.color)[:3]:
        raised = low.select(low.build.emit("GREATER_THAN", x, 0.0), low.build.emit("POWER", x, gamma), x)
        out.append(low.select(flat, 1.0, raised))
    return vector(*out)


@rule(e.Invert)
def _invert(low: Lowering, node: e.Invert) -> Components:
    factor = low.number(node.factor)
    return vector(*(low.lerp(x, low.sub(1.0, x), factor) for x in low.components(node.color)[:3]))


@rule(e.Luminance)
def _luminance(low: Lowering, node: e.Luminance) -> Components:
    # The Y row of the matrix from Rec.709 with D65 to XYZ.
    return repeated(low.dot(low.components(node.color)[:3], (0.21263901, 0.71516868, 0.07219232)))
