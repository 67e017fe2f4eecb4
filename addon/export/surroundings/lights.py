"""Export of Blender's lights. The units below were determined by comparison with Cycles.

With the option 'Normalize' and the power P, an area light of the world-space area A has the radiance P / (pi A), a
point light has the intensity P / (4 pi), and the strength of a sun is its irradiance. Without 'Normalize', an area
light has the radiance P / pi, a point light of the radius r has the intensity P r^2 (P / pi for radius 0), and the disc
of a sun has the radiance P.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad.tables.lights import LEAST_BLEND

from ...problem import Report
from .lamp_nodes import LampEmission, own_color
from .shear import BARELY_SHEARED, RIGID, degrees, skew

Light: TypeAlias = edgegrad.PointLight | edgegrad.SpotLight | edgegrad.SunLight | edgegrad.AreaLight
F64 = NDArray[np.float64]
# Blender's largest limit of a light's bounces, its default.
_ANY_BOUNCES = 1024


def power_factor(light: Any) -> float:
    """Factor between `energy` and the emitted power, from the exposure of Blender 4.5 and later."""
    return float(2.0 ** getattr(light, "exposure", 0.0))


def export_light(light_object: Any, matrix: F64, visible: frozenset[str], emission: LampEmission,
                 report: Report) -> Light | None:  # fmt: skip
    """Export a light; return None, with a warning, if it cannot be rendered.

    Parameters
    ----------
    light_object
        Object of type LIGHT (evaluated).
    matrix
        (4, 4) transform of the object or instance to world space.
    visible
        Kinds of rays that see the light, including the settings of its instancer.
    emission
        What its nodes say.
    """
    light = light_object.data
    where = f"light '{light_object.name}'"
    if light.type == "AREA" and getattr(getattr(light, "cycles", None), "is_portal", False):
        report.warn(where, "is a portal, which only guides samples; it is left out")
        return None
    color = own_color(light) * emission.factor
    power = float(light.energy) * power_factor(light)
    if color.min() < 0.0 and color.max() <= 0.0:
        power, color = -power, -color
    if color.min() < 0.0:
        report.warn(where, "its colour is negative in some channels and positive in others; it is left out")
        return None
    out: Light | None
    if light.type == "AREA":
        out = _area_light(light, matrix, where, power, report)
    elif light.type == "SUN":
        out = _sun(light, matrix, power)
    else:
        out = _point_or_spot(light, matrix, where, power, report)
    if out is None:
        return None
    out.color = color
    if not isinstance(out, edgegrad.SunLight):
        out.decay, out.smooth = emission.decay, emission.smooth
    # The camera never sees sun lights in Cycles.
    out.visible_to = (visible | {"shadow"}) - ({"camera"} if light.type == "SUN" else set())
    cycles = getattr(light, "cycles", None)
    limit = getattr(cycles, "max_bounces", _ANY_BOUNCES)
    out.max_bounces = None if limit >= _ANY_BOUNCES else int(limit)
    out.casts_shadow = bool(getattr(cycles, "cast_shadow", light.use_shadow))  # a property of Cycles before Blender 4.3
    return out


def warn_about_translucent(scene: edgegrad.Scene, closures: Iterable[edgegrad.Material], names: Mapping[str, str],
                           world: Any, report: Report) -> None:  # fmt: skip
    """Warn of light that only one of diffuse and transmitted rays sees, if there are translucent surfaces.

    Samples of lights count translucent surfaces as diffuse. Rays from them see objects if transmission does; in Cycles
    they see lights and the world only if both do.

    Parameters
    ----------
    names
        Blender's names of lights and meshes by their keys, with what they are.
    world
        Blender's world, or None.
    """
    if not any(one.kind == "TRANSLUCENT" for one in closures):
        return
    seen = "is hidden from one of diffuse and transmission rays; translucent surfaces receive "

    def hidden(item: Any) -> bool:
        return ("diffuse" in item.visible_to) != ("transmission" in item.visible_to)

    for key, light in scene.lights.items():
        if hidden(light):
            report.warn(names[key], seen + "some of its light as transmission, in Cycles only if both see it")
    for key, mesh in scene.meshes.items():
        if hidden(mesh) and scene.emits(key):
            report.warn(names[key], seen + "some of its light, by another rule than in Cycles")
    if world is not None and hidden(scene.world):
        report.warn(f"world '{world.name}'", seen + "its light as transmission, in Cycles only if both see it")


def warn_about_unshadowing(scene: edgegrad.Scene, names: Mapping[str, str], report: Report) -> None:
    """Warn of emissive meshes that shadow rays do not meet, `names` as in `warn_about_translucent`."""
    for key, mesh in scene.meshes.items():
        if "shadow" not in mesh.visible_to and mesh.visible_to != {"camera"} and scene.emits(key):
            report.warn(names[key], "glows and is hidden from shadow rays: light sampling sees its far side through "
                        "its near side, other rays do not; as in Cycles, how much of that light counts depends on the "
                        "sampling, and so differs a little")  # fmt: skip


def warn_about_limits(scene: edgegrad.Scene, bounces: int, names: Mapping[str, str], report: Report) -> None:
    """Warn of lights that rays may meet after more bounces than they shine for, `names` as in `warn_about_translucent`.

    Parameters
    ----------
    bounces
        Limit of the bounces of all paths.
    """
    for key, light in scene.lights.items():
        if light.max_bounces is None or light.max_bounces >= bounces:
            continue
        has_size = light.angle > 0.0 if isinstance(light, edgegrad.SunLight) else getattr(light, "radius", 1.0) > 0.0
        if has_size and light.visible_to & {"glossy", "transmission"}:
            report.warn(names[key], f"shines for paths of at most {light.max_bounces} bounces; in Cycles, rays that "
                        "meet the light itself bring more, as caustics do")  # fmt: skip


def _sun(light: Any, matrix: F64, power: float) -> edgegrad.SunLight:
    angle = float(light.angle)
    if not getattr(light, "normalize", True) and angle > 0.0:
        power *= np.pi * np.sin(0.5 * angle) ** 2
    return edgegrad.SunLight(-matrix[:3, 2] / np.linalg.norm(matrix[:3, 2]), power, min(angle, np.pi))


def _point_or_spot(light: Any, matrix: F64, where: str, power: float, report: Report) -> Light:
    radius = float(light.shadow_soft_size)
    if not getattr(light, "normalize", True):
        power *= 4.0 * np.pi * radius**2 if radius > 0.0 else 4.0
    position, sphere = matrix[:3, 3].copy(), not getattr(light, "use_soft_falloff", True)
    if light.type == "POINT":
        return edgegrad.PointLight(position, power, radius, sphere)
    scale = np.maximum(np.linalg.norm(matrix[:3, :3], axis=0), 1e-20)
    angle = min(float(light.spot_size), np.pi - 1e-4)
    spot = edgegrad.SpotLight(position, -matrix[:3, 2] / scale[2], power, angle, light.spot_blend, radius, sphere)
    axes = matrix[:3, :3] / scale
    sheared = skew(axes)
    if sheared > RIGID and abs(np.linalg.det(axes)) > RIGID:  # a flattened cone has no inside
        spot.direction, spot.stretch, spot.across = _sheared_cone(matrix[:3, :3], angle, light.spot_blend)
        spot.blend = max(spot.blend, LEAST_BLEND)
        if sheared > BARELY_SHEARED and spot.blend > LEAST_BLEND:
            report.warn(where, f"its parents' uneven scale shears it by {degrees(sheared):.2g} degrees; "
                        "within the blend of its cone its light differs from Cycles' by some percent")  # fmt: skip
        return spot
    wide = np.maximum(scale[:2] / scale[2], 1e-6)  # Blender scales the cone with the object
    if light.spot_blend < LEAST_BLEND and np.isclose(wide[0], wide[1], rtol=1e-3):  # a hard edge of a round cone
        spot.angle = 2.0 * float(np.arctan(wide[0] * np.tan(0.5 * angle)))
    elif not np.allclose(wide, 1.0, rtol=1e-3):
        spot.stretch, spot.across = wide, matrix[:3, 0] / scale[0]
    return spot


def _area_light(light: Any, matrix: F64, where: str, power: float, report: Report) -> edgegrad.AreaLight | None:
    scale = np.linalg.norm(matrix[:3, :3], axis=0)
    size = np.array([light.size, light.size_y if light.shape in ("RECTANGLE", "ELLIPSE") else light.size])
    size = size * scale[:2]
    if size.min() <= 0.0 or scale[2] <= 0.0 or abs(np.linalg.det(matrix[:3, :3] / scale)) < RIGID:
        report.warn(where, "has no size; it is left out")
        return None
    to_world = matrix.copy()
    to_world[:3, :3] /= scale
    if np.linalg.det(to_world[:3, :3]) < 0.0:
        to_world[:3, 0] *= -1.0  # a mirrored light still shines along its -Z, and its shape is symmetric
    shape = "RECTANGLE" if light.shape in ("SQUARE", "RECTANGLE") else "ELLIPSE"
    if not getattr(light, "normalize", True):  # then energy is per square metre
        power *= float(size.prod()) * (1.0 if shape == "RECTANGLE" else np.pi / 4.0)
    # The largest value in Blender is 180 degrees, rounded to float32.
    spread = float(light.spread) if light.spread < np.pi - 1e-6 else float(np.pi)
    sheared = skew(to_world[:3, :3])
    if sheared > RIGID:
        to_world, widths = _straight(to_world)
        size = size * widths
    if sheared > BARELY_SHEARED:
        as_cycles = shape == "ELLIPSE" and spread == np.pi
        report.warn(where, f"its parents' uneven scale shears it by {degrees(sheared):.2g} degrees; here its sides "
                    "stay at right angles" + ("" if as_cycles else "; in Cycles such a light may be half as bright "
                    "where it is a rectangle or has a spread; scale it by its size instead"))  # fmt: skip
    return edgegrad.AreaLight(to_world, size, shape, power, spread)


def _sheared_cone(matrix: F64, angle: float, blend: float) -> tuple[F64, F64, F64]:
    """Direction, stretch and first axis of the elliptic cone that a matrix makes of a round one about -Z.

    With q = matrix^-1 d, the cone is where q.x^2 + q.y^2 = tan(angle/2)^2 q.z^2, a quadratic form in d whose
    eigenvectors are the cone's axes. Only one of its eigenvalues is negative. Each brightness within the blend has a
    cone with other axes: these are of half the brightness.
    """
    cosine = np.cos(0.5 * angle)
    inverse, wide = np.linalg.inv(matrix), np.tan(np.arccos(cosine + 0.5 * blend * (1.0 - cosine)))
    values, axes = np.linalg.eigh(inverse.T @ np.diag([1.0, 1.0, -wide * wide]) @ inverse)
    direction = axes[:, 0] * (-1.0 if axes[:, 0] @ matrix[:, 2] > 0.0 else 1.0)
    return direction, np.sqrt(-values[0] / values[1:]) / wide, axes[:, 1]


def _straight(to_world: F64) -> tuple[F64, F64]:
    """Return a rigid transform for a sheared area light, and the (2,) factors of its sides.

    As in Cycles' samples of round lights, the light shines along -Z, so that its projection along Z gives its light.
    """
    x, y, z = to_world[:3, :3].T
    across, along = x - (x @ z) * z, y - (y @ z) * z
    width = np.linalg.norm(across)
    out = to_world.copy()
    out[:3, :3] = np.stack([across / width, np.cross(z, across / width), z], axis=1)
    return out, np.array([width, abs(along @ out[:3, 1])])
