"""Within what a fit keeps each kind of parameter, and how long its first step is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..scene import parameters
from ..scene.scene import Scene

# Steps of colours and shares, absolute; of angles, radians; of UV maps and lens shifts, in widths of the picture; of
# powers, sizes and radiances as a fraction of their value.
SHARE_STEP = 0.03
ANGLE_STEP = 0.03
PLACE_STEP = 0.01
RELATIVE_STEP = 0.03
# Sizes that start above zero stay above this part of it: a light without size is one of another kind, from which
# no derivative leads back.
LEAST_SIZE = 1e-3

_ANY, _SHARE, _POSITIVE = (-np.inf, np.inf), (0.0, 1.0), (0.0, np.inf)


@dataclass(frozen=True)
class Kind:
    """What a parameter is: its range, and whether its steps go by its value.

    Attributes
    ----------
    range
        Least and greatest value.
    step
        Of the first step; relative ones as a fraction of the value.
    relative
        Whether the step is relative.
    size
        Whether it must stay above zero.
    """

    range: tuple[float, float]
    step: float
    relative: bool = False
    size: bool = False


_COLOR = Kind(_SHARE, SHARE_STEP)
_AMOUNT = Kind(_POSITIVE, RELATIVE_STEP, relative=True)
_SIZE = Kind(_POSITIVE, RELATIVE_STEP, relative=True, size=True)
_OPENING = Kind((0.0, np.pi), RELATIVE_STEP, relative=True, size=True)

# By field, where that is the same for all that have it.
_FIELDS: dict[str, Kind] = {
    **dict.fromkeys(
        ("base_color", "specular_tint", "coat_tint", "sheen_tint", "metallic", "roughness", "diffuse_roughness",
         "transmission", "coat_weight", "coat_roughness", "sheen_weight", "sheen_roughness", "alpha",
         "subsurface_weight", "blend", "normal"), _COLOR),
    **dict.fromkeys(("color", "specular_ior_level", "normal_strength", "weights"), Kind(_POSITIVE, SHARE_STEP)),
    **dict.fromkeys(("emission", "power", "strength"), _AMOUNT),
    **dict.fromkeys(("radius", "size", "ortho_width", "pixel_aspect", "focus_distance", "aperture_radius",
                     "aperture_ratio"), _SIZE),
    **dict.fromkeys(("angle", "spread"), _OPENING),
    "fov_x": Kind((0.0, np.pi - 0.01), RELATIVE_STEP, relative=True, size=True),
    "ior": Kind((0.01, np.inf), SHARE_STEP),
    "coat_ior": Kind((1.0, np.inf), SHARE_STEP),
    "anisotropy": Kind((-1.0, 1.0), SHARE_STEP),
    "anisotropy_rotation": Kind(_ANY, ANGLE_STEP / (2.0 * np.pi)),  # turns
    **dict.fromkeys(("aperture_rotation", "longitude", "latitude"), Kind(_ANY, ANGLE_STEP)),
    "shift": Kind(_ANY, PLACE_STEP),
}  # fmt: skip


def kind_of(scene: Scene, path: str) -> Kind:
    """What a parameter that is no position, direction or pose is."""
    collection, name, field = parameters.split(path)
    value = np.asarray(parameters.get(scene, path))
    within = bool(value.size) and value.min() >= 0.0 and value.max() <= 1.0
    if collection == "images":
        # An environment's image is radiance; what else lies within [0, 1] is a colour, a share or a normal map.
        return _AMOUNT if scene.world.image == name else _COLOR if within else Kind(_ANY, RELATIVE_STEP, relative=True)
    if field.startswith(parameters.ATTRIBUTES):
        uv = value.shape[-1] == 2
        return Kind(_ANY, PLACE_STEP) if uv else _COLOR if within else Kind(_ANY, RELATIVE_STEP, relative=True)
    if field.startswith(parameters.TEXTURES):
        return Kind(_ANY, RELATIVE_STEP, relative=True)
    return _FIELDS[field]


def limits(scene: Scene, path: str) -> tuple[float, float]:
    """Least and greatest value of a parameter's entries during a fit."""
    kind = kind_of(scene, path)
    low, high = kind.range
    value = np.asarray(parameters.get(scene, path), np.float64)
    return (max(low, LEAST_SIZE * float(value.min())) if kind.size else low), high


def first_step(scene: Scene, path: str) -> float:
    """Default length of a parameter's first step."""
    kind = kind_of(scene, path)
    if not kind.relative:
        return kind.step
    value = np.abs(np.asarray(parameters.get(scene, path), np.float64))
    # The mean of many: one bright texel must not set the pace. From 0 there is no scale to go by: the step is in the
    # parameter's own unit.
    scale = float(value.mean() if parameters.split(path)[0] in ("images", "meshes") else value.max())
    return kind.step * (scale or 1.0)
